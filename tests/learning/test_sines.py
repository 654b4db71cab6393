"""Sine and cosine: the bits of the C library, and the nearest numbers where it is not asked."""

import math
from fractions import Fraction

import numba
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjcartpole.learning import sines
from mjcartpole.learning.sines import SMALL, TINY, series, sine_and_cosine

small = st.floats(TINY, SMALL, exclude_min=True, exclude_max=True) | st.floats(
    -SMALL, -TINY, exclude_min=True, exclude_max=True
)


@numba.njit(error_model="numpy")
def differing(angles: npt.NDArray[np.float64]) -> int:
    """Count the angles for which a bit is another one, of a zero the sign too."""
    found = 0
    for angle in angles:
        sine, cosine = sine_and_cosine(angle)
        same_sign = math.copysign(1.0, sine) == math.copysign(1.0, np.sin(angle))
        found += not (same_sign and sine == np.sin(angle) and cosine == np.cos(angle))
    return found


@pytest.mark.parametrize("width", [3.2, 0.25, SMALL, 0.03, 1e-3, 1e-6, 1e-9])
def test_bits_are_those_of_the_library(width: float) -> None:
    angles = np.random.default_rng(0).uniform(-width, width, 500_000)
    assert differing(angles) == 0


def test_bits_at_the_borders_are_those_of_the_library() -> None:
    borders = [0.0, TINY, SMALL, 2.0**-27, 5e-324]
    near = [np.nextafter(value, towards) for value in borders for towards in (-1.0, 1.0)]
    angles = np.array([*borders, *near])
    assert differing(np.concatenate([angles, -angles])) == 0
    assert np.isnan(_compiled(math.nan)).all()


@numba.njit(error_model="numpy")
def _compiled(angle: float) -> tuple[float, float]:
    return sine_and_cosine(angle)


@given(small)
def test_what_is_sure_is_the_nearest_number(angle: float) -> None:
    sine, cosine, is_sure = series(angle)
    if is_sure:
        assert is_nearest(sine, exact(angle, 1))
        assert is_nearest(cosine, exact(angle, 0))


def exact(angle: float, first: int) -> Fraction:
    """Return the sine (1) or the cosine (0) of a small angle to some 50 digits."""
    x, total = Fraction(angle), Fraction(0)
    for n in range(first, 30, 2):
        total += (-1) ** (n // 2) * x**n / math.factorial(n)
    return total


def is_nearest(found: float, true: Fraction) -> bool:
    """Whether no neighbour is as near."""
    others = (np.nextafter(found, -2.0), np.nextafter(found, 2.0))
    error = abs(Fraction(found) - true)
    return all(error < abs(Fraction(float(other)) - true) for other in others)


def test_nearly_all_small_angles_are_sure() -> None:
    angles = np.random.default_rng(0).uniform(-SMALL, SMALL, 10_000).tolist()
    assert np.mean([series(angle)[2] for angle in angles]) > 0.9


@pytest.mark.parametrize("off", [1.02, 1.0 - 2.0**-48])
def test_a_series_that_errs_by_more_is_found_out(
    off: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sines, "_S3", sines._S3 * off)
    angles = np.random.default_rng(0).uniform(0.1, SMALL, 20_000).tolist()
    found = [(angle, *series(angle)) for angle in angles]
    assert not all(is_nearest(sine, exact(angle, 1)) for angle, sine, _, sure in found if sure)


@pytest.mark.skipif(not sines.IS_GLIBC, reason="bounds are known of glibc only")
def test_the_library_errs_by_a_third_of_what_is_allowed() -> None:
    angles = np.random.default_rng(1).uniform(-SMALL, SMALL, 5_000)
    for angle in angles.tolist():
        sine, cosine = math.sin(angle), math.cos(angle)
        allowed = Fraction(angle**2 * 2.0**-53 + 2.0**-60) / 3
        assert beyond_half(sine, exact(angle, 1)) <= abs(Fraction(angle)) * allowed
        assert beyond_half(cosine, exact(angle, 0)) <= Fraction(2.0**-60) / 3


def beyond_half(found: float, true: Fraction) -> Fraction:
    """Return by how much a number errs beyond half of an ulp."""
    return abs(Fraction(found) - true) - Fraction(math.ulp(found)) / 2
