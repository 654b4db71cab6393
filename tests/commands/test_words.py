"""Words as people write them, and as the grammar takes them."""

from dataclasses import dataclass
from pathlib import Path

import pytest
import tyro

from mjcartpole.commands.options import UsageError
from mjcartpole.commands.parsing import parse
from mjcartpole.commands.words import LISTS, rewritten, value_of


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("--set a=1 run --set b=2,c=3", "run --set a=1 b=2,c=3"),
        ("--set a=1 b=2 run", "run --set a=1 b=2"),
        ("--set a run", "run --set a"),
        ("--set=a=1 --seed 3", "--seed 3 --set a=1"),
        ("--vary a.b=1:2 --vary c.d=1,2", "--vary a.b=1:2 c.d=1,2"),
        ("--vary=a.b=1:2 x --vary c.d=3", "x --vary a.b=1:2 c.d=3"),
        ("--push -1@2s -2@~1s run", "run --push -1@2s -2@~1s"),
        ("--push 1@2s --set a=1", "--set a=1 --push 1@2s"),
        ("-x.xml -o=-y.png --a-b.xml", "./-x.xml -o=-y.png --a-b.xml"),
    ],
)
def test_edits_are_gathered_and_files_are_files(words, expected):
    assert rewritten(words.split()) == expected.split()


def test_the_value_of_a_flag():
    assert value_of("--preset", ["train", "--preset", "article"], "tuned") == "article"
    assert value_of("--preset", ["--preset=article", "--preset", "x"], "tuned") == "article"
    assert value_of("--preset", ["train", "--presets", "x"], "tuned") == "tuned"
    for words in (["--preset"], ["--preset", "--seed", "3"]):
        assert value_of("--preset", words, "tuned") == "tuned"


@dataclass(frozen=True)
class Flags:
    low: tuple[float, ...] = ()
    models: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()
    seed: int = 0


def parsed(words):
    with LISTS:
        return tyro.cli(Flags, args=words.split())


@pytest.mark.parametrize(
    ("words", "flags"),
    [
        ("--low -1,2e0, -.5 3 --seed 4", Flags(low=(-1.0, 2.0, -0.5, 3.0), seed=4)),
        ("--low=[1,2]", Flags(low=(1.0, 2.0))),
        ("--models a=1,b.c=2 d=1,2 e,f", Flags(models=("a=1", "b.c=2", "d=1,2", "e", "f"))),
        ("--files a,b c", Flags(files=(Path("a,b"), Path("c")))),
    ],
)
def test_commas_part_values_but_not_paths(words, flags):
    assert parsed(words) == flags


def test_a_gap_in_a_list_is_a_mistake():
    with pytest.raises(UsageError, match="'1,,2' has nothing between two commas"):
        parsed("--low 1,,2")


def test_a_file_whose_name_has_a_comma_is_one_value(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("a,b.xml").write_text("")
    assert parsed("--models a,b.xml c,d").models == ("a,b.xml", "c", "d")


@pytest.mark.parametrize(
    ("words", "mirror"),
    [
        ([], None),
        (["--mirror"], True),
        (["--mirror", "--seed", "3"], True),
        (["--seed", "3", "--mirror", "yes"], True),
        (["--mirror", "no"], False),
        (["--no-mirror", "--seed", "3"], False),
    ],
)
def test_a_flag_that_is_yes_no_or_left_to_what_is_found(words, mirror):
    assert parse(["train", *words]).config.mirror is mirror


def test_what_is_neither_yes_nor_no():
    with pytest.raises(UsageError, match="--mirror: 'maybe' is neither yes nor no"):
        parse(["train", "--mirror", "maybe"])


def test_a_list_has_a_value():
    for flag in ("--push", "--set", "--noise"):
        with pytest.raises(UsageError, match="a value is missing"):
            parse(["train", flag])
