"""No policy can balance some models: it is said of those, and of no other."""

import math
import re

import numpy as np
import pytest

from mjcartpole.physics import playable
from mjcartpole.physics.load import load_model, model_names, models_folder
from mjcartpole.physics.playable import why_unplayable
from mjcartpole.physics.simulation import Simulation
from mjcartpole.task import CARTPOLE_V1, Task, max_abs

REFERENCE = (models_folder() / "cartpole.xml").read_text(encoding="utf-8")
SERVO = re.sub(
    "<motor .*/>", '<position joint="slider" kp="5000" ctrlrange="-1 1"/>', REFERENCE, count=1
)
THROWN = "one step changes too much: look at the force, the time step"
FALLEN = "the pole falls to one side"
CARRIED = "the cart leaves to one side"

HOPELESS = {
    "a huge force": ("cartpole", {"force": 1000}, THROWN),
    "a force that is just too large": ("cartpole", {"force": 400}, THROWN),
    "a huge force, many substeps": ("cartpole", {"force": 1000, "timestep": 2e-4}, THROWN),
    "a stiff servo": (SERVO, {}, THROWN),
    "a long step": ("cartpole", {"option.timestep": 0.15}, THROWN),
    "a tiny pole": ("cartpole", {"pole.length": 0.02}, THROWN),
    "two poles, a huge force": ("twopoles", {"force": 2000}, THROWN),
    "a weak force": ("cartpole", {"force": 0.1}, FALLEN),
    "a heavy cart": ("cartpole", {"cart.mass": 1000}, FALLEN),
    "a rail that sticks": ("cartpole", {"rail.friction": 50}, FALLEN),
    "a stronger wind": ("cartpole", {"option.gravity": "3 0 -9.8", "force": 1}, CARRIED),
}
COARSE = {
    "a strong force": ("cartpole", {"force": 300}),
    "steps of 0.1 s": ("cartpole", {"option.timestep": 0.1}),
}
PLAYABLE = {
    "a strong force": ("cartpole", {"force": 40}),
    "a small force": ("cartpole", {"force": 1}),
    "100 substeps": ("cartpole", {"timestep": 2e-4}),
    "a wind that the motor masters": ("cartpole", {"option.gravity": "2 0 -9.8", "force": 3}),
    "damping": ("cartpole", {"hinge.damping": 0.5}),
    "no gravity": ("cartpole", {"gravity": 0}),
    "a pole held by a spring": ("cartpole", {"joint:hinge.stiffness": 5}),
    "a weak motor helped by a spring": ("cartpole", {"joint:slider.stiffness": 50, "force": 0.1}),
    "a long pole": ("cartpole", {"pole.length": 20}),
    "a heavy pole": ("cartpole", {"pole.mass": 5}),
}

both = pytest.mark.parametrize("integrator", ["gym", "mujoco"])


@both
@pytest.mark.parametrize("case", HOPELESS)
def test_what_cannot_be_balanced(case, integrator):
    model, edits, advice = HOPELESS[case]
    line = why_unplayable(load_model(model, edits, own_timestep="long" in case), integrator)
    assert line is not None
    assert re.match("no policy can balance this( from most starts)?: from ", line)
    assert ("from most starts" in line) == ("from 8 of 8 " not in line)
    assert advice in line
    assert "\n" not in line


@both
@pytest.mark.parametrize("case", PLAYABLE)
def test_what_a_policy_may_balance(case, integrator):
    model, edits = PLAYABLE[case]
    cartpole = load_model(model, edits, own_timestep="0.1 s" in case)
    assert why_unplayable(cartpole, integrator) is None


@both
@pytest.mark.parametrize("case", COARSE)
def test_what_is_hard_to_balance(case, integrator):
    """Three steps of the same action end an episode from upright."""
    model, edits = COARSE[case]
    cartpole = load_model(model, edits, own_timestep="0.1 s" in case)
    line = why_unplayable(cartpole, integrator)
    assert line.startswith("hard to balance: from upright at rest either action")
    lengths = [
        lasted(Simulation(cartpole, integrator), np.zeros(4), [action] * 9) for action in (0, 1)
    ]
    assert f"within {max(lengths)} steps" in line


