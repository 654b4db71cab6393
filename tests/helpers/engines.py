"""Trainings to compare, and models in which they may differ."""

import os
import subprocess
import sys
import textwrap

import numpy as np

from mjcartpole.errors import SimulationError
from mjcartpole.learning.checkpoints import (
    LATEST,
    Checkpoint,
    checksum,
    load_checkpoint,
    save_checkpoint,
)
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.training import Training
from mjcartpole.physics.load import load_model

REFERENCE = load_model().xml


ENGINES = ("python", "compiled")


def edited(*changes):
    """The reference document with words replaced."""
    text = REFERENCE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


def to(new):
    """A change of the timestep or the integrator."""
    name = new.split("=")[0]
    return {"timestep": 'timestep="0.02"', "integrator": 'integrator="Euler"'}[name], new


TOUCHING = (
    ('contype="0" conaffinity="0"', 'contype="1" conaffinity="1"'),
    # Cart and rail do not overlap; the cart and its stops do from 0.1 m on.
    ('pos="0 0.11 -0.14" size="2.68 0.05 0.04"', 'pos="0 0.11 -0.34" size="2.68 0.05 0.04"'),
    ('"2.63 0.11 -0.03"', '"0.33 0.11 -0.03"'),
    ('"-2.63 0.11 -0.03"', '"-0.33 0.11 -0.03"'),
)


# A push into this limit, and nothing is sane any more.
BRITTLE = 'type="slide" range="-0.9 0.9" solreflimit="-{} -1" solimplimit="0.9999 0.9999 0.001"'


DIVERGING = {
    # The model of test_cli.py: at once.
    "wild": edited(('mass="1.0"', 'mass="1e-12"'), ('gear="10"', 'gear="1e12"')),
    "NaN in the second step": edited(('gravity="0 0 -9.8"', 'gravity="0 0 1e200"')),
    "too large, later": edited(('type="slide"', BRITTLE.format("1e18"))),
    "NaN, later": edited(('type="slide"', BRITTLE.format("1e300"))),
    "NaN, later, in half steps": edited(
        ('type="slide"', BRITTLE.format("1e300")), to('timestep="0.01"')
    ),
}


def outcome(config, engine, cartpole=None):
    """All that a training comes to, as bytes; where it diverges, up to there."""
    training = Training(config, engine=engine, cartpole=cartpole)
    assert training.engine == engine
    return outcome_of(training)


def outcome_of(training):
    """Train to the end; return all that it comes to."""
    error = None
    try:
        for finished in training.run():
            assert finished == len(training.log)
    except SimulationError as diverged:
        error = str(diverged)
    snapshot = training.snapshot()
    return {
        "memory": {name: array.tobytes() for name, array in snapshot.memory.items()},
        "returns": snapshot.columns.totals.tolist(),
        "steps": snapshot.columns.steps.tolist(),
        "endings": [episode.ending for episode in training.log],
        "generators": (snapshot.env_rng, snapshot.learner_rng),
        "policy": training.result().policy.choices.tolist(),
        "error": error,
    }


def resumed(config, engines, episode, folder):
    """Return a training that one engine left after an episode and another takes from the disk."""
    first, second = (Training(config, engine=engine) for engine in engines)
    if first.engine == "compiled":
        first._loop._chunk = 1  # It looks up after each episode.
    run = first.run()
    while len(first.log) < episode:
        next(run)
    save_checkpoint(folder, Checkpoint(config, checksum(REFERENCE), first.snapshot()))
    second.restore(load_checkpoint(folder / LATEST, config, REFERENCE).snapshot)
    return second


def write(tmp_path, text, name="model.xml"):
    (tmp_path / name).write_text(text)
    return str(tmp_path / name)


def random_policy(seed, bins=(2, 3, 8, 8)):
    table = np.random.default_rng(seed).integers(3, size=(*bins, 2)).astype(float)
    return Policy(Discretizer(bins, (-2.4, -1.0, -0.2, -1.5), (2.4, 1.0, 0.25, 2.0)), table)


def python(script, *arguments, **environment):
    """Run a script in a process of its own; returns its stdout and stderr."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", textwrap.dedent(script), *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout, done.stderr
