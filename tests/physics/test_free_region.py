"""Where a cart-pole moves freely."""

import math

import numpy as np
import pytest

from mjcartpole.physics.free_region import ANYWHERE, FreeRegion, free_region, wide_box
from mjcartpole.physics.load import load_model
from mjcartpole.task import CARTPOLE_V1, Task

REFERENCE = load_model("cartpole").xml
SWING_UP = Task("swing-up", theta_limit=math.inf)
NO_ENDS = Task("no ends", x_limit=math.inf)
THETA_LIMIT = CARTPOLE_V1.theta_limit


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
    tight = free_region(cartpole("hinge", f'range="-{THETA_LIMIT!r} 1"'))
    assert tight.theta == (-THETA_LIMIT, 1)
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
        assert region.x == (-2.4, 2.4)
        assert region.covers_task


def test_another_task_asks_for_another_room():
    limited, leaning = cartpole(attributes='range="-2 2"'), cartpole("hinge", 'range="-1 1"')
    assert free_region(limited, task=Task("short", x_limit=1)).covers_task
    assert not free_region(limited, task=NO_ENDS).covers_task
    assert not free_region(limited, task=NO_ENDS).blocked
    assert free_region(leaning).covers_task
    assert not free_region(leaning, task=SWING_UP).covers_task
    tight = cartpole(attributes='range="-0.001 0.001"')
    assert free_region(tight, task=NO_ENDS).blocked
    assert free_region(tight, task=Task("tight", x_limit=1e-3)).covers_task
    for task in (SWING_UP, NO_ENDS):
        assert free_region(load_model(), task=task).covers_task
        assert np.isfinite(free_region(load_model(), task=task).box(wide_box(task))).all()


@pytest.mark.long
def test_contacts_are_sought_where_a_task_lets_the_pole_go():
    low = f'<geom name="low" type="box" size="5 1 0.05" pos="0 0 -0.7" {TOUCHING}/>'
    hits = load_model(
        cartpole(world=low).xml.replace('<geom name="pole"', f'<geom name="pole" {TOUCHING}')
    )
    assert free_region(hits).covers_task
    assert free_region(hits, task=SWING_UP).blocked == ("contact between geoms 'low' and 'pole'",)
    deeper = load_model(hits.xml.replace("-0.7", "-1.5"))
    found = free_region(deeper, task=SWING_UP)
    assert (found.theta, found.covers_task) == (ANYWHERE, True)


def test_an_endless_track_is_searched_as_far_as_states_are_drawn():
    post = f'<geom name="post" type="box" size="0.05 1 1" pos="3 0 0" {TOUCHING}/>'
    assert free_region(cartpole(world=post, geom=TOUCHING), task=NO_ENDS).blocked
    far = free_region(cartpole(world=post.replace("3 0", "30 0"), geom=TOUCHING), task=NO_ENDS)
    assert far.x == (-4.8, 4.8)
    assert not far.covers_task
    assert far.bounds == ("geoms that may collide, and do not within 4.8 m of the track's middle",)


def test_states_are_in_it_or_not():
    region = FreeRegion((-1, 2), (-0.1, 0.1))
    states = np.array([[0, 9, 0, 9], [2, 0, 0.1, 0], [2.1, 0, 0, 0], [0, 0, -0.2, 0]])
    assert region.holds(states).tolist() == [True, True, False, False]
    assert region.within((-9, 1), (-9, 9)) == FreeRegion((-1, 1), (-0.1, 0.1))
