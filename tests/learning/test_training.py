"""Trainings repeat exactly, and learn."""

import copy
import doctest
import itertools
import time

import gymnasium
import numpy as np
import pytest

from mjcartpole.errors import ConfigError, ModelNotFoundError
from mjcartpole.learning import compiled, training
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.presets import PRESETS
from mjcartpole.learning.training import Training, train
from mjcartpole.physics.load import load_model
from nightly import few

ENGINES = ("python", "compiled")
LEARNED = [name for name in PRESETS if name != "planned"]


@pytest.fixture
def short_chunks(monkeypatch):
    monkeypatch.setattr(compiled, "CHUNK_STEPS", 100)


def test_the_docstrings_hold():
    assert doctest.testmod(training).failed == 0


@pytest.mark.parametrize(
    ("preset", "backend"),
    few(
        [(name, "mujoco") for name in LEARNED]
        + [(name, "gym") for name in LEARNED if not {"model", "set"} & {*PRESETS[name]}],
        *(("tuned", "mujoco"), ("two-poles", "mujoco"), ("article", "gym"), ("quick", "gym")),
    ),
)
def test_one_seed_gives_one_table_and_two_seeds_give_two(preset, backend):
    def run(seed):
        return train(TrainConfig.preset(preset, backend=backend, episodes=40, seed=seed))

    first, again, other = run(7), run(7), run(8)
    assert first.q_table.tobytes() == again.q_table.tobytes()
    np.testing.assert_array_equal(first.returns, again.returns)
    assert first.steps == again.steps
    if first.config.task == "CartPole-v1":  # One for each step.
        assert first.steps == first.returns.sum()
    assert first.q_table.tobytes() != other.q_table.tobytes()
    assert len(first.returns) == 40


def test_the_backends_start_alike():
    """The same generators and, to rounding, the same physics: the first episodes are equal."""
    ours, gyms = (
        train(TrainConfig(backend=backend, episodes=20, seed=1)) for backend in ("mujoco", "gym")
    )
    np.testing.assert_array_equal(ours.returns, gyms.returns)
    assert ours.q_table.tobytes() == gyms.q_table.tobytes()


def test_what_a_dimension_without_bins_ignores():
    config = TrainConfig(bins=(1, 1, 1, 1), episodes=5)
    assert train(config).q_table.shape == (1, 1, 1, 1, 2)


def test_a_training_can_be_left_at_any_episode():
    unfinished = Training(TrainConfig(episodes=100, seed=2), engine="python")
    for finished in unfinished.run():
        if finished == 10:
            break
    result = unfinished.result()
    assert len(result.returns) == len(result.episodes) == 10
    assert result.policy([0.0, 0.0, 0.1, 0.0]) in (0, 1)
    assert Training(TrainConfig()).result().steps == 0


@pytest.mark.parametrize("engine", ENGINES)
def test_a_training_counts_its_episodes(engine, short_chunks):
    training = Training(TrainConfig(episodes=90, seed=2), engine=engine)
    counts = []
    for finished in training.run():
        assert finished == len(training.log)
        counts.append(finished)
    assert counts == sorted(set(counts))
    assert counts[-1] == 90
    assert counts == list(range(1, 91)) or engine == "compiled"
    assert len(counts) > 5
    assert list(training.run()) == [], "there is nothing left to do"
    assert len(training.log) == 90


@pytest.mark.parametrize("engine", ENGINES)
def test_a_result_is_not_changed_by_later_episodes(engine, short_chunks):
    unfinished = Training(TrainConfig(episodes=30), engine=engine)
    episodes = unfinished.run()
    next(episodes)
    result = unfinished.result()
    before, logged = result.q_table.copy(), list(result.episodes)
    assert 0 < len(logged) < 30
    list(episodes)
    np.testing.assert_array_equal(result.q_table, before)
    assert list(result.episodes) == logged
    assert unfinished.result().steps > result.steps


