"""Sine and cosine of one angle: the bits of the C library, for small angles mostly without it.

glibc returns the number nearest to the true value, unless that value lies next to the middle
between two: what it adds up is rounded once, and errs by little before. A short series does the
same. Where all by which both may err decides nothing (Ziv, 1991, doi:10.1145/114697.116813), they
agree; elsewhere, for a few angles of a hundred, the library is called.
"""

import math
import platform

import numpy as np

from mjcartpole.learning.linking import inlined

SMALL = 0.125
"""rad. Beyond, the bounds on what both may err by do not hold."""

TINY = 2.0**-26
"""rad. Nearer to zero a sign could be lost."""

IS_GLIBC = platform.libc_ver()[0] == "glibc"
"""Of other libraries nothing is known, and they are always called."""

_S3, _S5, _S7, _S9, _S11 = ((-1) ** n / math.factorial(2 * n + 1) for n in range(1, 6))
_C2, _C4, _C6, _C8, _C10 = ((-1) ** n / math.factorial(2 * n) for n in range(1, 6))


@inlined
def series(angle: float) -> tuple[float, float, bool]:
    """Return sine and cosine of a small angle, and whether these are surely the nearest numbers.

    With u = 2^-53, and a rounding for each operation, the sum that is taken from the angle errs by
    less than 0.9 u angle^3 and that which is taken from 1 by less than 1.8 u angle^2. The rest of
    the doubt is glibc's, and some five times of what it needs: beyond half of an ulp its sine errs
    by 0.005 at most, its cosine by 0.0004.
    """
    square = angle * angle
    bent = square * (_S3 + square * (_S5 + square * (_S7 + square * (_S9 + square * _S11))))
    fallen = square * (_C2 + square * (_C4 + square * (_C6 + square * (_C8 + square * _C10))))
    doubt = square * 2.0**-52 + 2.0**-60
    sine, cosine = angle + angle * (bent + doubt), 1.0 + (fallen + doubt)
    is_sure = sine == angle + angle * (bent - doubt) and cosine == 1.0 + (fallen - doubt)
    return sine, cosine, is_sure


@inlined
def sine_and_cosine(angle: float) -> tuple[float, float]:
    """Return `np.sin` and `np.cos` of an angle, as compiled code has them."""
    if IS_GLIBC and TINY < abs(angle) < SMALL:
        sine, cosine, is_sure = series(angle)
        if is_sure:
            return sine, cosine
    return np.sin(angle), np.cos(angle)
