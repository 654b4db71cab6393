"""A release, tried out before it is one: `make release-check`.

Builds the source archive and the wheel, installs each in a fresh environment, trains, films, edits
and writes a page there in an empty folder, and says what an index and a user would get: metadata,
licences, sizes.
"""

import os
import subprocess
import sys
import tempfile
import tomllib
import venv
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
JOBS = (
    "train --backend mujoco",
    "render runs/tuned-mujoco-seed0 -o film.gif --size 320x240 --fps 12.5",
    "model edit cartpole --set pole.length=1.5 -o mine.xml",
    "train --model mine.xml --run-dir runs/mine --no-video",
    "page runs/tuned-mujoco-seed0 -o page.html",
)
TOOLS = ("build", "twine")
MADE = ("runs/tuned-mujoco-seed0/policy.json", "film.gif", "runs/mine/policy.json", "page.html")
LICENCES = """
from importlib.metadata import distributions
for one in distributions():
    data = one.metadata
    said = [line.split(" :: ")[-1] for line in data.get_all("Classifier", ()) if "License ::" in line]
    text = data.get("License-Expression") or ", ".join(said) or data.get("License") or "not said"
    print(data["Name"], text.strip().splitlines()[0][:60], sep="\\t")
"""  # noqa: E501 - run by another Python
CLEAN = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}


class FailedError(Exception):
    """A step of it; the message is the line that is printed."""


def run(*command: object, folder: Path = ROOT) -> str:
    """Return what a command prints.

    Raises:
        FailedError: It ended otherwise than well.
    """
    words = [str(word) for word in command]
    done = subprocess.run(words, cwd=folder, env=CLEAN, capture_output=True, text=True, check=False)
    if done.returncode:
        last = (done.stderr or done.stdout).strip().splitlines()[-1:]
        raise FailedError(f"{' '.join(words)}: exit code {done.returncode}: {' '.join(last)}")
    return done.stdout


def environment(folder: Path, *packages: object) -> Path:
    """Make a fresh environment with these packages, and return its folder of programs."""
    venv.create(folder, with_pip=True)
    programs = folder / ("Scripts" if os.name == "nt" else "bin")
    run(programs / "python", "-m", "pip", "install", "--quiet", *packages)
    return programs


def megabytes(path: Path) -> str:
    """Return how much a file, or all files of a folder, takes."""
    files = [path] if path.is_file() else [one for one in path.rglob("*") if one.is_file()]
    return f"{sum(one.stat().st_size for one in files) / 1e6:.1f} MB"


def tried(archive: Path, place: Path) -> Iterator[tuple[str, str]]:
    """Install an archive, do the jobs, and yield what there is to say of it."""
    programs, empty = environment(place / "venv", archive), place / "empty"
    empty.mkdir()
    for job in JOBS:
        run(programs / "mjcartpole", *job.split(), folder=empty)
    missing = [name for name in MADE if not (empty / name).is_file()]
    if missing:
        raise FailedError(f"{archive.name}: the jobs left no {', '.join(missing)}")
    yield "jobs", f"{len(JOBS)} of {len(JOBS)} in an empty folder"
    yield "installed", megabytes(place / "venv")
    licences = dict(
        line.split("\t") for line in run(programs / "python", "-c", LICENCES).splitlines()
    )
    yield "packages", f"{len(licences)}, with pip"
    kinds = sorted(set(licences.values()), key=str.lower)
    for kind in kinds if archive.suffix == ".whl" else ():
        yield kind, ", ".join(sorted(name for name, its in licences.items() if its == kind))


def check() -> Iterator[tuple[str, str]]:
    """Do all of it, and yield the rows of a table."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    version = project["version"]
    yield "version", version
    noted = f"## [{version}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    yield "changelog", "has it" if noted else f"has no [{version}] yet: a tag would be refused"
    yield "addresses", CLEAN.get("MJCARTPOLE_SOURCE_URL", "none: MJCARTPOLE_SOURCE_URL is not set")
    with tempfile.TemporaryDirectory() as temporary:
        place = Path(temporary)
        tools = environment(place / "tools", *TOOLS)
        run(tools / "python", "-m", "build", "--outdir", place / "dist", ROOT)
        archives = sorted((place / "dist").iterdir())
        run(tools / "python", "-m", "twine", "check", "--strict", *archives)
        yield "metadata", "twine finds nothing wrong"
        for archive in archives:
            yield archive.name, megabytes(archive)
            (place / archive.suffix).mkdir()
            yield from (
                (f"  {name}", said) for name, said in tried(archive, place / archive.suffix)
            )


def main() -> int:
    """Print the table as it grows. Returns the exit code."""
    try:
        for name, said in check():
            print(f"{name:40}  {said}", flush=True)
    except FailedError as error:
        print(f"release-check: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
