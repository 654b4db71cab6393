"""A model is fitted to the world, and the table learned in it."""

import dataclasses
import itertools
import math

import gymnasium
import numpy as np
import pytest

from command_line import call
from engines import DIVERGING, ENGINES, outcome, write
from mjcartpole.errors import ConfigError, SimulationError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.documents import read_summary
from mjcartpole.learning.evaluation import evaluate, evaluate_where_trained
from mjcartpole.learning.methods import identify, q_learning
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.training import Training, train
from mjcartpole.physics.cartpole_v1 import cartpole_v1_step
from mjcartpole.task import CARTPOLE_V1, TASKS, register
from nightly import few

IDENTIFY = {"method": "identify", "backend": "gym", "episodes": 6}
FITS = ["rod", "linear"]


def model_of(engine="python", **values):
    """What was fitted, and to how much."""
    training = Training(TrainConfig(**{**IDENTIFY, "episodes": 1} | values), engine=engine)
    assert list(training.run()) == [1]
    return training.learner.memory.model, training.result().seen


def test_three_steps_of_either_backend_tell_the_reference():
    for backend in ("gym", "mujoco"):
        model, seen = model_of(backend=backend)
        expected = [10 / 1.1, 0.05 / 1.1, 14.7, 1.5, 0, 0.02]
        assert model.tolist() == pytest.approx(expected, rel=1e-3, abs=1e-6)
        assert seen == (1, 3)


@pytest.mark.parametrize(
    ("edits", "push", "coupling", "weight", "leverage"),
    [
        # Of a rod of length L and mass m on a cart of M: F / (M + m), m L/2 / (M + m), 3/2 g / L.
        (("pole.length=1.5",), 10 / 1.1, 0.075 / 1.1, 9.8, 1.0),
        (("pole.mass=0.5",), 10 / 1.5, 0.25 / 1.5, 14.7, 1.5),
        (("gravity=1.62",), 10 / 1.1, 0.05 / 1.1, 2.43, 1.5),
    ],
)
@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
def test_the_fit_finds_another_world(edits, push, coupling, weight, leverage, integrator):
    model, _ = model_of(backend="mujoco", set=edits, integrator=integrator)
    newness = float(integrator == "mujoco")
    expected = [push, coupling, weight, leverage, newness, 0.02]
    assert model.tolist() == pytest.approx(expected, rel=1e-3, abs=1e-4)


def test_another_control_step():
    edits = ("option.timestep=0.005",)
    model, _ = model_of(backend="mujoco", set=edits, own_timestep=True)
    expected = [10 / 1.1, 0.05 / 1.1, 14.7, 1.5, 0, 0.005]
    assert model.tolist() == pytest.approx(expected, rel=1e-2, abs=1e-5)


@pytest.mark.parametrize(
    ("values", "seen"),
    [({"fit": "linear"}, (1, None)), ({"fit_steps": 200}, (None, 200)),
     ({"fit": "linear", "fit_steps": 5}, (1, 5))],
)  # fmt: skip
def test_what_is_seen_is_counted(values, seen):
    episodes, steps = model_of(**values)[1]
    assert seen[0] in (None, episodes) and seen[1] in (None, steps)
    assert episodes >= 1 and (episodes > 5) == (steps == 200)


