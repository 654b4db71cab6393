"""What a memory may hold: what training comes to is taken, what it cannot come to is named."""

import functools
import typing

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.methods import METHODS
from mjcartpole.learning.methods.limits import check_limits
from mjcartpole.learning.training import Training
from nightly import at_night

CONFIGS = {
    **{name: {"method": name, "bins": (1, 2, 3, 4)} for name in METHODS},
    "model": {"method": "model", "sweeps": 20, "bins": (1, 2, 3, 4)},
    "tiles": {"method": "prioritized-replay", "tilings": 4, "bins": (1, 2, 2, 2)},
    "short lists": {"method": "model", "successors": 2, "sweeps": 20, "bins": (1, 1, 6, 6)},
    "random order": {"method": "prioritized-sweeping", "order": "random"},
    "long queue": {"method": "prioritized-sweeping", "planning": 1, "predecessors": 8},
    "little memory": {"method": "prioritized-replay", "replay_size": 37, "learn_last_step": False},
}


@functools.cache
def training_of(name):
    """A training between two of its episodes."""
    config = TrainConfig(backend="gym", episodes=14, **CONFIGS[name])
    training = Training(config, engine="python")
    for finished in training.run():
        if finished == 12:
            break
    return training


def whole_fields():
    """All fields of whole numbers, each with the name of its training."""
    memories = {name: training_of(name).learner.memory for name in CONFIGS}
    return [
        (n, f) for n in CONFIGS for f, a in memories[n]._asdict().items() if a.dtype.kind == "i"
    ]


def memory_of(training):
    return training.snapshot().memory


@pytest.mark.parametrize("name", CONFIGS)
def test_what_training_comes_to_is_taken(name):
    training = training_of(name)
    training.learner.check(memory_of(training))
    another = Training(training.config, engine="python")
    another.restore(training.snapshot())
    for field, array in memory_of(training).items():
        np.testing.assert_array_equal(memory_of(another)[field], array)


@pytest.mark.parametrize("method", METHODS)
def test_every_whole_number_has_limits(method):
    learner = training_of(method).learner
    for field, kind in type(learner.memory).__annotations__.items():
        whole = getattr(learner.memory, field).dtype.kind == "i"
        assert len(getattr(kind, "__metadata__", ())) >= whole, field


@pytest.mark.parametrize("name", CONFIGS)
def test_numbers_beyond_their_limits_are_named(name):
    training = training_of(name)
    for field, array in memory_of(training).items():
        wild = (2**62, -(2**62), -2) if array.dtype.kind == "i" else (np.nan, np.inf, -np.inf)
        for value in wild:
            for place in (0, array.size // 2, -1):
                memory = memory_of(training)
                memory[field][place] = value
                with pytest.raises(ValueError, match=f"^{field} has values that are not "):
                    training.learner.check(memory)


@pytest.mark.parametrize(
    ("name", "field", "change"),
    [
        ("sarsa", "next_action", lambda m: m["next_action"] + 1),
        ("n-step-sarsa", "steps_done", lambda m: m["steps_done"] + 1),
        ("n-step-sarsa", "actions", lambda m: m["actions"] + 2),
        ("n-step-sarsa", "states", lambda m: m["states"] + 24),
        ("actor-critic", "n_traced", lambda m: m["n_traced"] + 1),
        ("actor-critic", "value_traces", lambda m: m["value_traces"] + 0.5),
        ("actor-critic", "traced", lambda m: m["traced"] + 24),
        ("tiles", "next_states", lambda m: m["next_states"] + 5**3),
        ("prioritized-replay", "tree", lambda m: m["tree"] * np.arange(m["tree"].size)),
        ("prioritized-replay", "tree", lambda m: m["tree"] * 0),
        ("prioritized-replay", "tree", lambda m: m["tree"] - 1),
        ("prioritized-replay", "tree", lambda m: np.ones_like(m["tree"])),
        ("little memory", "tree", lambda m: m["tree"] * 1e6),
        ("model", "seen", lambda m: m["seen"] * 0),
        ("model", "seen", lambda m: np.roll(m["seen"], 1)),
        ("model", "counts", lambda m: m["counts"] + 1),
        ("model", "counts", lambda m: m["counts"].reshape(-1, 16)[:, ::-1].ravel()),
        ("prioritized-sweeping", "place", lambda m: np.roll(m["place"], 1)),
        ("long queue", "priority", lambda m: -m["priority"]),
        ("long queue", "n_predecessors", lambda m: m["n_predecessors"] * 0 + 9),
    ],
)
def test_what_contradicts_the_rest_is_named(name, field, change):
    training = training_of(name)
    memory = memory_of(training)
    forged = np.array(change(memory))
    assert forged.tobytes() != memory[field].tobytes()
    memory[field] = forged
    with pytest.raises(ValueError, match=f"^{field} "):
        training.learner.check(memory)


@given(st.data())
@settings(max_examples=at_night(300, fast=10))
def test_what_is_taken_can_be_learned_from(data):
    """Each entry that is changed to what others of its field are: refused, or harmless."""
    name, field = data.draw(st.sampled_from(whole_fields()))
    training = training_of(name)
    snapshot = training.snapshot()
    array, kind = snapshot.memory[field], type(training.learner.memory).__annotations__[field]
    (limits,) = kind.__metadata__
    low, high = limits(training.discretizer)
    for place in data.draw(st.lists(st.integers(0, array.size - 1), min_size=1, max_size=5)):
        array[place] = data.draw(st.integers(low, min(high, 9_999)))
    try:
        training.learner.check(snapshot.memory)
    except ValueError:
        return
    again = Training(training.config, engine="python")
    again.restore(snapshot)
    assert list(again.run())[-1] == 14
    again.learner.check(memory_of(again))


class Odd(typing.NamedTuple):
    free: "list[int]"


def test_a_field_without_limits_holds_any_finite_number():
    grid = Discretizer((2,), (-1.0,), (1.0,))
    check_limits(Odd(np.array([2**62, -(2**62)])), grid)
    with pytest.raises(ValueError, match="free has values that are not finite"):
        check_limits(Odd(np.array([1.0, np.nan])), grid)
