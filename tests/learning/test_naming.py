"""Names of runs: short, legal everywhere, and another for other settings."""

import doctest
import re

import hypothesis.strategies as st
import pytest
from hypothesis import given

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.learning import naming
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.naming import added_flags, in_flags, namesakes, run_name, shortened
from mjcartpole.learning.presets import PRESETS

numbers = st.floats(0, 1).filter(lambda x: x != 0) | st.sampled_from([0.1, 1, 1e-5, 0.0])
edits = st.builds(
    "{}={}".format,
    st.sampled_from(["pole.length", "joint:hinge.damping", "joint_hinge.damping", "a.x1", "a.x"]),
    st.sampled_from(["1", "1.5", "-1", "11", "1e5", "0 0 1", "1.5-a.x1"]),
)
configs = st.fixed_dictionaries(
    {},
    optional={
        "model": st.sampled_from(
            ["long", "long.xml", "LONG.xml", "a/long.xml", "b/long.xml", "own_timestep"]
        ),
        "set": st.lists(edits, max_size=3).map(tuple),
        "vary": st.sampled_from(["force=8:10", "force=8,10", "force=8:10:log", "gravity=8:10"]),
        "push": st.sampled_from([("0.5@4s",), ("0.5@~4s",), ("-0.5@4s",), ("0.5@4s", "1@2s")]),
        "delay": st.integers(0, 3),
        "own_timestep": st.booleans(),
        "integrator": st.sampled_from(["gym", "mujoco"]),
        "episodes": st.integers(1, 10**9),
        "alpha": numbers,
        "alpha_final": numbers,
        "td_lambda": st.none() | numbers,
        "ties": st.sampled_from(["first", "random"]),
        "learn_last_step": st.booleans(),
        "log_every": st.integers(1, 10**9),
        "bins": st.sampled_from([(1, 3, 6, 8), (13, 6, 8, 1), (1, 1, 36, 8)]),
        "seed": st.integers(0, 2**128 - 1),
    },
).map(lambda changes: TrainConfig(**changes))


def test_the_docstrings_hold():
    assert doctest.testmod(naming).failed == 0


@pytest.mark.parametrize("preset", PRESETS)
def test_a_preset_alone_is_named_alone(preset):
    config = TrainConfig.preset(preset, seed=3)
    assert run_name(preset, config) == f"{preset}-mujoco-seed3"
    assert in_flags(preset, config) == ""


def test_flags_are_what_the_command_line_takes() -> None:
    given = {"vary": ("force=8,10", "gravity=1:2"), "push": "0.5@~4s", "noise": (0.1, 0, 0, 2)}
    some = Disturbances(**given, lag=0.5, observe_actions=2)
    assert (
        added_flags(some)
        == "--vary force=8,10 gravity=1:2 --lag 0.5 --push '0.5@~4s' --noise 0.1,0,0,2"
    )
    assert in_flags("tuned", TrainConfig(observe_actions=2)) == "--observe-actions 2"


@given(configs, configs)
def test_settings_have_names_of_their_own(one, other):
    names = [run_name("tuned", config).casefold() for config in (one, other)]
    assert (names[0] == names[1]) == (one == other)


@given(configs, st.sampled_from(list(PRESETS)), st.integers(2, 100_000))
def test_a_name_is_short_and_legal_everywhere(config, preset, seeds):
    for name in (run_name(preset, config), run_name(preset, config, seeds)):
        assert re.fullmatch(r"[a-z0-9][a-z0-9._+-]*[a-z0-9]", name)
        assert len(name) < 120


def test_a_number_is_never_cut():
    config = TrainConfig(
        low=(-2.25, -1.0625, -0.25, -1.5), high=(2.25, 1.0625, 0.25, 1.25), gamma=0.5, alpha=0.25
    )
    name = run_name("tuned", config)
    assert re.fullmatch(
        r"tuned-mujoco-low-2.25_-1.0625_-0.25_-1.5-high2.25_1.0625_0.25_1.25-[0-9a-f]{8}-seed0",
        name,
    )


def test_a_number_of_its_own_is_no_other_run(tmp_path):
    for name in ("a-seed0", "a-seed0-2", "a-seed0-10", "a-seed0-x", "a-seeds0-2", "b-seed0"):
        (tmp_path / name).mkdir()
    family = [tmp_path / name for name in ("a-seed0", "a-seed0-2", "a-seed0-10")]
    for folder in family:
        assert namesakes(folder) == family
    assert namesakes(tmp_path / "a-seeds0-2") == [tmp_path / "a-seeds0-2"]


@pytest.mark.parametrize("text", ["x" * 300, "ä" * 150, "\udcff" * 200])
def test_a_long_text_is_cut_to_bytes(text):
    assert shortened("short", 30) == "short"
    assert len(shortened(text, 30).encode(errors="surrogateescape")) <= 30
    assert shortened(text, 30) != shortened(text + "x", 30)
