"""Greedy episodes, counted."""

import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.studies.evaluation import evaluate


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


@pytest.mark.parametrize("arguments", [{"episodes": 0}, {"episodes": -1}, {"seed": -1}])
def test_numbers_that_make_no_sense(arguments):
    with pytest.raises(ConfigError, match="whole number"):
        evaluate(falling, **arguments)
