"""Bits are those that docs/golden.json has of each release."""

import copy
import json
import runpy
from pathlib import Path

import mujoco
import pytest

from nightly import few

ROOT = Path(__file__).resolve().parents[1]
GOLDEN = runpy.run_path(str(ROOT / "scripts" / "golden.py"))
RELEASES = json.loads((ROOT / "docs" / "golden.json").read_text(encoding="utf-8"))
ENTRIES = [(release, name) for release, entries in RELEASES.items() for name in entries]
QUICK = [one for one in ENTRIES if one[0] == "next" and one[1] != "tuned on gym"]
"""The gym's table is among the slow ones: its equations are compiled apart."""


@pytest.mark.parametrize(("release", "name"), few(ENTRIES, *QUICK))
def test_bits_are_those_of_a_release(release, name):
    entry = RELEASES[release][name]
    assert GOLDEN["verdict"](entry, GOLDEN["digest"](entry)).startswith("same bits")


def test_what_is_held_of_today_is_what_today_gives():
    """A preset that changes has its new numbers written down."""
    held, today = map(GOLDEN["settings"], (RELEASES["next"], GOLDEN["today"]()))
    assert held == today, "run with each MuJoCo: python scripts/golden.py --write next"


@pytest.mark.parametrize(
    ("sha256", "found", "words"),
    [
        ({mujoco.__version__: "a"}, "a", "same bits"),
        ({mujoco.__version__: "a"}, "b", "MOVED: b, was a"),
        ({"1.0": "a", "2.0": "b"}, "b", "same bits as MuJoCo 2.0"),
        ({"1.0": "a"}, "b", "MOVED: b, of no MuJoCo"),
    ],
)
def test_what_moved_is_told(sha256, found, words):
    assert GOLDEN["verdict"]({"sha256": sha256}, found) == words


@pytest.mark.slow
def test_the_next_release_is_written_anew_where_settings_changed(tmp_path):
    file, releases = tmp_path / "golden.json", copy.deepcopy(RELEASES)
    releases["next"]["tuned on gym"]["config"]["alpha"] = 0.7
    releases["0.1.0"]["tuned on gym"]["config"]["alpha"] = 0.7
    GOLDEN["write"]("next", releases, file)
    written = json.loads(file.read_text(encoding="utf-8"))
    assert GOLDEN["settings"](written["next"]) == GOLDEN["settings"](RELEASES["next"])
    assert written["0.1.0"] == releases["0.1.0"]


@pytest.mark.slow
def test_a_release_is_added_beside_the_others(tmp_path):
    file, releases = tmp_path / "golden.json", {"0.1.0": RELEASES["0.1.0"]}
    GOLDEN["write"]("0.2.0", copy.deepcopy(releases), file)
    written = json.loads(file.read_text(encoding="utf-8"))
    assert written["0.1.0"] == RELEASES["0.1.0"]
    assert written["0.2.0"].keys() == RELEASES["next"].keys()
    for name, entry in written["0.2.0"].items():
        assert entry["sha256"].keys() == {mujoco.__version__}
        assert GOLDEN["verdict"](RELEASES["next"][name], *entry["sha256"].values()) == "same bits"
