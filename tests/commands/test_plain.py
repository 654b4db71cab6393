"""Plain flags are read as tyro reads them, and nothing else is."""

import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjcartpole.commands.parsing import _by_tyro
from mjcartpole.commands.plain import plain
from mjcartpole.errors import MjCartPoleError
from nightly import examples

PLAIN = [
    "train",
    "train --no-video --seed 3 --alpha=0.5",
    "train --preset article --method sarsa --episodes 7 --run-dir a/b --until 1e2",
    "evaluate --policy lqr --json --backend gym",
]
NOT_PLAIN = [
    "",
    "--help",
    "nothing",
    "options",
    "../cli",
    "train --help",
    "train seed 3",
    "train --seed",
    "train --seed=",
    "train --seed -1",
    "train --seed x",
    "train --seed 1 --seed 2",
    "train --video --no-video",
    "train --video=yes",
    "train --run_dir a",
    "train --run-dir None",
    "train --backend dm",
    "train --episodes 0",
    "train --preset nothing",
    "train --method nothing",
    "train --bins 1,2,3,4",
    "train --mirror",
    "train --resume a --alpha 1",
    "evaluate runs/a",
    "watch",
    "page -o a.html",
]


@pytest.mark.parametrize("line", PLAIN)
def test_plain_flags_mean_what_tyro_makes_of_them(line):
    assert plain(line.split()) == _by_tyro(line.split())


@pytest.mark.parametrize("line", NOT_PLAIN)
def test_all_else_is_left_to_tyro(line):
    assert plain(line.split()) is None


VALUES = st.sampled_from(
    [
        "0",
        "1",
        "7",
        "-2",
        "1_0",
        "1.5",
        "1e3",
        "nan",
        "x",
        "None",
        "gym",
        "first",
        "a b",
        "True",
        "²",
    ]
)
FLAGS = st.sampled_from(
    [
        "seed",
        "episodes",
        "alpha",
        "td-lambda",
        "until",
        "run-dir",
        "backend",
        "ties",
        "task",
        "method",
        "x-limit",
        "workers",
        "pool",
        "resume",
        "video",
        "no-video",
        "own-timestep",
        "epsi",
    ]
)


@st.composite
def lines(draw):
    words = ["train"]
    for flag in draw(st.lists(FLAGS, max_size=3)):
        value = draw(st.none() | VALUES)
        forms = [[f"--{flag}"]] if value is None else [[f"--{flag}", value], [f"--{flag}={value}"]]
        words += draw(st.sampled_from(forms))
    return words


@pytest.mark.slow
@examples(150)
@given(lines())
def test_whatever_is_read_is_what_tyro_reads(words):
    found = plain(words)
    try:
        expected = _by_tyro(words)
    except (MjCartPoleError, SystemExit):
        expected = None
    assert repr(found) == repr(expected) or found is None


def test_a_plain_command_imports_neither_other_commands_nor_what_checks_types():
    code = (
        "import sys; from mjcartpole.commands.parsing import parse; parse(['doctor', '--json'])\n"
        "others = {'mjcartpole.commands.train', 'typeguard', 'asyncio', 'unittest.mock'}\n"
        "print(sorted(others & set(sys.modules)))"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True) == "[]\n"
