"""Does a study that is killed lose anything? 2,400 trainings, three times, with SIGKILL in between.

    python benchmarks/kills.py

The same study is done by two threads, undisturbed; by two threads whose process is killed three
times and resumed; and on a Dask scheduler with two worker processes on loopback (extra dask), one
of which is killed twice, and then the study's own process, which is resumed. For each is printed
how many runs were kept, how many different ones, the digest, and whether its tables have the bytes
of the first but for times and hosts. It exits with 1 where they have not. On Linux only.
"""

import argparse
import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final

from mjcartpole.studies.study.records import LOG
from mjcartpole.studies.study.tables import CURVES, RUNS, TIMES

FILE: Final = """
[study]
seeds = {seeds}
measure = ["greedy_mean", "area_under_curve"]
[base]
preset = "tuned"
episodes = 100
backend = "gym"
[factors]
alpha = [0.1, 0.3]
td_lambda = ["none", 0.9]
gamma = [0.98, 0.999]
"""
ADDRESS: Final = "tcp://127.0.0.1:18786"

Words = Sequence[str]


def main() -> None:
    """Do the study in each way, and print what came of it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=300, help="for each of 8 points")
    seeds = parser.parse_args().seeds
    with tempfile.TemporaryDirectory() as name:
        file = Path(name, "kills.toml")
        file.write_text(FILE.format(seeds=seeds), encoding="utf-8")
        undisturbed = Study(file, "undisturbed", ["--workers", "2"])
        undisturbed.end()
        killed = Study(file, "killed", ["--workers", "2"])
        for eighth in (2, 4, 6):
            killed.kill_after(eighth * seeds)
        killed.end()
        cluster = Study(file, "cluster", ["--scheduler", ADDRESS])
        with dask(Path(name)) as workers:
            cluster.kill_after(5 * seeds, [(k * seeds, lambda: kill_one(workers)) for k in (1, 3)])
            cluster.end()
        same = [study.told(undisturbed) for study in (undisturbed, killed, cluster)]
    raise SystemExit(0 if all(same) else 1)


class Study:
    """A study in a folder of its own, in processes of its own."""

    def __init__(self, file: Path, name: str, how: Words) -> None:
        self.name, self.folder = name, file.parent / name
        self._command = [sys.executable, "-m", "mjcartpole", "study", str(file), *how]
        self._command += ["--run-dir", str(self.folder)]
        self._digest = ""

    @property
    def log(self) -> list[bytes]:
        """The lines of what is kept."""
        path = self.folder / LOG
        return path.read_bytes().splitlines() if path.exists() else []

    def kill_after(self, runs: int, events: Sequence[tuple[int, Callable[[], None]]] = ()) -> None:
        """Go on until so many runs are kept, then kill it; before that, do what is due."""
        process = self._begin()
        for due, event in [*events, (runs, process.kill)]:
            while len(self.log) < due:
                if process.poll() is not None:
                    raise SystemExit(f"{self.name} has ended by itself")
                time.sleep(0.1)
            event()
            print(f"{self.name}: a SIGKILL after {len(self.log):,} runs", flush=True)
        process.communicate()

    def end(self) -> None:
        """Go on to the end."""
        out, _ = self._begin().communicate()
        self._digest = out.split()[-1]

    def told(self, other: "Study") -> bool:
        """Print what came of it, and return whether it is what came of another."""
        keys = [json.loads(line)["key"] for line in self.log]
        same = self._tables() == other._tables()
        print(
            f"{self.name}: {len(keys):,} runs, {len(set(keys)):,} different ones, digest "
            f"{self._digest}, {'the same' if same else 'OTHER'} tables"
        )
        return same and len(keys) == len(set(keys))

    def _begin(self) -> subprocess.Popen[str]:
        again = ["--resume"] if self.folder.exists() else []
        return subprocess.Popen([*self._command, *again], stdout=subprocess.PIPE, text=True)

    def _tables(self) -> tuple[list[str], bytes]:
        rows = (self.folder / RUNS).read_text(encoding="utf-8").splitlines()
        return [row.rsplit(",", len(TIMES))[0] for row in rows], (self.folder / CURVES).read_bytes()


@contextlib.contextmanager
def dask(folder: Path) -> Iterator[int]:
    """Start a scheduler and two workers, and yield the process number of the workers' parent."""
    commands = [
        ["scheduler", "--host", "127.0.0.1", "--port", ADDRESS.rpartition(":")[2]],
        ["worker", ADDRESS, "--nworkers", "2", "--nthreads", "1"],
    ]
    with (folder / "dask.log").open("w") as log, contextlib.ExitStack() as stack:
        for what, *words in commands:
            process = subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.dask_{what}", *words, "--no-dashboard"],
                stdout=log,
                stderr=log,
            )
            stack.callback(process.wait)
            stack.callback(process.terminate)
        yield process.pid


def kill_one(parent: int) -> None:
    """Kill one of a parent's workers."""
    while not (found := workers_of(parent)):
        time.sleep(0.05)
    os.kill(found[0], signal.SIGKILL)


def workers_of(parent: int) -> list[int]:
    """Return the process numbers of its workers, but for its other children."""
    return [
        int(child)
        for thread in Path(f"/proc/{parent}/task").iterdir()
        for child in (thread / "children").read_text(encoding="utf-8").split()
        if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()
    ]


if __name__ == "__main__":
    main()