class Own:
    """The same method once more, without our loops, grids and envs: numpy and CartPole-v1."""

    def __init__(self, config):
        self.c = config
        self.starts, _ = gymnasium.utils.seeding.np_random(config.seed)
        seeds = np.random.SeedSequence(config.seed, spawn_key=(1,))
        self.rng = np.random.default_rng(seeds)
        self.q = np.full((144, 2), 10.0)

    def seen(self, state):
        return np.array(state, np.float32).astype(float)

    def look(self):
        state, rows = self.starts.uniform(-0.05, 0.05, 4).tolist(), []
        # The table takes its numbers first.
        self.rng.uniform(size=288)
        for _ in range(3):
            action = int(self.rng.random() < 0.5) ^ 1
            after = cartpole_v1_step(*state, 10.0 if action else -10.0)
            rows.append((self.seen(state), 2 * action - 1, self.seen(after)))
            state = after
        return rows

    def fit(self, rows):
        a, b, y, z = [], [], [], []
        for (_, v, th, w), u, (_, v2, _, w2) in rows:
            acc, turn = (v2 - v) / 0.02, (w2 - w) / 0.02
            a.append([u, math.sin(th) * w * w - math.cos(th) * turn])
            b.append([math.sin(th), -math.cos(th) * acc])
            y.append(acc), z.append(turn)
        a, b = np.array(a), np.array(b)
        self.k = (*np.linalg.solve(a.T @ a, a.T @ y), *np.linalg.solve(b.T @ b, b.T @ z))

    def move(self, s, u):
        push, c, g, d = self.k
        x, v, th, w = s
        # Both equations as one system for both accelerations.
        m = np.array([[1.0, c * math.cos(th)], [d * math.cos(th), 1.0]])
        acc = np.linalg.solve(m, [push * u + c * math.sin(th) * w * w, g * math.sin(th)])
        return [x + 0.02 * v, v + 0.02 * acc[0], th + 0.02 * w, w + 0.02 * acc[1]]

    def row(self, s):
        s = self.seen(s)[1:]
        edges = [np.linspace(-r, r, n + 1)[1:-1] for r, n in ((0.75, 3), (0.2095, 6), (1.5, 8))]
        v, th, w = (int(np.searchsorted(e, x, "right")) for e, x in zip(edges, s, strict=True))
        place = (v * 6 + th) * 8 + w
        return (143 - place, True) if place >= 72 else (place, False)

    def episode(self, number):
        share = min(1.0, number / (0.8 * self.c.episodes))
        epsilon, alpha = 1 - share, 0.1 + share * (0.01 - 0.1)
        s, path = self.starts.uniform(-0.05, 0.05, 4).tolist(), []
        while abs(s[0]) <= 2.4 and abs(s[2]) <= math.radians(12) and len(path) < 500:
            row, mirrored = self.row(s)
            if self.rng.random() < epsilon:
                action = int(self.rng.random() * 2)
            else:
                action = int(self.q[row, 1] > self.q[row, 0])
            path.append((row, action))
            s = self.move(s, 1 if action != mirrored else -1)
        future = self.q[self.row(s)[0]].max() if len(path) == 500 else 0.0
        for row, action in reversed(path):
            target = 1 + 0.99 * future
            self.q[row, action] += alpha * (target - self.q[row, action])
            future = 0.1 * self.q[row].max() + 0.9 * target
        return len(path)


def test_it_is_the_same_as_an_implementation_of_its_own():
    config = TrainConfig(**IDENTIFY | {"episodes": 40, "seed": 5})
    own = Own(config)
    own.fit(own.look())
    # Sooner or later the last digits decide between two bins.
    lengths = [own.episode(number) for number in range(25)]
    training = Training(config, engine="python")
    assert [finished for _, finished in zip(lengths, training.run(), strict=False)][-1] == 25
    result = training.result()
    assert result.episodes.columns.steps.tolist() == lengths
    table = result.q_table.reshape(144, 2)
    np.testing.assert_allclose(table[:72], own.q[:72], rtol=1e-9)
    np.testing.assert_array_equal(table[72:], table[:72][::-1, ::-1])


@pytest.mark.parametrize(
    ("fit", "backend"), few(itertools.product(FITS, ("gym", "mujoco")), ("rod", "gym"))
)
def test_what_is_learned_in_a_dream_balances_in_the_world(fit, backend):
    values = {"episodes": 400, "fit": fit, "backend": backend, "seed": 1}
    config = TrainConfig(**IDENTIFY | values)
    result = train(config)
    played = evaluate_where_trained(result.policy, config, None, "compiled")
    assert (result.returns[-50:].min(), played.minimum) == (500.0, 500.0)


@pytest.mark.slow
@pytest.mark.parametrize("fit", FITS)
@pytest.mark.parametrize("backend", ["gym", "mujoco"])
@pytest.mark.parametrize(
    "more",
    [
        {},
        {"noise": 0.02, "fit_steps": 60},
        {"tilings": 4, "ties": "random", "mirror": False},
        {"td_lambda": None, "task": "Short-v0"},
    ],
)
def test_both_engines_dream_the_same_bits(fit, backend, more):
    register(dataclasses.replace(CARTPOLE_V1, name="Short-v0", time_limit=30, start_angle=0.02))
    config = TrainConfig(**IDENTIFY | {"episodes": 60, "fit": fit, "backend": backend} | more)
    expected, found = (outcome(config, engine) for engine in ENGINES)
    del TASKS["Short-v0"]
    assert found == expected


@pytest.mark.slow
def test_both_engines_dream_of_a_swing_alike():
    config = TrainConfig.preset("swing-up", method="identify", episodes=20, backend="gym")
    expected, found = (outcome(config, engine) for engine in ENGINES)
    assert found == expected


@pytest.mark.parametrize("engine", ENGINES)
def test_evaluations_are_of_the_world(engine):
    config = TrainConfig(**IDENTIFY | {"episodes": 8, "evaluate_every": 4, "fit_steps": 30})
    result = train(config, engine=engine)
    half = train(dataclasses.replace(config, evaluate_every=None), engine=engine)
    assert half.q_table.tobytes() == result.q_table.tobytes()
    assert [point.episodes for point in result.evaluations] == [4, 8]
    world = evaluate(result.policy, backend="gym", seed=2_000_000)
    assert (result.evaluations[-1].mean, result.seen[1]) == (world.mean, 30)


