"""A policy comes back as it was, or not at all."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjcartpole.errors import ConfigError, FileError, PolicyFileError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.policy import Policy


def some_policy(seed=0):
    grid = TrainConfig().discretizer()
    return Policy(grid, np.random.default_rng(seed).normal(size=(*grid.bins, 2)))


def test_takes_the_better_action_and_the_first_of_equals():
    policy = Policy(
        Discretizer((3,), (0.0,), (3.0,)), np.array([[1.0, 2.0], [2.0, 1.0], [1.0, 1.0]])
    )
    assert [policy([value]) for value in (0.5, 1.5, 2.5)] == [1, 0, 0]
    assert policy(np.array([0.5], dtype=np.float32)) == 1
    assert type(policy([0.5])) is int


def test_a_table_must_fit_its_grid():
    with pytest.raises(ConfigError, match="shape"):
        Policy(Discretizer((3,), (0.0,), (3.0,)), np.zeros((4, 2)))
    with pytest.raises(ConfigError, match="finite"):
        Policy(Discretizer((1,), (0.0,), (3.0,)), np.array([[np.nan, 0.0]]))


def test_a_policy_comes_back_bit_for_bit(tmp_path):
    policy = some_policy()
    policy.save(tmp_path / "policy.json")
    again = Policy.load(tmp_path / "policy.json")
    assert again.discretizer == policy.discretizer
    assert again.q_table.tobytes() == policy.q_table.tobytes()


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=2, max_size=2))
@settings(max_examples=50)
def test_any_float_comes_back(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("policy") / "policy.json"
    policy = Policy(Discretizer((1,), (-0.1,), (1e-17,)), np.array([values]))
    policy.save(path)
    again = Policy.load(path)
    assert again.q_table.tobytes() == policy.q_table.tobytes()
    assert again.discretizer == policy.discretizer


def test_every_changed_byte_is_noticed(tmp_path):
    path = tmp_path / "policy.json"
    some_policy().save(path)
    original = path.read_bytes()
    rng = np.random.default_rng(1)
    for _ in range(300):
        damaged = bytearray(original)
        damaged[rng.integers(len(damaged))] ^= int(rng.integers(1, 256))
        path.write_bytes(damaged)
        with pytest.raises(PolicyFileError) as caught:
            Policy.load(path)
        assert "\n" not in str(caught.value)


def test_every_truncation_is_noticed(tmp_path):
    path = tmp_path / "policy.json"
    some_policy().save(path)
    original = path.read_bytes()
    for length in [*range(0, len(original), 97), len(original) - 1]:
        path.write_bytes(original[:length])
        with pytest.raises(PolicyFileError):
            Policy.load(path)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"hello",
        b"\x80\x04\x95pickle",
        b"[1, 2]",
        b"null",
        b"{}",
        b'{"format": "other"}',
        b"[" * 100_000,
        json.dumps({"format": "mjcartpole-policy", "version": 1}).encode(),
        json.dumps(
            {
                "format": "mjcartpole-policy",
                "version": 1,
                "bins": [10**9, 10**9],
                "low": [0, 0],
                "high": [1, 1],
                "q_table": [],
            }
        ).encode(),
        json.dumps(
            {
                "format": "mjcartpole-policy",
                "version": 1,
                "bins": 3,
                "low": "a",
                "high": None,
                "q_table": {},
            }
        ).encode(),
    ],
)
def test_foreign_files_are_refused(tmp_path, content):
    path = tmp_path / "policy.json"
    path.write_bytes(content)
    with pytest.raises(PolicyFileError):
        Policy.load(path)


def test_a_later_version_is_named(tmp_path):
    path = tmp_path / "policy.json"
    some_policy().save(path)
    path.write_text(path.read_text().replace('"version": 1', '"version": 5'))
    with pytest.raises(PolicyFileError, match="has version 5; this mjcartpole reads versions 1, 2"):
        Policy.load(path)


def test_a_path_that_leads_nowhere(tmp_path):
    with pytest.raises(PolicyFileError, match="cannot be read"):
        Policy.load(tmp_path / "nothing.json")
    with pytest.raises(PolicyFileError, match="cannot be read"):
        Policy.load(tmp_path)
    with pytest.raises(FileError, match="cannot write"):
        some_policy().save(tmp_path)


@pytest.mark.parametrize("bins", [(3,), (1, 3), (1, 3, 6, 8, 2), (1, 3, 6, 8, 2, 2)])
def test_a_policy_plays_only_where_the_observation_is_its_own(bins):
    grid = Discretizer(bins, (-1.0,) * len(bins), (1.0,) * len(bins))
    policy = Policy(grid, np.zeros((*bins, 2)))
    with pytest.raises(ConfigError, match=r"the policy is for .*, and here has 1 pole"):
        policy.check_fits(1, "here")


def test_a_policy_that_looks_at_actions_before_is_written_and_read(tmp_path):
    grid = Discretizer((1, 2, 1, 1, 2), (-1.0,) * 5, (1.0,) * 5, actions=1)
    policy = Policy(grid, np.arange(8.0).reshape(1, 2, 1, 1, 2, 2))
    policy.save(tmp_path / "policy.json")
    read = Policy.load(tmp_path / "policy.json")
    assert (read.discretizer, read.poles, read.actions) == (grid, 1, 1)
    read.check_fits(1, "here")
    read.check_fits(1, "here", actions=1)
    with pytest.raises(ConfigError, match="looks at 1 actions before, and here shows 0"):
        read.check_fits(1, "here", actions=0)
    with pytest.raises(ConfigError, match="is for 1 pole, and here has 2 poles"):
        read.check_fits(2, "here")
