"""Words as people write them, and as the grammar takes them."""

from dataclasses import dataclass, field
from pathlib import Path

import pytest

from mjcartpole.commands.options import UsageError
from mjcartpole.commands.words import list_flags, rewritten, value_of

LISTS = {"--bins", "--models"}


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("--set a=1 run --set b=2,c=3", "run --set a=1 b=2 c=3"),
        ("--set a=1 b=2 run", "run --set a=1 b=2"),
        ("--set a run", "run --set a"),
        ("--set=a=1 --seed 3", "--seed 3 --set a=1"),
        ("--set a=1,2", "--set a=1,2"),
        ("--bins 1,2 3 --low 4,5", "--bins 1 2 3 --low 4,5"),
        ("--bins=[1,2] x", "--bins 1 2 x"),
        ("--bins -1,2 -o a,b", "--bins -1 2 -o a,b"),
        ("-x.xml -o=-y.png --a-b.xml", "./-x.xml -o=-y.png --a-b.xml"),
    ],
)
def test_words_are_rewritten(words, expected):
    assert rewritten(words.split(), LISTS) == expected.split()


def test_a_gap_in_a_list_is_a_mistake():
    with pytest.raises(UsageError, match="'1,,2' has nothing between two commas"):
        rewritten(["--bins", "1,,2"], LISTS)


def test_a_file_whose_name_has_a_comma_is_one_value(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("a,b.xml").write_text("")
    assert rewritten(["--models", "a,b.xml", "c,d"], LISTS) == ["--models", "a,b.xml", "c", "d"]


def test_the_value_of_a_flag():
    assert value_of("--preset", ["train", "--preset", "article"], "tuned") == "article"
    assert value_of("--preset", ["--preset=article", "--preset", "x"], "tuned") == "article"
    assert value_of("--preset", ["train", "--presets", "x"], "tuned") == "tuned"
    assert value_of("--preset", ["--preset"], "tuned") == ""


@dataclass(frozen=True)
class Part:
    low: tuple[float, ...] = ()


@dataclass(frozen=True)
class Longer(Part):
    tiles: tuple[int, ...] = ()


@dataclass(frozen=True)
class Flags:
    part: Part = field(default_factory=Part)
    my_models: tuple[str, ...] = ()
    set: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()
    seed: int = 0


def test_lists_are_known_by_their_types():
    assert list(list_flags(Flags)) == ["--low", "--my-models"]
    assert list(list_flags(Flags(part=Longer()))) == ["--low", "--tiles", "--my-models"]
