"""Where a cart-pole moves freely."""

import math

import numpy as np
import pytest

from mjcartpole import task
from mjcartpole.physics.free_region import FreeRegion, free_region
from mjcartpole.physics.load import load_model

REFERENCE = load_model("cartpole").xml
ANYWHERE = (-math.inf, math.inf)


def cartpole(joint="slider", attributes="", world="", geom=""):
    text = REFERENCE.replace(f'name="{joint}"', f'name="{joint}" {attributes}', 1)
    text = text.replace("<worldbody>", f"<worldbody>{world}", 1)
    return load_model(text.replace('<geom name="cart"', f'<geom name="cart" {geom}', 1))


def test_nothing_bounds_the_reference():
    assert free_region(load_model()) == FreeRegion(ANYWHERE, ANYWHERE)
    assert free_region(load_model()).covers_task


def test_a_joints_limit_bounds_it_and_its_margin_too():
    region = free_region(cartpole(attributes='range="-1.5 3" margin="0.25"'))
    assert (region.x, region.theta) == ((-1.25, 2.75), ANYWHERE)
    assert region.bounds == ("limit of joint 'slider' at -1.5 and 3",)
    assert not region.covers_task
    assert free_region(cartpole(attributes='range="-2.4 2.4"')).covers_task
    tight = free_region(cartpole("hinge", f'range="-{task.THETA_LIMIT!r} 1"'))
    assert tight.theta == (-task.THETA_LIMIT, 1)
    assert tight.covers_task


def test_a_limit_without_room_blocks():
    region = free_region(cartpole(attributes='range="-0.001 0.001"'))
    assert region.blocked == ("limit of joint 'slider' at -0.001 and 0.001",)
    assert not region.covers_task


TOUCHING = 'contype="1" conaffinity="1"'


@pytest.mark.parametrize(("x", "touches"), [(2.5, True), (2.7, False)])
def test_geoms_bound_it_where_they_meet_within_the_tasks_limits(x, touches):
    post = f'<geom name="post" type="box" size="0.05 1 1" pos="{x} 0 0" {TOUCHING}/>'
    region = free_region(cartpole(world=post, geom=TOUCHING))
    assert bool(region.blocked) == touches
    if touches:
        assert region.blocked == ("contact between geoms 'post' and 'cart'",)
    else:
        assert region.x == (-task.X_LIMIT, task.X_LIMIT)
        assert region.covers_task


def test_states_are_in_it_or_not():
    region = FreeRegion((-1, 2), (-0.1, 0.1))
    states = np.array([[0, 9, 0, 9], [2, 0, 0.1, 0], [2.1, 0, 0, 0], [0, 0, -0.2, 0]])
    assert region.holds(states).tolist() == [True, True, False, False]
    assert region.within((-9, 1), (-9, 9)) == FreeRegion((-1, 1), (-0.1, 0.1))
