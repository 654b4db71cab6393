"""Playable or not: whether some policy may balance a model, or every one loses.

Two proofs, from starts drawn as episodes draw them. By exhaustion: every sequence of actions ends
the episode within a few steps. By comparison: where a steady push to either side lets the pole
fall, or the cart leave, to the same side, every policy lies between the two and ends there as well.

What is merely hard is said to be that: where a few steps of one action are an episode, tables and
searches still last, if what they see is fine enough (200 N on CartPole-v1, Wieland's short pole).
"""

import math
from collections import Counter
from typing import Final

import mujoco
import numpy as np

from mjcartpole.errors import SimulationError
from mjcartpole.integrator import Integrator
from mjcartpole.physics.bodies import starting_state
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.simulation import Simulation, State
from mjcartpole.task import CARTPOLE_V1, Task, max_abs

STARTS: Final = 8

LEAST_LOST: Final = 6
"""Starts that no policy survives, from which on a model cannot be balanced."""

HORIZON: Final = 25
"""Control steps; a sequence of actions that lasts so long may last for ever."""

MOST_STEPS: Final = 30_000
"""Physics steps of everything together, some 50 ms; beyond them nothing is proven."""

MOST_TRIALS: Final = 1_000
"""Control steps to exhaust one start."""

COARSE: Final = 3
"""Control steps within which a push that is held should not end an episode (CartPole-v1: 9)."""

_SHIFT: Final = 1e-6
"""Of an acceleration, relative; a smaller change with the cart's place is the solver's."""

_ADVICE: Final = {
    "thrown": "one step changes too much: look at the force, the time step, the pole's length and "
    "inertia, gravity and damping",
    "fallen": "the pole falls to one side even against the full force: use a larger force, or less "
    "friction, mass or gravity",
    "carried": "the cart leaves to one side even against the full force; use a larger one, or "
    "take out what pulls along the rail",
}


def why_unplayable(
    cartpole: CartPole, integrator: Integrator = "gym", *, task: Task = CARTPOLE_V1
) -> str | None:
    """Say in one line that no policy can balance a model, where that is proven, or that it is hard.

    None where neither is so.
    """
    search = _Search(Simulation(cartpole, integrator), task)
    starts = np.random.default_rng(0).uniform(
        task.start_low, task.start_high, (STARTS, search.simulation.size)
    )
    try:
        lost = search.lost((starts + starting_state(cartpole, task)).tolist())
    except SimulationError:
        return None  # It says so itself when it is run.
    if len(lost) < LEAST_LOST:
        return _too_coarse(search)
    (kind, _), *_ = Counter(kind for kind, _ in lost).most_common(1)
    steps = max(steps for _, steps in lost)
    this = "this" if len(lost) == STARTS else "this from most starts"
    when = f"within {steps} steps" if steps > 1 else "in its first step"
    return (
        f"no policy can balance {this}: from {len(lost)} of {STARTS} starts every sequence of "
        f"actions ends the episode {when}; {_ADVICE[kind]}"
    )


def _too_coarse(search: "_Search") -> str | None:
    """Say that a few steps of one action are an episode, where they are."""
    steps = [search.held(control) for control in search.simulation.cartpole.controls]
    if max(steps) > COARSE:
        return None
    return (
        "hard to balance: from upright at rest either action, held, ends the episode within "
        f"{max(steps)} steps, and CartPole-v1's within 9; {_ADVICE['thrown']}"
    )


