"""Models with other numbers."""

import copy

import pytest

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.errors import ConfigError
from mjcartpole.physics.load import load_model, load_shared, same_model
from mjcartpole.physics.variants import contexts_of, variant, write_numbers

NUMBERS = {"pole.length": 1.3, "pole.mass": 0.2, "cart.mass": 0.7, "force": 12.0, "gravity": 3.7}


@pytest.mark.parametrize("name", ["cartpole", "long", "heavy"])
def test_a_variant_is_the_model_of_its_edits(name: str) -> None:
    base = load_shared(name)
    found = variant(base, NUMBERS)
    assert same_model(found.model, load_model(name, NUMBERS).model)
    assert variant(base, NUMBERS) is found


def test_numbers_that_are_written_leave_nothing_stale() -> None:
    base = load_model("cartpole")
    model = copy.copy(base.model)
    for numbers in (NUMBERS, {**NUMBERS, "hinge.damping": 0.1, "timestep": 0.01}, {}):
        found = variant(base, numbers) if numbers else base
        write_numbers(found.model, model)
        assert same_model(model, found.model)


def test_another_kind_of_model_is_refused() -> None:
    with pytest.raises(ConfigError, match="of another shape"):
        write_numbers(load_model("twopoles").model, copy.copy(load_model("cartpole").model))


def test_the_ends_of_a_range_are_tried() -> None:
    base = load_shared("cartpole")
    with pytest.raises(ConfigError, match=r"vary 'pole.mass=0:1' cannot be: pole.mass must be"):
        contexts_of(base, Disturbances(vary={"pole.mass": (0, 1)}))
    with pytest.raises(ConfigError, match="vary 'force=1,2,-3' cannot be"):
        contexts_of(base, Disturbances(vary={"force": (1, 2, -3)}))
    assert contexts_of(base, Disturbances(vary={"force": (1, 2)}, pool=3, widen=4)).pool == 3
