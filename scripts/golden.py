"""Whether bits moved since a release: tables and steps, played again, by their SHA-256.

docs/golden.json has, for each release, what was learned or stepped, every number that decides it,
and the SHA-256 of what came out, by version of MuJoCo. `python scripts/golden.py` does all of it
again with the MuJoCo that is here; `--write 1.2.0` adds a release, or this MuJoCo to one of them.
"""

import argparse
import hashlib
import json
import sys
from pathlib import Path
from typing import Any, Final

import gymnasium
import mujoco
import numpy as np

import mjcartpole
from mjcartpole.learning.documents import read_values

FILE: Final = Path(__file__).resolve().parents[1] / "docs" / "golden.json"
STEPS: Final = 10_000
PRESET: Final = "tuned"
NEXT: Final = "next"

Entry = dict[str, Any]
"""`config` of a training, or the `integrator` of steps; and `sha256` by version of MuJoCo."""


def today() -> dict[str, Entry]:
    """Return what is held for a release that is made now, not done yet."""
    entries: dict[str, Entry] = {
        f"{PRESET} on {backend}": {
            "config": mjcartpole.TrainConfig.preset(PRESET, backend=backend).stored(),
            "sha256": {},
        }
        for backend in ("mujoco", "gym")
    }
    for integrator in ("gym", "mujoco"):
        name = f"{STEPS:,} steps, integrator {integrator}"
        entries[name] = {"integrator": integrator, "sha256": {}}
    return entries


def digest(entry: Entry) -> str:
    """Return the SHA-256 of what an entry is about, done again."""
    if "integrator" in entry:
        return hashlib.sha256(trajectory(entry["integrator"])).hexdigest()
    config = json.loads(json.dumps(entry["config"]))
    return hashlib.sha256(mjcartpole.train(read_values(config)).q_table.tobytes()).hexdigest()


def trajectory(integrator: str) -> bytes:
    """Return all states of random actions, a new episode after each fall; float64."""
    env: Any = gymnasium.make(mjcartpole.ENV_ID, integrator=integrator).unwrapped
    rng = np.random.default_rng(0)
    env.reset(seed=0)
    states = np.empty((STEPS, 4))
    for state, action in zip(states, rng.integers(2, size=STEPS), strict=True):
        is_over = env.step(int(action))[2]
        state[:] = env.state
        if is_over:
            env.reset()
    return states.tobytes()


def verdict(entry: Entry, found: str) -> str:
    """Return how what came out compares: with this MuJoCo's, or with all where it has none."""
    known: dict[str, str] = entry["sha256"]
    there = known.get(mujoco.__version__)
    if there is not None:
        return "same bits" if there == found else f"MOVED: {found[:12]}, was {there[:12]}"
    same = [version for version, one in known.items() if one == found]
    return (
        f"same bits as MuJoCo {', '.join(same)}" if same else f"MOVED: {found[:12]}, of no MuJoCo"
    )


def compare(releases: dict[str, dict[str, Entry]]) -> bool:
    """Print a line for each entry; return whether all bits are where they were."""
    print(f"mjcartpole {mjcartpole.__version__}, MuJoCo {mujoco.__version__}")
    verdicts = []
    for release, entries in releases.items():
        for name, entry in entries.items():
            verdicts.append(verdict(entry, digest(entry)))
            print(f"  {release:6} {name:32} {verdicts[-1]}")
    return not any(one.startswith("MOVED") for one in verdicts)


def settings(entries: dict[str, Entry]) -> str:
    """Return what entries are of, as JSON has it, without what came out."""
    kept = {name: {**entry, "sha256": None} for name, entry in entries.items()}
    return json.dumps(kept, sort_keys=True)


def write(release: str, releases: dict[str, dict[str, Entry]], file: Path = FILE) -> None:
    """Do what a release holds, and keep it in the file beside what other MuJoCos gave.

    What holds for the next release is what is so today, where that has changed.
    """
    if release == NEXT and settings(releases.get(NEXT, {})) != settings(today()):
        releases[NEXT] = today()
    entries = releases.setdefault(release, today())
    for entry in entries.values():
        entry["sha256"][mujoco.__version__] = digest(entry)
    file.write_text(json.dumps(releases, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def main() -> int:
    """Compare, or write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--write", metavar="RELEASE", help="do it, and keep it under this name")
    wanted = parser.parse_args().write
    releases = json.loads(FILE.read_text(encoding="utf-8"))
    if wanted:
        write(wanted, releases)
    return 0 if compare(releases) else 1


if __name__ == "__main__":
    sys.exit(main())