def test_a_fit_is_made_once():
    first = Training(TrainConfig(**IDENTIFY | {"noise": 0.001}), engine="python")
    next(first.run())
    again = Training(first.config, engine="python")
    again.restore(first.snapshot())
    again.learner.memory.model[0] = 7.0
    assert [*again.run()] == [2, 3, 4, 5, 6]
    assert (again.learner.memory.model[0], again.result().seen) == (7.0, (1, 3))


def test_an_environment_of_ones_own_is_a_world_too():
    config = TrainConfig(**IDENTIFY | {"mirror": True})
    with gymnasium.make("CartPole-v1") as env:
        own = Training(config, env)
        assert [*own.run()] == [1, 2, 3, 4, 5, 6]
    assert own.result().q_table.tobytes() == train(config).q_table.tobytes()


def test_a_saved_policy_is_one_as_any_other(tmp_path):
    policy = train(TrainConfig(**IDENTIFY)).policy
    policy.save(tmp_path / "policy.json")
    assert Policy.load(tmp_path / "policy.json").q_table.tobytes() == policy.q_table.tobytes()


SHORT = ["train", "--method", "identify", "--episodes", "20", "--backend", "gym", "--no-video"]


@pytest.mark.long
def test_what_is_printed_says_what_is_dreamt(here, capsys):
    more = ["--log-every", "10", "--evaluate-every", "10", "--run-dir", "run", "--until", "9"]
    code, out, err = call([*SHORT, *more], capsys)
    assert (code, err) == (0, "")
    assert out.startswith("tuned on gym: 20 dreamt episodes, seed 0, with --method identify")
    assert "\nfitted to 3 steps in 1 episode of the world; the returns below are dreamt" in out
    assert "\nstopped after dreamt episode 10: " in out
    assert (here / "run" / "episodes.csv").read_text().startswith("dreamt_episode,return,steps,")
    assert read_summary(here / "run")["seen"] == {"episodes": 1, "steps": 3}
    assert "is complete" in call(["train", "--resume", "run"], capsys)[1]
    out = call([*SHORT, "--seeds", "2", "--until", "9"], capsys)[1]
    assert "2 seeds from 0, 20 dreamt episodes each" in out
    assert "\ndreamt episodes until the mean greedy return was at least 9: median 1, " in out


def test_the_flags_have_help(capsys):
    out = call(["train", "--method", "identify", "--help"], capsys)[1]
    assert all(
        flag in out for flag in ("--fit {rod,linear}", "--fit-steps", "--noise", "--td-lambda")
    )


def test_two_poles_are_refused_before_a_folder_is_made(here, capsys):
    for seeds in (["--seeds", "2"], []):
        code, out, err = call([*SHORT[:5], "--model", "twopoles", *seeds], capsys)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert "method 'identify' fits a cart with 1 pole, and the model has 2 poles" in err
    assert list(here.iterdir()) == []


def test_a_linear_model_is_for_small_angles():
    config = TrainConfig(**IDENTIFY | {"fit": "linear", "task": "SwingUp-v0"})
    with pytest.raises(
        ConfigError, match="SwingUp-v0 lets the pole lean by any angle; take fit 'rod'"
    ):
        train(config)


def test_a_rod_that_hangs_tells_as_much():
    hanging, _ = model_of(task="SwingUp-v0", fit_steps=40)
    assert hanging.tolist() == pytest.approx(model_of()[0].tolist(), rel=1e-3, abs=1e-5)


@pytest.mark.parametrize("fit", FITS)
def test_whatever_is_seen_there_is_a_dream(fit):
    for seed, steps in enumerate((1, 2, 3, 4, 9)):
        values = {"fit": fit, "noise": 100.0, "fit_steps": steps, "seed": seed}
        found = train(TrainConfig(**IDENTIFY | values), engine="python")
        assert np.isfinite(found.q_table).all()


def test_a_world_that_diverges(tmp_path):
    wild = write(tmp_path, DIVERGING["wild"])
    with pytest.raises(SimulationError, match="diverged"):
        model_of(backend="mujoco", model=wild)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("fit", "cubic", "fit must be 'rod' or 'linear', not 'cubic'"),
        ("fit_steps", 0, "fit_steps must be a whole number from 1 to 1,000,000, not 0"),
        ("fit_steps", 2.0, "fit_steps must be"),
        ("noise", -0.1, "noise must be 0 or more, not -0.1"),
        ("noise", math.nan, "noise must be a number"),
        ("noise", 1e9, "noise must be a number"),
        ("td_lambda", 2.0, "td_lambda must be a number from 0 to 1"),
    ],
)
def test_values_that_make_no_sense(name, value, message):
    with pytest.raises(ConfigError, match=message):
        TrainConfig(**IDENTIFY | {name: value})


def test_it_learns_as_q_learning_does():
    names = ("begin_episode", "act", "after_step", "after_episode")
    assert all(getattr(identify, name) is getattr(q_learning, name) for name in names)