@pytest.mark.parametrize(
    ("edits", "task", "advice"),
    [
        ({"force": 0.1}, Task("swing-up", theta_limit=math.inf), None),
        ({"force": 0.1}, Task("below level", theta_limit=2), None),
        ({"force": 1000}, Task("swing-up", theta_limit=math.inf), None),
        ({"force": 1000}, Task("no ends", x_limit=math.inf), THROWN),
        ({"force": 1000}, Task("no limit", x_limit=math.inf, theta_limit=math.inf), None),
        ({"force": 10}, Task("tiny", x_limit=1, theta_limit=0.01, start_high=-0.04), THROWN),
        ({"option.gravity": "3 0 -9.8", "force": 1}, Task("no ends", x_limit=math.inf), None),
        (
            {"option.gravity": "3 0 -9.8", "force": 1},
            Task("swing-up", theta_limit=math.inf),
            CARRIED,
        ),
        ({"force": 1}, Task("leaning", start_angle=0.17, start_low=0.0), THROWN),
    ],
)
def test_it_depends_on_the_task(edits, task, advice):
    line = why_unplayable(load_model("cartpole", edits), task=task)
    assert (line is None) == (advice is None)
    assert advice is None or advice in line


@both
@pytest.mark.parametrize("name", model_names())
def test_the_gallery(name, integrator):
    cartpole = load_model(name, own_timestep=name == "wieland")
    assert why_unplayable(cartpole, integrator) is None


def test_wielands_short_pole_is_hard_and_no_more_at_two_hundredths_of_a_second():
    """A table balances it in 20,000 episodes (docs/variants.md)."""
    assert why_unplayable(load_model("wieland")).startswith("hard to balance: ")


@pytest.mark.parametrize("case", COARSE)
def test_what_is_hard_can_be_balanced_by_looking_one_step_ahead(case):
    model, edits = COARSE[case]
    simulation = Simulation(load_model(model, edits, own_timestep="0.1 s" in case))
    for start in np.random.default_rng(0).uniform(-0.05, 0.05, (8, 4)).tolist():
        state = start
        for _ in range(100):
            state = min((moved(simulation, state, action) for action in (0, 1)), key=danger)
            assert not CARTPOLE_V1.has_ended(state[0], state[2])


def moved(simulation, state, action):
    simulation.state = state
    return simulation.step(simulation.cartpole.controls[action])


def danger(state) -> float:
    """How far the pole will lean after a quarter of a second at this rate."""
    return abs(state[2] + 0.25 * state[3])


@pytest.mark.parametrize("case", HOPELESS)
def test_what_is_said_is_true_of_many_sequences(case):
    model, edits, _ = HOPELESS[case]
    cartpole = load_model(model, edits, own_timestep="long" in case)
    line = why_unplayable(cartpole)
    lost, starts = map(int, re.findall(r"from (\d+) of (\d+) starts", line)[0])
    within = re.search(r"within (\d+) steps", line)
    steps = int(within[1]) if within else 1
    rng, simulation = np.random.default_rng(5), Simulation(cartpole)
    longest = []
    for start in np.random.default_rng(0).uniform(-0.05, 0.05, (starts, simulation.size)):
        # Runs of one action, short ones and one that is never given up, and their opposites.
        tried = [np.repeat(rng.integers(0, 2, steps), run)[:steps] for run in (1, 2, 5, 20, steps)]
        tried += [1 - actions for actions in tried]
        longest.append(max(lasted(simulation, start, actions) for actions in tried))
    assert sum(each <= steps for each in longest) >= lost


def lasted(simulation, start, actions) -> int:
    """Control steps until an episode with these actions ends; one more if it does not."""
    simulation.state = start[: simulation.size]
    for done, action in enumerate(actions, start=1):
        state = simulation.step(simulation.cartpole.controls[action])
        if CARTPOLE_V1.has_ended(state[0], max_abs(state[2::2])):
            return done
    return len(actions) + 1


@pytest.mark.parametrize("edits", [{"timestep": 2e-5, "force": 0.1}, {"timestep": 2e-5}, {}])
def test_the_work_is_bounded_however_many_substeps_a_model_asks_for(edits):
    cartpole = load_model("cartpole", {**edits, "option.integrator": "RK4"})
    search = playable._Search(Simulation(cartpole, "mujoco"))
    search.lost(np.random.default_rng(0).uniform(-0.05, 0.05, (8, 4)).tolist())
    # It looks at the sum between control steps, of one action or both.
    assert 0 < search.steps <= playable.MOST_STEPS + 2 * 4 * cartpole.substeps
