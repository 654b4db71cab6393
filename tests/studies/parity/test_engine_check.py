"""Rung 10: dm_control as a witness, or why not."""

import sys

import pytest

from parity_cases import REFERENCE, changed, climb


def test_what_dm_control_gives_up_on_is_no_crash():
    pytest.importorskip("mjcartpole.envs.dm", exc_type=ImportError)
    thick = changed(("<option ", '<option viscosity="1e300" '))
    result = climb(thick, "itself", (10,))[1][10]
    assert result.verdict == "skipped"
    assert "dm_control does not step this document" in result.skipped


def test_a_dm_control_that_does_not_load_is_skipped_in_words(monkeypatch):
    monkeypatch.setitem(sys.modules, "dm_control", None)
    monkeypatch.delitem(sys.modules, "mjcartpole.physics.dm_control", raising=False)
    result = climb(REFERENCE, "itself", (10,))[1][10]
    assert result.verdict == "skipped"
    assert result.skipped.startswith(("dm-control ", "dm_control is not installed"))
    assert "\n" not in result.skipped
