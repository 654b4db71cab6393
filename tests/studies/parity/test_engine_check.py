"""Rung 10: dm_control as a witness, or why not."""

from importlib.metadata import version

import pytest

from parity_cases import REFERENCE, changed, climb


def test_what_dm_control_gives_up_on_is_no_crash():
    pytest.importorskip("mjcartpole.envs.dm", exc_type=ImportError)
    thick = changed(("<option ", '<option viscosity="1e300" '))
    result = climb(thick, "itself", (10,))[1][10]
    assert result.verdict == "skipped"
    assert "dm_control does not step this document" in result.skipped


def test_a_dm_control_made_for_another_mujoco_is_skipped_in_words(monkeypatch):
    pytest.importorskip("mjcartpole.envs.dm", exc_type=ImportError)
    from dm_control.mujoco.wrapper.mjbindings import sizes

    stale = {**sizes.array_sizes["mjmodel"], "renamed_since": ("nq",)}
    monkeypatch.setitem(sizes.array_sizes, "mjmodel", stale)
    result = climb(REFERENCE, "itself", (10,))[1][10]
    assert result.verdict == "skipped"
    versions = f"dm-control {version('dm-control')} with mujoco {version('mujoco')}"
    assert result.skipped.startswith(f"{versions} does not load this document: AttributeError")
    assert "renamed_since" in result.skipped
