"""n-step SARSA by known answers."""

import numpy as np
import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.training import train
from worlds import Walk

TWO = {"method": "n-step-sarsa", "n_steps": 2, "alpha": 0.5, "gamma": 0.9, "epsilon": 0.0}
TABLE = [[0.0, 1.0], [0.0, 2.0], [0.0, 4.0]]


def test_a_step_is_learned_when_the_one_after_it_is_done(at_work):
    q = at_work(TABLE, **TWO)
    q.step(0, 1, 1.0, 1)
    assert q.table == TABLE
    q.step(1, 1, 0.5, 2)
    # G = 1 + 0.9 · 0.5 + 0.9² · 4 = 4.69, half way from 1.
    assert q.table == [[0.0, pytest.approx(2.845)], [0.0, 2.0], [0.0, 4.0]]
    assert q.act(2) == q.memory.next_action[0] == 1


@pytest.mark.parametrize(
    ("ending", "last", "first"),
    [
        # The last: G = 0.5, half way from 2. The first: G = 1 + 0.9 · 0.5 = 1.45, half way from 1.
        ({"terminated": True}, 1.25, 1.225),
        # The last: G = 0.5 + 0.9 · 4 = 4.1. The first: G = 1 + 0.9 · 4.1 = 4.69.
        ({"truncated": True}, 3.05, 2.845),
    ],
)
def test_at_the_end_all_is_learned_that_is_left(at_work, ending, last, first):
    q = at_work(TABLE, **TWO)
    q.step(0, 1, 1.0, 1)
    q.step(1, 1, 0.5, 2, **ending)
    assert q.table == [[0.0, pytest.approx(first)], [0.0, last], [0.0, 4.0]]
    assert q.memory.next_action[0] == -1
    q.step(0, 1, 1.0, 1)
    assert q.table[0][1] == pytest.approx(first)  # nothing of the episode before is in it


def test_the_last_step_can_be_left_out(at_work):
    q = at_work(TABLE, **TWO, learn_last_step=False)
    q.step(0, 1, 1.0, 1)
    q.step(1, 1, 0.5, 2, terminated=True)
    # What came before it bootstraps there: G = 1 + 0.9 · 2.
    assert q.table == [[0.0, pytest.approx(1.9)], [0.0, 2.0], [0.0, 4.0]]


def by_the_book(table, episodes, n, alpha, gamma):
    """Learn as section 7.2 says; what is left at the end, latest first, as ours."""
    q = {(s, a): table[s][a] for s in range(len(table)) for a in (0, 1)}
    for steps in episodes:
        rewards, end = [step[2] for step in steps], len(steps)
        order = [*range(end - n), *range(end - 1, max(0, end - n) - 1, -1)]
        for tau in order:
            window = rewards[tau : tau + n]
            target = sum(gamma**k * r for k, r in enumerate(window))
            if tau + n < end:
                target += gamma**n * q[steps[tau + n][:2]]
            q[steps[tau][:2]] += alpha * (target - q[steps[tau][:2]])
    return [[q[s, a] for a in (0, 1)] for s in range(len(table))]


@pytest.mark.parametrize("n", [1, 3, 8, 100])
def test_it_learns_what_the_book_says(at_work, n):
    table = np.random.default_rng(n).normal(size=(7, 2)).tolist()
    values = {"alpha": 0.3, "alpha_final": 0.3, "gamma": 0.9, "epsilon": 0.7, "epsilon_final": 0.7}
    q = at_work(table, method="n-step-sarsa", n_steps=n, **values)
    episodes = q.play(Walk(7), 50)
    np.testing.assert_allclose(q.table, by_the_book(table, episodes, n, 0.3, 0.9), atol=1e-12)


@pytest.mark.parametrize("n", [1, 4])
def test_a_random_walk_has_the_values_that_it_has(at_work, n):
    values = {"alpha": 0.2, "gamma": 1.0, "epsilon_final": 1.0, "decay": 1.0, "episodes": 2_000}
    q = at_work([[0.5, 0.5]] * 5, method="n-step-sarsa", n_steps=n, **values)
    q.play(Walk(5), 2_000)
    np.testing.assert_allclose(q.table, Walk(5).at_random(), atol=0.06)


def test_one_step_is_sarsa():
    common = {"backend": "gym", "episodes": 40, "ties": "random", "seed": 4}
    for last in (True, False):
        ours, theirs = (
            train(TrainConfig(**common, **of, learn_last_step=last), engine="python")
            for of in ({"method": "n-step-sarsa", "n_steps": 1}, {"method": "sarsa"})
        )
        assert ours.q_table.tobytes() == theirs.q_table.tobytes()
        assert ours.returns.tolist() == theirs.returns.tolist()


@pytest.mark.parametrize("n", [0, -1, 10_001, 2.0, True])
def test_an_n_that_makes_no_sense(n):
    with pytest.raises(ConfigError, match="n_steps must be a whole number from 1 to 10,000"):
        TrainConfig(method="n-step-sarsa", n_steps=n)
