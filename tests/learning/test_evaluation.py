"""Greedy episodes, counted."""

import pytest

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.errors import ConfigError, ModelNotFoundError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.training import train


def steady(observation):
    """A hand-made controller that never fails on either backend."""
    x, x_dot, theta, theta_dot = observation
    return int(theta + 0.5 * theta_dot + 0.02 * x + 0.05 * x_dot > 0)


def falling(observation):
    return 1


@pytest.mark.parametrize("backend", ["mujoco", "gym"])
def test_known_policies(backend):
    good = evaluate(steady, backend=backend, episodes=5)
    assert good.returns.tolist() == [500.0] * 5
    assert good.endings == {"time limit": 5, "off the track": 0, "pole fell": 0}
    bad = evaluate(falling, backend=backend, episodes=5)
    assert bad.endings["pole fell"] == 5
    assert 7 <= bad.returns.mean() <= 12


def test_the_same_seed_gives_the_same_episodes():
    first, again, other = (evaluate(falling, episodes=20, seed=seed) for seed in (1, 1, 2))
    assert first.returns.tolist() == again.returns.tolist() != other.returns.tolist()


def test_both_backends_start_from_the_same_states():
    ours, gyms = (evaluate(falling, backend=name, episodes=20) for name in ("mujoco", "gym"))
    assert ours.returns.tolist() == gyms.returns.tolist()


def test_the_summary_is_plain():
    assert evaluate(falling, episodes=2, seed=3).summary() == {
        "backend": "mujoco",
        "seed": 3,
        "episodes": 2,
        "mean": pytest.approx(9, abs=2),
        "minimum": pytest.approx(9, abs=2),
        "endings": {"time limit": 0, "off the track": 0, "pole fell": 2},
    }


def test_the_summary_says_what_was_added():
    played = evaluate(falling, episodes=2, disturbances=Disturbances(delay=1, noise=0.5))
    assert played.summary()["disturbances"] == "--delay 1 --noise 0.5"
    assert "2 episodes on mujoco with --delay 1 --noise 0.5, seed" in repr(played)


@pytest.mark.parametrize("backend", ["mujoco", "gym"])
def test_both_engines_play_the_same_episodes(backend):
    policy = train(TrainConfig(backend=backend, episodes=200, seed=3)).policy
    compiled, python = (
        evaluate(policy, backend=backend, episodes=15, seed=3, engine=engine)
        for engine in ("compiled", "python")
    )
    assert compiled == python
    assert compiled.returns.tolist() == [episode.steps for episode in compiled.episodes]
    assert [episode.number for episode in compiled.episodes] == list(range(15))


def test_a_policy_that_is_any_function_is_played_in_python():
    policy = train(TrainConfig(episodes=200, seed=3)).policy
    assert evaluate(policy.__call__, episodes=5) == evaluate(policy, episodes=5)


def test_evaluating_changes_no_policy():
    policy = train(TrainConfig(episodes=20)).policy
    table, actions = policy.q_table.copy(), policy.choices.copy()
    evaluate(policy, episodes=3)
    assert policy.q_table.tobytes() == table.tobytes()
    assert policy.choices.tobytes() == actions.tobytes()


@pytest.mark.parametrize("engine", ["compiled", "python"])
def test_settings_that_make_no_sense_are_refused_whoever_plays(engine):
    policy = train(TrainConfig(episodes=2)).policy
    with pytest.raises(ConfigError, match="backend 'bullet' is unknown"):
        evaluate(policy, backend="bullet", engine=engine)
    with pytest.raises(ConfigError, match="takes no model, integrator, timestep or edits"):
        evaluate(policy, backend="gym", integrator="mujoco", engine=engine)
    with pytest.raises(ConfigError, match="whole number from 1 up, not 0"):
        evaluate(policy, episodes=0, engine=engine)
    with pytest.raises(ModelNotFoundError, match="'nothing'"):
        evaluate(policy, model="nothing", engine=engine)


@pytest.mark.parametrize("arguments", [{"episodes": 0}, {"episodes": -1}, {"seed": -1}])
def test_numbers_that_make_no_sense(arguments):
    with pytest.raises(ConfigError, match="whole number"):
        evaluate(falling, **arguments)
