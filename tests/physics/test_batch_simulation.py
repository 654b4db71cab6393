"""How many threads move many cart-poles; tests/envs/test_vector.py has their motion."""

import time

import numpy as np
import pytest
from mujoco.batch import Batch

from mjcartpole.physics import batch_simulation
from mjcartpole.physics.batch_simulation import BatchSimulation
from mjcartpole.physics.load import load_model

MODEL = load_model("cartpole", {"joint:hinge.damping": 0.01})
MANY = 64


class SlowBatch(Batch):
    """A batch whose threads have to be waited for."""

    def step(self, *arguments, **settings):
        """Take longer than any preempted step of a few small models."""
        time.sleep(0.03)
        super().step(*arguments, **settings)


def with_two_ways(slow, monkeypatch, integrator="gym"):
    """A simulation of many that has a choice on any machine, of which one way is slow."""
    monkeypatch.setattr(batch_simulation, "available_cores", lambda: 2)
    simulation = BatchSimulation(MODEL, MANY, integrator)
    runner, alone = simulation._batch, simulation._other
    assert (runner.nthread, alone.nthread) == (2, 1)
    taken = alone if slow == "alone" else runner
    replaced = SlowBatch(taken.model, MANY, taken.nthread)
    if slow == "alone":
        simulation._other = replaced
    else:
        simulation._use(replaced)
    return simulation


@pytest.mark.parametrize(("slow", "quick"), [("alone", 2), ("crew", 1)])
def test_the_quicker_way_is_found_and_kept(slow, quick, monkeypatch):
    simulation = with_two_ways(slow, monkeypatch)
    controls = np.ones(MANY)
    for _ in range(20):
        simulation.step(controls)
    assert [simulation.threads for _ in range(100) if simulation.step(controls) is None] == (
        [quick] * 100
    )


@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
def test_changing_threads_changes_no_bit(integrator, monkeypatch):
    simulation = with_two_ways("crew", monkeypatch, integrator)
    plain = BatchSimulation(MODEL, MANY, integrator, threads=1)
    starts = np.random.default_rng(0).uniform(-0.05, 0.05, (MANY, 4))
    for each in (simulation, plain):
        each.set_state(slice(None), starts)
    seen = set()
    for controls in np.random.default_rng(1).choice([-1.0, 1.0], (40, MANY)):
        for each in (simulation, plain):
            each.step(controls)
        seen.add(simulation.threads)
        assert simulation.state.tobytes() == plain.state.tobytes()
    assert seen == {1, 2}


@pytest.mark.parametrize(
    ("n", "timestep", "cores", "threads"),
    [
        (1, 0.02, 64, 1),
        (2, 0.02, 64, 1),
        (4, 0.02, 2, 1),
        (8, 0.02, 2, 2),
        (2, 0.002, 2, 2),
        (64, 0.02, 64, 16),
        (64, 0.02, 16, 16),
        (1024, 0.02, 64, 64),
        (1024, 0.02, 1, 1),
    ],
)
def test_few_simulations_never_wake_many_threads(n, timestep, cores, threads, monkeypatch):
    monkeypatch.setattr(batch_simulation, "available_cores", lambda: cores)
    cartpole = load_model("cartpole", {"option.timestep": timestep})
    simulation = BatchSimulation(cartpole, n)
    assert simulation.threads == threads
    assert (simulation._other is None) == (threads == 1)
    assert BatchSimulation(cartpole, n, threads=3).threads == min(3, n)
