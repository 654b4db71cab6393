"""What is for the eye alone is left out, and nothing else: bits stay."""

import mujoco
import numpy as np
import pytest

from mjcartpole.physics.bare import bare
from mjcartpole.physics.load import load_model, model_names
from mjcartpole.physics.simulation import Simulation

TEXT = load_model("cartpole").xml
SPRING = '<joint name="slider" springref="0.3" stiffness="2"'
FORCED = {
    "a spring": TEXT.replace('<joint name="slider"', SPRING),
    "damping that grows": TEXT.replace('<joint damping="0"', '<joint damping="0.1 0.2"'),
    "air": TEXT.replace("<option ", '<option density="1.2" viscosity="0.1" wind="1 0 0" '),
    "lift": TEXT.replace('<body name="pole"', '<body name="pole" gravcomp="0.5"'),
}
"""Documents with forces that no joint's motor gives."""

SENSOR = '<sensor><distance geom1="cart" geom2="floor" cutoff="9"/></sensor></mujoco>'
SLEEP = '<option><flag sleep="enable"/></option><option '
KEPT = {
    "contacts": TEXT.replace('contype="0" conaffinity="0"', 'contype="1" conaffinity="1"'),
    "a sensor that looks at geoms": TEXT.replace("</mujoco>", SENSOR),
    "a fluid around geoms": TEXT.replace('name="pole" t', 'name="pole" fluidshape="ellipsoid" t'),
    "bodies that may sleep": TEXT.replace("<option ", SLEEP),
    "files, though a comment names them": TEXT.replace("</asset>", '<!-- file="a" --></asset>'),
}
"""Documents whose geoms may count, or that would be read from files again."""


def random_steps(cartpole, integrator):
    """States of random control steps, in episodes of 50 from anywhere."""
    rng, simulation = np.random.default_rng(0), Simulation(cartpole, integrator)
    for number in range(300):
        if number % 50 == 0:
            simulation.state = rng.uniform(-1, 1, simulation.size)
        yield simulation.step(cartpole.controls[rng.integers(2)])


def assert_alike(full, integrator="gym"):
    lean = bare(full)
    assert (lean.model.ngeom, lean.model.ncam, lean.model.nlight) == (0, 0, 0)
    assert list(random_steps(full, integrator)) == list(random_steps(lean, integrator))
    return lean


@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
@pytest.mark.parametrize("name", model_names())
def test_it_moves_alike_bit_for_bit(name, integrator):
    assert_alike(load_model(name), integrator)


@pytest.mark.parametrize("why", FORCED)
def test_passive_forces_stay(why):
    full = load_model(FORCED[why])
    assert_alike(full)
    plain = list(random_steps(load_model("cartpole"), "gym"))
    assert list(random_steps(full, "gym")) != plain


@pytest.mark.parametrize("why", KEPT)
def test_a_model_stays_whole_where_something_may_depend_on_geoms(why):
    full = load_model(KEPT[why])
    assert bare(full).model.ngeom == full.model.ngeom > 0


def test_a_model_stays_whole_where_somebody_gives_forces_of_his_own():
    full = load_model("cartpole")
    mujoco.set_mjcb_passive(lambda model, data: None)
    try:
        assert bare(full).model.ngeom == full.model.ngeom
    finally:
        mujoco.set_mjcb_passive(None)
    assert bare(full).model.ngeom == 0


def test_numbers_that_were_changed_after_compiling_count():
    changed, again = load_model("cartpole"), load_model("cartpole")
    bare(changed)
    changed.model.opt.gravity[2] = -1.0
    changed.model.body_mass[1] = 3.0
    assert bare(changed).model.opt.gravity[2] == -1.0
    assert list(random_steps(bare(changed), "gym")) == list(random_steps(changed, "gym"))
    assert_alike(again)


def test_what_it_gives_is_no_part_of_what_it_was_given():
    """A cart-pole that stays whole may be changed later; the next one is not."""
    first, second = load_model(KEPT["contacts"]), load_model(KEPT["contacts"])
    bare(first)
    first.model.opt.gravity[2] = -1.0
    assert bare(second).model.opt.gravity[2] == -9.8
