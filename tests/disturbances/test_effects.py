"""What disturbances do in a control step, held against hand-computed steps."""

import math
from typing import Any

import numpy as np
import pytest

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.disturbances.effects import Effects, actuate, forget, sense
from mjcartpole.task import CARTPOLE_V1, SWING_UP, Task

STEP = 0.02


class Hand:
    """Effects at hand."""

    def __init__(self, task: Task = CARTPOLE_V1, seed: int = 0, **given: Any) -> None:
        made: tuple[Effects, list[float]] = Disturbances(**given).effects(1, STEP, task)
        self.effects, self.memory = made
        self.rng = np.random.default_rng(seed)
        forget(self.effects, self.memory)

    def pushes(self, *actions: float) -> list[float]:
        return [self.act(action)[0] for action in actions]

    def forces(self, steps: int) -> list[float]:
        return [self.act(1.0)[1] for _ in range(steps)]

    def act(self, action: float) -> tuple[float, float]:
        return actuate(self.effects, self.memory, action, self.rng)

    def see(self, *state: float) -> list[float]:
        seen = [*state, *[0.0] * self.effects.actions]
        sense(self.effects, self.memory, seen, self.rng)
        return seen


def test_nothing_is_done_where_nothing_is_asked_for() -> None:
    hand = Hand()
    before = hand.rng.bit_generator.state
    assert [hand.act(a) for a in (1.0, -1.0, 0.25)] == [(1.0, 0.0), (-1.0, 0.0), (0.25, 0.0)]
    assert hand.see(0.1, 0.2, 0.3, 0.4) == [0.1, 0.2, 0.3, 0.4]
    assert hand.rng.bit_generator.state == before


def test_a_delay_shifts_pushes_and_none_pushes_before() -> None:
    assert Hand(delay=2).pushes(1, -1, -1, 1, 1) == [0, 0, 1, -1, -1]


def test_an_episode_forgets_the_one_before() -> None:
    hand = Hand(delay=2, lag=0.05, hold=0.0, observe_actions=2)
    first = hand.pushes(1, 1, 1, 1)
    forget(hand.effects, hand.memory)
    assert hand.see(0, 0, 0, 0)[4:] == [0, 0]
    assert hand.pushes(1, 1, 1, 1) == first


def test_a_lag_is_of_first_order() -> None:
    lag = 0.05
    pushes = Hand(lag=lag).pushes(*[1.0] * 5)
    expected = [1 - math.exp(-STEP * (k + 1) / lag) for k in range(5)]
    np.testing.assert_allclose(pushes, expected, rtol=1e-12)


def test_a_held_push_is_the_one_before_and_a_dropped_one_is_none() -> None:
    assert Hand(hold=1.0).pushes(1, 1, -1) == [0, 0, 0]
    assert Hand(drop=1.0).pushes(1, 1, -1) == [0, 0, 0]
    actions = np.where(np.arange(20_000) % 2, 1.0, -1.0)
    held = np.array(Hand(hold=0.25).pushes(*actions))
    assert set(held.tolist()) <= {-1.0, 0.0, 1.0}
    # One in four repeats what was before; of these the pushes change at each step.
    assert abs((held == actions).mean() - (0.75 + 0.25 * 0.2)) < 0.02
    dropped = np.array(Hand(drop=0.25).pushes(*actions))
    assert abs((dropped == 0).mean() - 0.25) < 0.02


def test_noise_is_a_force_with_its_standard_deviation() -> None:
    forces = np.array(Hand(force_noise=3.0).forces(20_000))
    assert abs(forces.std() - 3.0) < 0.06
    assert abs(forces.mean()) < 0.06


def test_a_shove_at_a_given_time_comes_once() -> None:
    forces = Hand(push=["0.5@0.04s", "-1@0.08s"]).forces(6)
    assert forces == [0, 0, 25.0, 0, -50.0, 0]


def test_shoves_at_random_come_as_often_as_asked_for_to_either_side() -> None:
    forces = np.array(Hand(push="0.5@~0.2s").forces(50_000))
    assert set(forces.tolist()) == {-25.0, 0.0, 25.0}
    assert abs((forces != 0).mean() - 0.1) < 0.01
    assert abs((forces > 0).sum() / (forces != 0).sum() - 0.5) < 0.03


def test_what_is_seen_is_late_and_first_the_start_again() -> None:
    hand = Hand(sensor_delay=2)
    seen = [hand.see(0, 0, 0, 0)]
    for step in range(1, 6):
        hand.act(1.0)
        seen.append(hand.see(step, 10 * step, -step, 0))
    assert [row[0] for row in seen] == [0, 0, 0, 1, 2, 3]
    assert [row[1] for row in seen] == [0, 0, 0, 10, 20, 30]


def test_bias_noise_and_steps_of_what_is_seen() -> None:
    assert Hand(bias=(1, 2, 3, 4)).see(0, 0, 0, 0) == [1, 2, 3, 4]
    assert Hand(bias=0.5).see(0, 0, 0, 0) == [0.5] * 4
    assert Hand(quantize=(0.1, 0, 0.5, 1)).see(0.26, 0.26, 0.26, -0.5) == pytest.approx(
        [0.3, 0.26, 0.5, 0.0]
    )
    hand = Hand(noise=(0, 0.5, 0, 0))
    drawn = np.array([hand.see(1, 1, 1, 1) for _ in range(20_000)])
    assert set(drawn[:, [0, 2, 3]].ravel().tolist()) == {1.0}
    assert abs(drawn[:, 1].std() - 0.5) < 0.01


def test_an_angle_that_turns_counts_from_minus_pi_to_pi_when_disturbed_too() -> None:
    seen = Hand(SWING_UP, bias=(0, 0, 0.2, 0)).see(0, 0, math.pi - 0.1, 0)
    assert seen[2] == pytest.approx(-math.pi + 0.1)


def test_the_last_actions_are_seen_latest_first() -> None:
    hand = Hand(observe_actions=3, delay=4)
    for action in (1.0, -1.0, -1.0, 1.0):
        hand.act(action)
    assert hand.see(0, 0, 0, 0)[4:] == [1.0, -1.0, -1.0]
