"""Trainings as commands: in this process, and forked from it, to be killed or stopped."""

import os
import signal
import sys
import time
from pathlib import Path

import pytest

from mjcartpole import cli
from mjcartpole.learning import runs

SAME = ("policy.json", "visits.csv", "episodes.csv", "summary.json", "config.json", "model.xml")
"""What is equal, byte for byte, in equal runs."""


SLOW = [
    "train",
    "--backend",
    "gym",
    "--engine",
    "python",
    "--episodes",
    "3000",
    "--no-video",
    "--no-curve",
]
"""Takes Python many seconds, and the compiled engine, which gives the same, a tenth of one."""


SHORT = [
    "train",
    "--engine",
    "python",
    "--episodes",
    "4",
    "--no-video",
    "--no-curve",
    "--checkpoint-every",
    "0",
]


needs_proc = pytest.mark.skipif(not Path("/proc/version").exists(), reason="needs /proc")


class Forked:
    """A command in a child process.

    `prepare` is called in the child before the command.
    """

    def __init__(self, arguments, prepare=lambda: None):
        self.code = None
        self.pid = os.fork()
        if self.pid == 0:
            self._live([str(argument) for argument in arguments], prepare)

    def _live(self, arguments, prepare):
        code = 99
        try:
            with open("child.out", "w") as out, open("child.err", "w") as err:
                os.dup2(out.fileno(), 1)
                os.dup2(err.fileno(), 2)
                sys.stdout, sys.stderr = out, err
                prepare()
                cli.main(arguments)
        except SystemExit as stop:
            code = stop.code
        finally:
            os._exit(code)

    def kill(self, number=signal.SIGKILL):
        os.kill(self.pid, number)

    def wait(self):
        """Exit code, or minus the number of the signal."""
        if self.code is None:
            self.code = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        return self.code

    def lives(self):
        pid, status = (0, 0) if self.code is not None else os.waitpid(self.pid, os.WNOHANG)
        if pid:
            self.code = os.waitstatus_to_exitcode(status)
        return self.code is None

    @property
    def out(self):
        path = Path("child.out")
        return path.read_text() if path.exists() else ""

    @property
    def err(self):
        return Path("child.err").read_text()


def wait_until(condition, process=None, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        assert process is None or process.lives(), process.err
        assert time.monotonic() < end
        time.sleep(0.002)


def contents(folder):
    return {name: (Path(folder) / name).read_bytes() for name in SAME}


def names(folder):
    """Names in a folder, but for the curve, which is there where matplotlib is installed."""
    return sorted({path.name for path in Path(folder).iterdir()} - {runs.CURVE})


def assert_equal_runs(folder, reference):
    assert contents(folder) == contents(reference)
    assert names(folder) == sorted(runs.FILES)


CHANGES = {"os.remove", "os.rename", "os.mkdir", "os.rmdir", "os.link", "os.truncate"}


def dies_at(count):
    """Make this process kill itself before a change of the file system, counted from 1."""
    left, here = count, f"{Path.cwd()}/"

    def mortal(event, arguments):
        nonlocal left
        if event == "open":
            writes = arguments[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
        elif event not in CHANGES:
            return
        else:
            writes = True
        if writes and os.path.abspath(os.fsdecode(arguments[0])).startswith(here):
            left -= 1
            if left == 0:
                os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(mortal)


EACH = pytest.mark.parametrize("stride", [79, pytest.param(1, marks=pytest.mark.slow)])


NINE = ["train", "--backend", "gym", "--episodes", "9", "--no-curve", "--no-video"]


FILM = [*NINE[:-1], "--run-dir"]
