"""What others build on is what docs/api.txt says."""

import runpy
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
API = runpy.run_path(str(ROOT / "scripts" / "public_api.py"))


def test_names_signatures_environments_and_flags_are_those_written_down():
    written = (ROOT / "docs" / "api.txt").read_text(encoding="utf-8")
    assert API["written"]().splitlines() == written.splitlines(), (
        "meant so? then run: python scripts/public_api.py"
    )


def test_a_changed_default_is_seen():
    def load(source="cartpole", *, own_timestep: bool = False) -> int: ...

    assert API["signature"](load) == "(source='cartpole', *, own_timestep=False)"