def snapshots_of(config, engine):
    """A snapshot before each chunk and at the end, with what it held when it was taken."""
    training = Training(config, engine=engine)
    snapshots = [training.snapshot()]
    held = [content(snapshots[0])]
    for _ in training.run():
        snapshots.append(training.snapshot())
        held.append(content(snapshots[-1]))
    return snapshots, held


def content(snapshot):
    return (
        {name: array.tobytes() for name, array in snapshot.memory.items()},
        copy.deepcopy(snapshot.env_rng),
        copy.deepcopy(snapshot.learner_rng),
        [column.tobytes() for column in snapshot.columns],
        snapshot.seconds,
    )


@pytest.mark.long
@pytest.mark.parametrize(
    "changes",
    [
        {"backend": "mujoco"},
        {"backend": "gym", "td_lambda": None, "ties": "random"},
        *(
            pytest.param(changes, marks=pytest.mark.slow)
            for changes in (
                {"backend": "gym"},
                {"backend": "mujoco", "td_lambda": None, "ties": "random"},
                {"integrator": "mujoco"},
                {"backend": "gym", "method": "prioritized-replay"},
                {"backend": "gym", "method": "prioritized-sweeping"},
                {"backend": "gym", "method": "model", "plan_after": "failure"},
            )
        ),
    ],
)
def test_a_training_goes_on_from_any_snapshot_with_either_engine(changes, short_chunks):
    config = TrainConfig(episodes=60, seed=4, **changes)
    snapshots, held = snapshots_of(config, "compiled")
    assert len(snapshots) > 5
    *final, seconds = held[-1]
    assert seconds > 0
    places = [0, 1, len(snapshots) // 2, len(snapshots) - 1]
    for place, engine in itertools.product(places, ENGINES):
        training = Training(config, engine=engine)
        training.restore(snapshots[place])
        for _ in training.run():
            pass
        *found, seconds = content(training.snapshot())
        assert found == final
        assert seconds >= held[place][-1]
    assert [content(snapshot) for snapshot in snapshots] == held, "later episodes changed one"


@pytest.mark.parametrize(("first", "second"), [ENGINES, ENGINES[::-1]])
def test_engines_may_take_turns(first, second, short_chunks):
    config = TrainConfig(episodes=60, seed=9)
    snapshots, _ = snapshots_of(config, first)
    training = Training(config, engine=second)
    training.restore(snapshots[len(snapshots) // 3])
    chunks = training.run()
    next(chunks)
    last = Training(config, engine=first)
    last.restore(training.snapshot())
    for _ in last.run():
        pass
    assert content(last.snapshot())[:-1] == content(snapshots[-1])[:-1]


def test_a_training_can_be_set_back(short_chunks):
    """Restoring does not only work on a fresh training."""
    config = TrainConfig(episodes=40, seed=1)
    for engine in ENGINES:
        training = Training(config, engine=engine)
        start = training.snapshot()
        for _ in training.run():
            pass
        first = content(training.snapshot())[:-1]
        training.restore(start)
        assert len(training.log) == 0
        for _ in training.run():
            pass
        assert content(training.snapshot())[:-1] == first


def test_a_mirrored_training_learns_a_table_that_is_its_own_mirror_image():
    result = train(TrainConfig(episodes=60, mirror=True, q_init_low=0.0))
    table = result.q_table.reshape(-1, 2)
    assert (table == table[::-1, ::-1]).all()
    assert len(np.unique(table)) > 40
    assert not result.policy.discretizer.mirror


def test_a_mirrored_step_is_learned_for_its_image():
    # One bin per sign of the angle: to the left of upright, and its mirror image.
    grid = {"bins": (1, 1, 2, 1), "q_init_low": 0.0, "q_init_high": 0.0}
    config = TrainConfig(episodes=1, mirror=True, td_lambda=None, alpha=0.5, decay=0.0, **grid)
    training = Training(config)
    list(training.run())
    (episode,) = training.log
    assert episode.steps > 5
    fallen, upright = training.result().q_table.reshape(2, 2).tolist()
    assert fallen == upright[::-1]
    assert max(fallen) > 0


@pytest.mark.parametrize("engine", ["compiled", "python"])
def test_what_is_not_symmetric_has_no_mirror(engine):
    with pytest.raises(ConfigError, match="wind does not: pushed to the right from upright rest"):
        Training(TrainConfig(model="wind", mirror=True), engine=engine)
    assert not Training(TrainConfig(model="wind"), engine=engine).discretizer.mirror
    assert not Training(TrainConfig(low=(-2, -1, -0.1, -1)), engine=engine).discretizer.mirror
    for backend in ("mujoco", "gym"):
        assert Training(TrainConfig(backend=backend), engine=engine).discretizer.mirror


def test_an_environment_of_ones_own_is_trained_on():
    config = TrainConfig(backend="gym", episodes=15, seed=3, mirror=False)
    env = gymnasium.make("CartPole-v1")
    own = Training(config, env)
    assert own.engine == "python"
    for _ in own.run():
        pass
    assert own.result().q_table.tobytes() == train(config).q_table.tobytes()


def test_a_loaded_model_is_taken_as_it_is():
    heavy = load_model(load_model().xml.replace('mass="0.1"', 'mass="0.9"'))
    config = TrainConfig(episodes=15, seed=3)
    tables = []
    for engine in ENGINES:
        training = Training(config, engine=engine, cartpole=heavy)
        for _ in training.run():
            pass
        tables.append(training.result().q_table.tobytes())
    assert tables[0] == tables[1] != train(config).q_table.tobytes()


def test_an_unknown_model_is_refused_before_any_work():
    with pytest.raises(ModelNotFoundError, match="'nothing'"):
        train(TrainConfig(model="nothing"))


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["mujoco", "gym"])
def test_tuned_balances_the_pole_on_every_seed(backend):
    for seed in range(500, 505):
        result = train(TrainConfig.preset("tuned", backend=backend, seed=seed))
        evaluation = evaluate(result.policy, backend=backend)
        assert evaluation.returns.mean() >= 490, f"seed {seed}"


@pytest.mark.slow
def test_the_article_with_its_terminal_step_learns_more_than_without():
    means = {
        preset: np.mean(
            [
                train(TrainConfig.preset(preset, seed=seed, episodes=4_000)).returns[-500:].mean()
                for seed in range(3)
            ]
        )
        for preset in ("article", "article-terminal")
    }
    assert means["article-terminal"] > means["article"] > 50


def test_what_a_notebook_shows_is_short():
    config = TrainConfig(backend="gym", episodes=300, bins=(1, 3, 6, 9))
    result = train(config)
    assert repr(config) == "TrainConfig(backend='gym', episodes=300, bins=(1, 3, 6, 9))"
    assert eval(repr(config)) == config
    assert repr(result.policy) == "Policy(bins=(1, 3, 6, 9), 162 states)"
    mean = result.returns.mean()
    assert repr(result.episodes) == f"EpisodeLog(300 episodes, mean return {mean:.2f})"
    assert repr(result) == f"TrainResult({config!r}, {result.episodes!r}, {result.policy!r})"
    untrained = Training(config)
    for shown in (untrained.snapshot(), untrained.result(), result.episodes.columns):
        assert len(repr(shown)) < 200


def test_the_clock_starts_when_the_loop_is_compiled(monkeypatch):
    training_ = Training(TrainConfig(backend="gym", episodes=2))
    compile_it = training_._loop.compile

    def slowly(*arguments):
        compile_it(*arguments)
        time.sleep(0.5)

    monkeypatch.setattr(training_._loop, "compile", slowly)
    assert list(training_.run())[-1] == 2
    assert training_.result().seconds < 0.5
