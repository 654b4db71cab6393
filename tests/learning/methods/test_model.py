"""A counted model by known answers, and against value iteration on matrices."""

import numpy as np
import pytest

from command_line import call
from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig
from worlds import Slippery, Walk, best_values, counted

MODEL = {"method": "model", "gamma": 0.9, "epsilon": 0.0, "tolerance": 1e-9}
AT_RANDOM = {"epsilon": 1.0, "epsilon_final": 1.0}


def learned(q):
    q.replay([0], [], [], terminated=False)
    return q.table


def test_a_value_is_the_mean_over_what_was_seen(at_work):
    q = at_work([[10.0, 10.0], [3.0, 4.0]], **MODEL)
    q.step(0, 1, 1.0, 1)
    q.step(0, 1, 2.0, 1, truncated=True)
    q.step(0, 1, 1.0, 1, terminated=True)
    # Two of three times it went on: (4 + 2 · 0.9 · 4) / 3. What was not seen stays.
    assert learned(q) == [[10.0, pytest.approx(11.2 / 3)], [3.0, 4.0]]


def test_sweeps_reach_from_the_end_to_the_beginning(at_work):
    q = at_work([[0.0, 0.0]] * 3, **MODEL | {"tolerance": 0.05, "sweeps": 1})
    for s in (0, 1):
        q.step(s, 0, 1.0, s + 1)
    q.step(2, 0, 1.0, 2)
    # What was seen last first: 1, then 1 + 0.9, then 1 + 0.9 · 1.9.
    assert learned(q)[:2] == [[pytest.approx(2.71), 0.0], [pytest.approx(1.9), 0.0]]
    # The loop on state 2 is worth 10 in the end; sweeps end where a change is within 0.05.
    q = at_work([[0.0, 0.0]], **MODEL | {"tolerance": 0.05})
    q.step(0, 0, 1.0, 0)
    assert learned(q) == [[pytest.approx(10 - 10 * 0.9**30), 0.0]]


def test_the_last_step_can_be_left_out(at_work):
    q = at_work([[1.0, 2.0], [3.0, 4.0]], **MODEL, learn_last_step=False)
    q.step(0, 1, 1.0, 1, terminated=True)
    assert learned(q) == [[1.0, 2.0], [3.0, 4.0]]


def test_a_table_that_balances_is_left_as_it_is_where_that_is_asked_for(at_work):
    q = at_work([[1.0, 2.0], [3.0, 4.0]], **MODEL, plan_after="failure")
    q.step(0, 1, 1.0, 0, truncated=True)
    q.replay([0, 0], [1], [1.0], terminated=False)
    assert q.table == [[1.0, 2.0], [3.0, 4.0]]
    q.step(0, 1, 1.0, 0, terminated=True)
    q.replay([0, 0], [1], [1.0], terminated=True)
    # What was counted meanwhile counts: (2 + 0.9 V) / 2, of which V is 2 / 1.1.
    assert q.table == [[1.0, pytest.approx(2 / 1.1)], [3.0, 4.0]]


def test_a_walk_has_the_values_of_its_shortest_way(at_work):
    q = at_work([[0.0, 0.0]] * 7, **MODEL | AT_RANDOM)
    q.play(Walk(7), 30)
    # The end on the right is 7 - s steps away, and gives 1.
    right = [0.9 ** (6 - s) for s in range(7)]
    left = [0.0, *(0.9 * value for value in right[:-1])]
    np.testing.assert_allclose(q.table, np.transpose([left, right]), atol=1e-8)


@pytest.mark.parametrize("seed", range(3))
def test_it_is_value_iteration_on_the_matrices_of_what_was_seen(at_work, seed):
    q = at_work([[0.0, 0.0]] * 6, **MODEL | AT_RANDOM | {"tolerance": 1e-5}, seed=seed)
    played = q.play(Slippery(6), 20, seed)
    values = best_values(*counted(played, 6), 0.9)
    # Sweeps end at changes of 1e-5: the values are within gamma / (1 - gamma) times that.
    np.testing.assert_allclose(q.table, values, atol=9e-5)


def test_it_comes_to_the_values_of_the_world_itself(at_work):
    world = Slippery(6)
    q = at_work([[0.0, 0.0]] * 6, **MODEL | AT_RANDOM | {"tolerance": 0.01})
    q.play(world, 100)
    values = best_values(world.rewards, world.leads, 0.9)
    # A chance of 0.2 is known to 0.04 after the 100 steps that each action in the last state has
    # had, its value of 28 to 1.1; three times that.
    np.testing.assert_allclose(q.table, values, atol=3.3)


def test_a_full_list_keeps_what_comes_often(at_work):
    q = at_work([[0.0, 0.0]] * 50, **MODEL, successors=4)
    rng = np.random.default_rng(0)
    for s_next in rng.permutation([1] * 100 + [2] * 60 + list(range(3, 50))):
        q.step(0, 0, 0.0, s_next)
    counts = dict(zip(q.memory.successors[:4].tolist(), q.memory.counts[:4].tolist(), strict=True))
    assert sum(counts.values()) == q.memory.visits[0] == 207
    # Nothing is counted too little, and nothing by more than a list's share of all too much.
    assert 100 <= counts[1] <= 100 + 207 / 4 and 60 <= counts[2] <= 60 + 207 / 4


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"sweeps": 0}, "sweeps must be a whole number from 1 to"),
        ({"successors": 2.5}, "successors must be a whole number from 1"),
        ({"tolerance": 0.0}, "tolerance must be a number above 0, not 0.0"),
        ({"plan_after": "never"}, "plan_after must be 'episode' or 'failure', not 'never'"),
        ({"gamma": 1.1}, "gamma must be a number from 0 to 1"),
        ({"epsilon": -1}, "epsilon must be"),
        ({"alpha": 0.1}, "method 'model' has no alpha; available: .*sweeps"),
    ],
)
def test_values_that_make_no_sense(values, message):
    with pytest.raises(ConfigError, match=message):
        TrainConfig(method="model", **values)


def test_a_table_that_is_too_large_is_refused_before_anything_is_written(
    capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    code, _, err = call(["train", "--method", "model", "--bins", "30,30,30,30"], capsys)
    assert (code, err.count("\n")) == (2, 1)
    assert "states with 16 successors" in err and "give fewer bins or successors" in err
    assert [path for path in tmp_path.rglob("*") if path.name not in ("runs", "videos")] == []
