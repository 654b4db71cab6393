"""`train` where the disk is full, small or read-only: one line, and what there was stays."""

import re
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from command_line import call
from mjcartpole.learning.checkpoints import LATEST
from nightly import few
from trainings import SHORT, SLOW, assert_equal_runs, names, needs_proc, wait_until


def limit_files(size):
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


@pytest.mark.long
def test_a_full_disk_is_one_line_and_the_last_good_checkpoint_goes_on(
    here, fork, slow_reference, capsys
):
    command = [*SLOW, "--run-dir", "run", "--checkpoint-every", "0"]
    child = fork(command, prepare=limit_files(8_500))
    assert child.wait() == 2
    assert child.err.count("\n") == 1
    assert f"cannot write 'run/{LATEST}': File too large" in child.err
    assert not [name for name in names("run") if name.startswith(".")]
    code, out, err = call(["train", "--no-curve", "--resume", "run"], capsys)
    assert (code, err) == (0, "")
    assert int(re.search(r"goes on after ([\d,]+) of", out)[1].replace(",", "")) > 10
    assert_equal_runs("run", slow_reference)


def test_a_disk_that_is_full_for_the_results_leaves_the_training(here, fork, capsys):
    command = [
        "train",
        "--episodes",
        "3000",
        "--backend",
        "gym",
        "--no-video",
        "--no-curve",
        "--run-dir",
    ]
    child = fork([*command, "run"], prepare=limit_files(50_000))
    assert child.wait() == 2
    assert child.err.count("\n") == 1
    assert "cannot write 'run/episodes.csv'" in child.err
    assert call(["train", "--no-curve", "--resume", "run"], capsys)[0] == 0
    assert call([*command, "reference"], capsys)[0] == 0
    assert_equal_runs("run", "reference")


def test_a_disk_that_is_full_at_once_leaves_nothing(here, fork):
    child = fork([*SHORT, "--run-dir", "run"], prepare=limit_files(3_000))
    assert child.wait() == 2
    assert child.err.count("\n") == 1
    assert "cannot write 'run/model.xml'" in child.err
    assert not Path("run").exists()


@pytest.mark.long
def test_a_disk_that_is_full_for_the_events_is_one_line(here, fork, capsys):
    pytest.importorskip("tensorboardX")
    command = [
        "train",
        "--episodes",
        "1000",
        "--backend",
        "gym",
        "--no-video",
        "--no-curve",
        "--run-dir",
        "run",
    ]
    child = fork([*command, "--tensorboard"], prepare=limit_files(60_000))
    wait_until(lambda: not child.lives(), seconds=20)
    assert child.wait() == 2
    assert child.err.count("\n") == 1
    assert "cannot write" in child.err
    assert call(["train", "--no-curve", "--resume", "run", "--tensorboard"], capsys)[0] == 0


def in_own_mounts(script):
    """Run a shell script where mounts are its own."""
    return subprocess.run(
        ["unshare", "-m", "sh", "-e", "-c", script], capture_output=True, text=True, check=False
    )


@pytest.fixture(scope="module")
def mounts(tmp_path_factory):
    """Skips where this user may not mount."""
    folder = tmp_path_factory.mktemp("mount")
    if not shutil.which("unshare") or in_own_mounts(f"mount -t tmpfs none {folder}").returncode:
        pytest.skip("needs the right to mount a file system")


RESUME, REPLACE = "--resume run", "--no-video --no-curve --overwrite --run-dir run"


@pytest.mark.long
@pytest.mark.usefixtures("mounts")
@pytest.mark.parametrize("flags", few([RESUME, REPLACE], RESUME))
def test_a_read_only_disk_is_one_line(flags, killed):
    read_only = f"mount --bind {killed} {killed}; mount -o remount,ro,bind {killed}"
    process = in_own_mounts(f"{read_only}; {sys.executable} -m mjcartpole train {flags}")
    assert (process.returncode, process.stdout) == (2, "")
    assert process.stderr.count("\n") == 1
    assert "Read-only file system" in process.stderr


@pytest.mark.usefixtures("mounts")
@pytest.mark.slow
def test_a_small_disk_that_fills_up_is_one_line(here, slow_reference, capsys):
    (here / "disk").mkdir()
    script = (
        f"mount -t tmpfs -o size=48k none {here}/disk;"
        f"{sys.executable} -m mjcartpole {' '.join(SLOW)} --checkpoint-every 0 --run-dir disk/run"
        f" || code=$?; cp -r {here}/disk/run {here}/run; exit $code"
    )
    process = in_own_mounts(script)
    assert process.returncode == 2
    assert process.stderr.count("\n") == 1
    assert "No space left on device" in process.stderr
    assert call(["train", "--no-curve", "--resume", "run"], capsys)[0] == 0
    assert_equal_runs("run", slow_reference)


@needs_proc
@pytest.mark.parametrize("seeds", ["1", "2"])
def test_a_folder_that_cannot_be_made_is_one_line(seeds, here, capsys):
    arguments = [
        "train",
        "--no-video",
        "--no-curve",
        "--seeds",
        seeds,
        "--run-dir",
        "/proc/nobody/run",
    ]
    code, out, err = call(arguments, capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "cannot make the folder" in err