class _Search:
    """What becomes of one start after another.

    Attributes:
        simulation: Moves the model.
        task: The rules.
        steps: Physics steps so far, where Runge-Kutta's count four times.
    """

    def __init__(self, simulation: Simulation, task: Task = CARTPOLE_V1) -> None:
        self.simulation, self.task = simulation, task
        self.steps = 0
        self._controls = simulation.cartpole.controls
        rk4 = simulation.model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4
        self._cost = simulation.cartpole.substeps * (4 if rk4 else 1)

    def lost(self, starts: list[State]) -> list[tuple[str, int]]:
        """Return how, and within how many steps, each start is lost that no policy survives.

        It stops where too few can be lost.
        """
        found: list[tuple[str, int]] = []
        for tried, start in enumerate(starts):
            if len(starts) - tried + len(found) < LEAST_LOST or self.steps > MOST_STEPS:
                break
            found += filter(None, [self.thrown(start) or self.overcome(start)])
        return found

    def thrown(self, start: State) -> tuple[str, int] | None:
        """Say whether all sequences of actions end, and after how many steps the last one."""
        longest, trials, open_states = 0, 0, [(start, 0)]
        while open_states:
            state, done = open_states.pop()
            if done == HORIZON or trials >= MOST_TRIALS or self.steps > MOST_STEPS:
                return None
            after = [self._step(state, control) for control in self._controls]
            trials, longest = trials + len(after), max(longest, done + 1)
            in_play = [each for each in after if not self._has_ended(each)]
            # The best one last, which is next.
            open_states += [(each, done + 1) for each in sorted(in_play, key=_danger, reverse=True)]
        return "thrown", longest

    def overcome(self, start: State) -> tuple[str, int] | None:
        """Say whether both steady pushes end on the same side, and after how many steps.

        The comparison holds for one pole, and where nothing depends on the cart's place.
        """
        if self.simulation.cartpole.poles > 1:
            return None
        # Below the horizontal a push turns the pole the other way.
        if self.task.theta_limit < math.pi / 2:
            fallen = self._same_side(start, 2, self.task.theta_limit)
            if fallen:
                return "fallen", fallen
        if not (math.isfinite(self.task.x_limit) and self._one_way(start)):
            return None
        # A pole that swings right round moves the cart; twice the limit is out of its reach.
        carried = self._same_side(start, 0, 2 * self.task.x_limit)
        return ("carried", carried) if carried else None

    def held(self, control: float) -> int:
        """Return control steps until one action, held, ends an episode; `COARSE` + 1 if more."""
        self.simulation.set_state((0.0,) * self.simulation.size)
        return next(
            (n for n in range(1, COARSE + 1) if self._has_ended(self.simulation.step(control))),
            COARSE + 1,
        )

    def _one_way(self, start: State) -> bool:
        """Return whether the cart sets off to the same side by either action."""
        both = np.array(self._controls)
        left, right = self.simulation.accelerations(np.array([start, start]), both)[:, 0]
        return bool(left * right > 0)

    def _same_side(self, start: State, place: int, limit: float) -> int:
        """Return the steps until either steady push has driven a value out on one side; else 0."""
        left, right = self._controls
        side, steps = self._pushed(start, left, place, limit)
        other, more = self._pushed(start, right, place, limit) if side else (0, 0)
        return max(steps, more) if side and side == other else 0

    def _pushed(self, start: State, control: float, place: int, limit: float) -> tuple[int, int]:
        """Find to which side a steady push drives a value of the state out, and in how many steps.

        The side is -1 or 1, or 0 where it stays or the cart's place plays a part.
        """
        self.simulation.set_state(start)
        for done in range(1, self.task.time_limit + 1):
            state = self.simulation.step(control)
            self.steps += self._cost
            if abs(state[place]) > limit:
                side = 1 if state[place] > 0 else -1
                return (0 if self._place_matters(state, control) else side), done
            if self.steps > MOST_STEPS:
                break
        return 0, self.task.time_limit

    def _place_matters(self, state: State, control: float) -> bool:
        there, here = self.simulation.accelerations(
            np.array([state, (0.0, *state[1:])]), np.array([control, control])
        )
        return bool(np.abs(there - here).max() > _SHIFT * np.abs(here).max())

    def _step(self, state: State, control: float) -> State:
        self.steps += self._cost
        self.simulation.set_state(state)
        return self.simulation.step(control)

    def _has_ended(self, state: State) -> bool:
        return self.task.has_ended(state[0], max_abs(state[2::2]))


def _danger(state: State) -> float:
    """Return how far the pole that leans most will lean in a moment."""
    return max_abs([a + 0.25 * b for a, b in zip(state[2::2], state[3::2], strict=True)])
