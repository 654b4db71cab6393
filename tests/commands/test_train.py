"""`train` as a person uses it: killed, stopped, short of disk, resumed, with one seed and many.

A killed or stopped training is a real process. Most are forked from this one, which has all
libraries loaded, so that hundreds of kills fit into a few seconds.
"""

import json
import os
import random
import re
import resource
import select
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from mjcartpole import cli
from mjcartpole.learning import runs
from mjcartpole.learning.checkpoints import LATEST
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.run_model import MODEL
from mjcartpole.learning.training import train
from mjcartpole.physics.load import load_model
from nightly import only

SAME = ("policy.json", "episodes.csv", "summary.json", "config.json", "model.xml")
"""What is equal, byte for byte, in equal runs."""

SLOW = ["train", "--backend", "gym", "--engine", "python", "--episodes", "3000", "--no-video"]
"""Takes Python many seconds, and the compiled engine, which gives the same, a tenth of one."""
SHORT = ["train", "--engine", "python", "--episodes", "4", "--no-video", "--checkpoint-every", "0"]

needs_proc = pytest.mark.skipif(not Path("/proc/version").exists(), reason="needs /proc")


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def call(arguments, capsys):
    """Run a command in this process; returns exit code, stdout and stderr."""
    with pytest.raises(SystemExit) as stop:
        cli.main([str(argument) for argument in arguments])
    captured = capsys.readouterr()
    return stop.value.code, captured.out, captured.err


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


@pytest.fixture
def fork():
    """Starts forked commands, and ends those that are left."""
    children = []

    def start(*arguments, **options):
        children.append(Forked(*arguments, **options))
        return children[-1]

    yield start
    for child in children:
        if child.lives():
            child.kill()
            child.wait()


def wait_until(condition, process=None, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        assert process is None or process.lives(), process.err
        assert time.monotonic() < end
        time.sleep(0.002)


def contents(folder):
    return {name: (Path(folder) / name).read_bytes() for name in SAME}


def names(folder):
    return sorted(path.name for path in Path(folder).iterdir())


def assert_equal_runs(folder, reference):
    assert contents(folder) == contents(reference)
    assert names(folder) == sorted(runs.FILES)


@pytest.fixture(scope="module")
def slow_reference(tmp_path_factory):
    """What `SLOW` comes to."""
    folder = tmp_path_factory.mktemp("reference") / "run"
    with pytest.raises(SystemExit) as stop:
        cli.main(["train", *SLOW[1:], "--engine", "compiled", "--run-dir", str(folder)])
    assert stop.value.code == 0
    return folder


# ------------------------------------------------------------------------------------- kills


@pytest.mark.parametrize("seed", map(only(0), range(3)))
def test_a_run_that_is_killed_again_and_again_ends_as_if_it_was_not(
    seed, here, fork, slow_reference, capsys
):
    rng = random.Random(seed)
    command = [*SLOW, "--run-dir", "run"]
    if seed == 2:
        call(["train", "--episodes", "3", "--no-video", "--run-dir", "run"], capsys)
        command.append("--overwrite")
    resume = ["train", "--engine", "python", "--resume", "run", "--no-video"]
    for _ in range(3):
        child = fork([*command, "--checkpoint-every", rng.choice(["0", "0.02", "0.1"])])
        wait_until((here / "run" / LATEST).exists, child)
        time.sleep(rng.uniform(0, 0.2))
        child.kill()
        assert child.wait() == -signal.SIGKILL
        command = resume
    code, out, err = call(["train", "--resume", "run"], capsys)
    assert (code, err) == (0, "")
    assert re.search(r"goes on after [\d,]+ of 3,000 episodes, seed 0", out)
    assert_equal_runs("run", slow_reference)


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

BEGINNINGS = {
    "one": SHORT,
    "many": [*SHORT, "--engine", "compiled", "--seeds", "2", "--workers", "1"],
}


def tree(folder):
    """What lies in a folder: all but the times that trainings took."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in Path(folder).rglob("*")
        if path.name != runs.TIMING
    }


@EACH
@pytest.mark.parametrize("overwrite", [False, pytest.param(True, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", map(only("one"), BEGINNINGS))
def test_a_kill_at_each_change_of_the_file_system(kind, overwrite, stride, here, fork, capsys):
    rng = random.Random(stride)
    assert call([*BEGINNINGS[kind], "--run-dir", "reference"], capsys)[0] == 0
    older = [*BEGINNINGS[kind], "--seed", "1", "--run-dir", "older"]
    assert call(older, capsys)[0] == 0
    again = ["--overwrite"] if overwrite else []
    begin = [*BEGINNINGS[kind], "--run-dir", "run", *again]
    for count in range(1 + stride // 2, 1000, stride):
        shutil.rmtree("run", ignore_errors=True)
        if overwrite:
            shutil.copytree("older", "run")
        child = fork(begin, prepare=lambda count=count: dies_at(count))
        if child.wait() == 0:
            break
        assert child.wait() == -signal.SIGKILL
        for _ in range(2):
            # Killed once more, anywhere, and then left in peace.
            resume = ["train", "--resume", "run", "--checkpoint-every", "0"]
            child = fork(resume, prepare=lambda: dies_at(rng.randrange(1, 60)))
            assert child.wait() in {0, 2, -signal.SIGKILL}
        code, _, err = call(["train", "--resume", "run"], capsys)
        if code:
            assert re.search("holds no training that could be|no run folder", err), count
            code, _, err = call(begin, capsys)
        assert code == 0, (count, err)
        if not (overwrite and tree("run") == tree("older")):  # Killed before it was touched.
            assert tree("run") == tree("reference"), count
    assert count > 50
    assert tree("run") == tree("reference")
    assert names(".") == ["child.err", "child.out", "older", "reference", "run"]


KILLED = [
    ["--episodes", "4000", "--seed", "5"],
    ["--preset", "article-terminal", "--backend", "gym", "--episodes", "400000", "--seed", "2"],
    ["--engine", "python", "--episodes", "700", "--seed", "9", "--ties", "random"],
]


@pytest.mark.slow
@pytest.mark.parametrize("config", KILLED, ids=["mujoco", "gym", "python"])
def test_thirty_runs_killed_at_any_moment_of_their_lives(config, here):
    command = [sys.executable, "-m", "mjcartpole", "train", "--no-video"]
    started = time.monotonic()
    subprocess.run([*command, *config, "--run-dir", "ref"], check=True, capture_output=True)
    lasts, rng = time.monotonic() - started, random.Random(1)
    for number in range(10):
        folder = here / f"run-{number}"
        arguments, kills = [*config, "--run-dir", folder], 0
        while True:
            every = ["--checkpoint-every", rng.choice(["0", "0.05", "0.3"])]
            process = subprocess.Popen(
                [*command, *arguments, *every],
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
            )
            try:
                out, _ = process.communicate(
                    timeout=None if kills == 4 else rng.uniform(0.1, 1.1 * lasts)
                )
            except subprocess.TimeoutExpired:
                process.kill()
                out, _ = process.communicate()
                kills += 1
                arguments = ["--resume", folder]
                continue
            if process.returncode == 0:
                break
            assert re.search("holds no training that could be continued|no run folder", out)
            arguments = [*config, "--run-dir", folder]
        assert_equal_runs(folder, "ref")


# ------------------------------------------------------------------------------- checkpoints


@pytest.fixture
def killed(here, fork):
    """The folder of a run that was killed and has a checkpoint."""
    child = fork([*SLOW, "--run-dir", "run", "--checkpoint-every", "0"])
    wait_until((here / "run" / LATEST).exists, child)
    time.sleep(0.1)
    child.kill()
    child.wait()
    return here / "run"


DAMAGES = {
    "header": lambda content: b"M" + content[1:],
    "digest": lambda content: content[:30] + b"x" + content[31:],
    "archive": lambda content: content[:2000] + bytes([content[2000] ^ 1]) + content[2001:],
    "cut": lambda content: content[:-1],
    "half": lambda content: content[: len(content) // 2],
    "longer": lambda content: content + b"\0",
    "empty": lambda content: b"",
    "noise": lambda content: random.Random(0).randbytes(len(content)),
}


@pytest.mark.parametrize("damage", map(only("cut", "noise", "empty"), DAMAGES))
def test_a_damaged_checkpoint_is_one_line_and_a_copy_of_it_goes_on(
    damage, killed, slow_reference, capsys
):
    latest, copy = killed / LATEST, killed / "copy.bin"
    shutil.copy(latest, copy)
    latest.write_bytes(DAMAGES[damage](latest.read_bytes()))
    before = {path.name: path.read_bytes() for path in killed.iterdir()}
    code, out, err = call(["train", "--resume", killed], capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert f"'{latest}'" in err
    assert "start again with --overwrite" in err
    after = {path.name: path.read_bytes() for path in killed.iterdir()}
    assert after == {name: text for name, text in before.items() if not name.startswith(".")}
    code, _, err = call(["train", "--resume", copy], capsys)
    assert (code, err) == (0, "")
    copy.unlink()
    assert_equal_runs(killed, slow_reference)


@pytest.mark.parametrize("name", [MODEL, runs.CONFIG])
def test_what_lies_beside_a_checkpoint_counts_as_well(name, killed, capsys):
    path = killed / name
    path.write_text(path.read_text().replace("0.98", "0.97").replace('mass="0.1"', 'mass="0.2"'))
    code, out, err = call(["train", "--resume", killed], capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert {MODEL: "another model", runs.CONFIG: "gamma 0.98, not 0.97"}[name] in err
    path.write_text("<")
    code, _, err = call(["train", "--resume", killed], capsys)
    assert (code, err.count("\n")) == (2, 1)


# ------------------------------------------------------------------------------------- locks


def test_one_run_folder_has_one_training_while_it_lives(here, fork, slow_reference, capsys):
    child = fork([*SLOW, "--run-dir", "run", "--checkpoint-every", "0.05"])
    wait_until((here / "run" / LATEST).exists, child)
    for arguments in (
        [*SLOW, "--run-dir", "run", "--overwrite"],
        ["train", "--resume", "run"],
        ["train", "--resume", f"run/{LATEST}"],
    ):
        code, out, err = call(arguments, capsys)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert "is in use by another training" in err
    assert child.lives()
    child.kill()
    child.wait()
    assert call(["train", "--resume", "run"], capsys)[0] == 0
    assert_equal_runs("run", slow_reference)


def test_a_resumed_training_holds_its_folder_too(killed, fork, capsys):
    child = fork(["train", "--engine", "python", "--resume", killed])
    wait_until(lambda: "goes on after" in child.out, child)
    code, _, err = call(["train", "--resume", killed], capsys)
    assert (code, err.count("\n")) == (2, 1)
    assert "is in use by another training" in err


def test_a_folder_of_seeds_has_one_training_while_it_lives(here, fork, capsys):
    seeds = ["train", "--backend", "gym", "--episodes", "400000", "--seeds", "2"]
    child = fork([*seeds, "--preset", "article-terminal", "--run-dir", "many"])
    wait_until((here / "many/seed-1/config.json").exists, child)
    for arguments in (
        [*seeds, "--run-dir", "many", "--overwrite"],
        ["train", "--resume", "many"],
        ["train", "--resume", "many/seed-1"],
    ):
        code, _, err = call(arguments, capsys)
        assert (code, err.count("\n")) == (2, 1)
        assert "is in use by another training" in err
    child.kill()
    child.wait()
    short = ["train", "--backend", "gym", "--episodes", "4", "--seeds", "2", "--run-dir", "many"]
    code, _, err = call([*short, "--overwrite"], capsys)
    assert (code, err) == (0, "")
    assert names("many/seed-0") == sorted(runs.FILES)


# ---------------------------------------------------------------------------- disks and rights


def limit_files(size):
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def test_a_full_disk_is_one_line_and_the_last_good_checkpoint_goes_on(
    here, fork, slow_reference, capsys
):
    command = [*SLOW, "--run-dir", "run", "--checkpoint-every", "0"]
    child = fork(command, prepare=limit_files(8_500))
    assert child.wait() == 2
    assert child.err.count("\n") == 1
    assert f"cannot write 'run/{LATEST}': File too large" in child.err
    assert not [name for name in names("run") if name.startswith(".")]
    code, out, err = call(["train", "--resume", "run"], capsys)
    assert (code, err) == (0, "")
    assert int(re.search(r"goes on after ([\d,]+) of", out)[1].replace(",", "")) > 10
    assert_equal_runs("run", slow_reference)


def test_a_disk_that_is_full_for_the_results_leaves_the_training(here, fork, capsys):
    command = ["train", "--episodes", "3000", "--backend", "gym", "--no-video", "--run-dir"]
    child = fork([*command, "run"], prepare=limit_files(50_000))
    assert child.wait() == 2
    assert child.err.count("\n") == 1
    assert "cannot write 'run/episodes.csv'" in child.err
    assert call(["train", "--resume", "run"], capsys)[0] == 0
    assert call([*command, "reference"], capsys)[0] == 0
    assert_equal_runs("run", "reference")


def test_a_disk_that_is_full_at_once_leaves_nothing(here, fork):
    child = fork([*SHORT, "--run-dir", "run"], prepare=limit_files(3_000))
    assert child.wait() == 2
    assert child.err.count("\n") == 1
    assert "cannot write 'run/model.xml'" in child.err
    assert not Path("run").exists()


def test_a_disk_that_is_full_for_the_events_is_one_line(here, fork, capsys):
    pytest.importorskip("tensorboardX")
    command = ["train", "--episodes", "1000", "--backend", "gym", "--no-video", "--run-dir", "run"]
    child = fork([*command, "--tensorboard"], prepare=limit_files(60_000))
    wait_until(lambda: not child.lives(), seconds=20)
    assert child.wait() == 2
    assert child.err.count("\n") == 1
    assert "cannot write" in child.err
    assert call(["train", "--resume", "run", "--tensorboard"], capsys)[0] == 0


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


@pytest.mark.usefixtures("mounts")
def test_a_read_only_disk_is_one_line(killed):
    train_it = f"{sys.executable} -m mjcartpole train"
    read_only = f"mount --bind {killed} {killed}; mount -o remount,ro,bind {killed};"
    for command in ("--resume run", "--no-video --overwrite --run-dir run"):
        process = in_own_mounts(f"{read_only} {train_it} {command}")
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
    assert call(["train", "--resume", "run"], capsys)[0] == 0
    assert_equal_runs("run", slow_reference)


@needs_proc
@pytest.mark.parametrize("seeds", ["1", "2"])
def test_a_folder_that_cannot_be_made_is_one_line(seeds, here, capsys):
    arguments = ["train", "--no-video", "--seeds", seeds, "--run-dir", "/proc/nobody/run"]
    code, out, err = call(arguments, capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "cannot make the folder" in err


# ----------------------------------------------------------------------------------- signals


@pytest.mark.parametrize("engine", map(only("compiled"), ["compiled", "python"]))
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)], ids=["INT", "TERM"]
)
def test_a_stopped_run_keeps_what_it_learned_and_says_how_to_go_on(
    engine, number, code, here, fork, slow_reference, capsys
):
    command, reference = SLOW, slow_reference
    if engine == "compiled":
        config = ["--preset", "article-terminal", "--backend", "gym", "--episodes", "20000"]
        command, reference = ["train", *config, "--no-video"], "reference"
        assert call([*command, "--run-dir", reference], capsys)[0] == 0
    child = fork([*command, "--run-dir", "run", "--checkpoint-every", "0"])
    wait_until((here / "run" / LATEST).exists, child)
    child.kill(number)
    assert child.wait() == code
    assert child.err.count("\n") == 1
    resume = re.search(r"go on with: mjcartpole (.*)$", child.err.strip())[1]
    summary = json.loads(Path("run/summary.json").read_text())
    done = int(re.search(r"interrupted after ([\d,]+) of", child.err)[1].replace(",", ""))
    assert (summary["interrupted"], summary["episodes"]) == (True, done)
    assert len(Path("run/episodes.csv").read_text().splitlines()) == done + 1
    assert call(["evaluate", "run", "--episodes", "1"], capsys)[0] == 0
    before = {name: Path("run", name).read_bytes() for name in SAME}
    code, _, err = call([*command, "--run-dir", "run"], capsys)
    assert code == 2
    assert "go on with --resume run" in err
    assert before == contents("run")
    assert call(resume.split(), capsys)[0] == 0
    assert_equal_runs("run", reference)


def test_a_second_ctrl_c_ends_at_once_and_nothing_is_broken(here, fork, slow_reference, capsys):
    child = fork([*SLOW, "--run-dir", "run", "--checkpoint-every", "0"])
    wait_until((here / "run" / LATEST).exists, child)
    child.kill(signal.SIGINT)
    child.kill(signal.SIGINT)
    time.sleep(0.001)
    if child.lives():
        child.kill(signal.SIGINT)
    assert child.wait() == 130
    assert child.err.count("\n") == 1
    assert not [name for name in names("run") if name.startswith(".")]
    assert call(["train", "--resume", "run"], capsys)[0] == 0
    assert_equal_runs("run", slow_reference)


def test_a_signal_while_evaluating_leaves_a_run_that_goes_on(here, fork, capsys):
    command = ["train", "--engine", "python", "--episodes", "200", "--no-video"]
    child = fork([*command, "--run-dir", "run"])
    wait_until((here / "run" / "summary.json").exists, child)
    child.kill(signal.SIGTERM)
    assert child.wait() == 143
    assert "interrupted after 200 of 200 episodes" in child.err
    assert "train --resume run" in child.err
    assert call(["train", "--resume", "run"], capsys)[0] == 0
    assert call([*command, "--run-dir", "reference", "--engine", "compiled"], capsys)[0] == 0
    assert_equal_runs("run", "reference")


@pytest.mark.slow
def test_a_signal_while_filming_leaves_a_run_that_goes_on(here, fork, capsys):
    child = fork(["train", "--episodes", "600", "--backend", "gym", "--run-dir", "run"])
    wait_until(lambda: "run    run" in child.out, child)
    child.kill(signal.SIGINT)
    assert child.wait() == 130
    assert child.err.count("\n") == 1
    assert not list(here.glob("videos/*"))
    code, out, _ = call(["train", "--resume", "run"], capsys)
    assert code == 0
    assert "video  videos/run.mp4" in out
    assert json.loads(Path("run/summary.json").read_text())["video"] == "videos/run.mp4"
    assert names("run") == sorted(runs.FILES)


def test_a_signal_before_anything_was_learned_leaves_nothing(here, fork):
    child = fork(["train", "--episodes", "2", "--no-video", "--run-dir", "run"], prepare=_stops)
    assert child.wait() == 130
    assert child.err == "mjcartpole: interrupted\n"
    assert not Path("run").exists()


def _stops():
    """Send Ctrl-C as soon as the run is announced."""
    begin_run = runs.begin_run

    def begun(*arguments, **options):
        begin_run(*arguments, **options)
        os.kill(os.getpid(), signal.SIGINT)

    runs.begin_run = begun


# ------------------------------------------------------------------------------------ resume


@pytest.mark.parametrize(
    ("flags", "named"),
    [
        (["--seed", "4"], ["--seed"]),
        (["--episodes", "9", "--gamma", "0.5"], ["--episodes", "--gamma"]),
        (["--bins", "1", "1", "2", "3"], ["--bins"]),
        (["--td-lambda", "None"], ["--td-lambda"]),
        (["--no-learn-last-step"], ["--learn-last-step"]),
        (["--preset", "article"], ["--preset"]),
        (["--backend", "gym"], ["--backend"]),
        (["--model", "cartpole.xml"], ["--model"]),
        (["--run-dir", "other"], ["--run-dir"]),
        (["--overwrite"], ["--overwrite"]),
        (["--seeds", "3"], ["--seeds"]),
        (["--seeds", "3", "--overwrite", "--alpha", "0.2"], ["--alpha", "--overwrite", "--seeds"]),
        (["--workers", "2"], ["--workers"]),
    ],
    ids=" ".join,
)
def test_flags_that_a_resumed_run_would_ignore_are_refused(flags, named, killed, capsys):
    code, out, err = call(["train", "--resume", killed, *flags], capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert all(flag in err for flag in named)
    assert (killed / LATEST).exists()


def test_a_complete_run_says_so(here, capsys):
    assert call([*SHORT, "--run-dir", "run"], capsys)[0] == 0
    before = contents("run")
    code, out, err = call(["train", "--resume", "run"], capsys)
    assert (code, out, err) == (0, "run is complete: nothing is left to do\n", "")
    assert contents("run") == before


def test_what_cannot_be_resumed(here, capsys):
    (here / "empty").mkdir()
    (here / "other").mkdir()
    (here / "other/notes.txt").write_text("notes")
    for path, message in (
        ("nowhere", "no run folder or checkpoint 'nowhere'"),
        ("empty", "'empty' holds no training that could be continued"),
        ("other", "'other' holds no training that could be continued"),
        ("other/notes.txt", "'other' holds no training that could be continued"),
    ):
        code, out, err = call(["train", "--resume", path], capsys)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert message in err
    assert sorted(path.name for path in here.rglob("*")) == ["empty", "notes.txt", "other"]


def test_files_of_a_run_that_are_no_checkpoints(killed, capsys):
    (killed / "policy.json").write_text((killed / "config.json").read_text())
    for name in ("policy.json", "config.json", "model.xml"):
        code, out, err = call(["train", "--resume", killed / name], capsys)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert f"{name}' is no checkpoint" in err
    assert (killed / LATEST).exists()


@pytest.mark.parametrize("every", ["-1", "nan", "often"])
def test_an_interval_that_makes_no_sense_is_refused(every, here, capsys):
    code, out, err = call(["train", "--checkpoint-every", every, "--run-dir", "run"], capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert not Path("run").exists()


# -------------------------------------------------------------------------- folders in the way


def test_a_folder_with_a_model_and_other_work_is_never_taken(here, capsys):
    (here / "mine").mkdir()
    (here / "mine/model.xml").write_text("my own model")
    (here / "mine/thesis.tex").write_text("years of work")
    for more in ([], ["--overwrite"], ["--seeds", "2"], ["--seeds", "2", "--overwrite"]):
        code, _, err = call([*SHORT, "--run-dir", "mine", *more], capsys)
        assert (code, err.count("\n")) == (2, 1)
        assert names("mine") == ["model.xml", "thesis.tex"]
        assert Path("mine/model.xml").read_text() == "my own model"


def test_a_model_of_ones_own_is_never_replaced(here, capsys):
    (here / "mine").mkdir()
    (here / "mine/model.xml").write_text("my own model")
    for more in ([], ["--seeds", "2"]):
        assert call([*SHORT, "--run-dir", "mine", *more], capsys)[0] == 2
        assert Path("mine/model.xml").read_text() == "my own model"


def test_one_seed_and_many_do_not_share_a_folder(here, capsys):
    assert call([*SHORT, "--run-dir", "one"], capsys)[0] == 0
    assert (
        call([*SHORT, "--seeds", "2", "--engine", "compiled", "--run-dir", "many"], capsys)[0] == 0
    )
    before = {path: path.read_bytes() for path in here.rglob("*") if path.is_file()}
    for more in ([], ["--overwrite"]):
        for arguments in (["--run-dir", "many"], ["--run-dir", "one", "--seeds", "2"]):
            code, _, err = call([*SHORT, *arguments, *more], capsys)
            assert (code, err.count("\n")) == (2, 1)
    assert {path: path.read_bytes() for path in here.rglob("*") if path.is_file()} == before


# -------------------------------------------------------------------------------------- seeds

FEW = ["train", "--episodes", "12", "--seed", "3"]


@pytest.fixture
def alone(here, capsys):
    """Each of three seeds, trained alone."""
    for seed in ("3", "4", "5"):
        arguments = ["train", "--episodes", "12", "--seed", seed, "--no-video"]
        assert call([*arguments, "--run-dir", f"alone-{seed}"], capsys)[0] == 0
    return here


def assert_equal_seeds(folder):
    for seed in (3, 4, 5):
        assert_equal_runs(f"{folder}/seed-{seed}", f"alone-{seed}")
    assert [name for name in names(folder) if name != "versions.json"] == [
        "aggregate.json",
        "model.xml",
        "seed-3",
        "seed-4",
        "seed-5",
        "seeds.csv",
        "seeds.json",
    ]


def test_each_seed_is_as_if_it_was_trained_alone(alone, capsys):
    code, out, err = call([*FEW, "--seeds", "3", "--workers", "2"], capsys)
    assert (code, err) == (0, "")
    folder = re.search(r"^runs   (\S+)$", out, re.M)[1]
    assert folder == "runs/tuned-mujoco-episodes12-seeds3-5"
    assert_equal_seeds(folder)
    summaries = [json.loads(Path(f"alone-{seed}/summary.json").read_text()) for seed in (3, 4, 5)]
    means = [summary["evaluation"]["mean"] for summary in summaries]
    for seed, summary in zip((3, 4, 5), summaries, strict=True):
        mean, minimum = summary["evaluation"]["mean"], summary["evaluation"]["minimum"]
        assert re.search(rf"^ +{seed} +{mean:.2f} +{minimum:.0f}$", out, re.M)
    rows = Path(folder, "seeds.csv").read_text().splitlines()
    assert rows[0] == "seed,mean,minimum,failed"
    assert [float(row.split(",")[1]) for row in rows[1:]] == means
    assert [row.split(",")[3] for row in rows[1:]] == ["no"] * 3
    figures = json.loads(Path(folder, "aggregate.json").read_text())
    assert (figures["seeds"], figures["failed"]) == (3, {})
    assert figures["greedy_return"]["mean"] == pytest.approx(sum(means) / 3)
    assert figures["greedy_return"]["minimum"] == min(means)
    assert f"mean {sum(means) / 3:.2f}, minimum {min(means):.2f}" in out


def test_the_python_engine_in_processes_gives_the_same(alone):
    command = [sys.executable, "-m", "mjcartpole", *FEW, "--seeds", "3", "--workers", "2"]
    process = subprocess.run(
        [*command, "--engine", "python", "--run-dir", "many"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (process.returncode, process.stderr) == (0, "")
    assert_equal_seeds("many")


@EACH
def test_seeds_that_are_killed_at_changes_of_the_file_system(stride, alone, fork, capsys):
    rng = random.Random(stride)
    begin = [*FEW, "--seeds", "3", "--workers", "1", "--checkpoint-every", "0", "--run-dir", "many"]
    for count in (*range(1, 12, stride), *(rng.randrange(12, 110) for _ in range(18 // stride))):
        shutil.rmtree("many", ignore_errors=True)
        child = fork(begin, prepare=lambda count=count: dies_at(count))
        assert child.wait() in {0, -signal.SIGKILL}
        code, _, err = call(["train", "--resume", "many"], capsys)
        if code:
            assert re.search("holds no training that could be continued|no run folder", err)
            code, _, err = call(begin, capsys)
        assert (code, err) == (0, ""), count
        assert_equal_seeds("many")


def test_seeds_that_are_stopped_go_on(here, fork, capsys):
    config = ["--preset", "article-terminal", "--backend", "gym", "--episodes", "20000"]
    child = fork(["train", *config, "--seeds", "2", "--run-dir", "many"])
    wait_until((here / "many/seed-1/config.json").exists, child)
    child.kill(signal.SIGINT)
    assert child.wait() == 130
    assert child.err.count("\n") == 1
    assert "go on with: mjcartpole train --resume many" in child.err
    assert "stopped" in child.out
    code, out, err = call(["train", "--resume", "many", "--workers", "2"], capsys)
    assert (code, err) == (0, "")
    assert "stopped" not in out
    for seed in ("0", "1"):
        alone = ["train", *config, "--seed", seed, "--no-video", "--run-dir", f"alone-{seed}"]
        assert call(alone, capsys)[0] == 0
        assert_equal_runs(f"many/seed-{seed}", f"alone-{seed}")
    code, out, _ = call(["train", "--resume", "many"], capsys)
    assert code == 0


def processes_here():
    """Ids of other processes whose working folder is this one."""
    found = set()
    for path in Path("/proc").glob("[0-9]*"):
        try:
            if (path / "cwd").readlink() == Path.cwd() and int(path.name) != os.getpid():
                found.add(int(path.name))
        except OSError:
            continue
    return found


@needs_proc
@pytest.mark.parametrize("number", map(only(signal.SIGKILL), [signal.SIGKILL, signal.SIGTERM]))
def test_the_workers_of_a_training_that_is_gone_go_as_well(number, here, capsys):
    command = ["train", "--engine", "python", "--episodes", "100000", "--seeds", "2"]
    process = subprocess.Popen(
        [sys.executable, "-m", "mjcartpole", *command, "--run-dir", "many"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        wait_until(lambda: all((here / f"many/seed-{n}/config.json").exists() for n in (0, 1)))
        workers = processes_here() - {process.pid}
        assert len(workers) >= 2
        process.send_signal(number)
        assert process.wait(timeout=60) == {signal.SIGKILL: -9, signal.SIGTERM: 143}[number]
        wait_until(lambda: not processes_here(), seconds=20)
    finally:
        for pid in processes_here():
            os.kill(pid, signal.SIGKILL)


@pytest.fixture
def wild(here):
    """A model whose pushes to the right diverge; some seeds never push there."""
    text = load_model().xml.replace('ctrlrange="-1 1"', 'ctrlrange="-1 9e9"')
    (here / "wild.xml").write_text(text)
    greedy = ["--epsilon", "0", "--epsilon-final", "0", "--q-init-low", "0", "--q-init-high", "1"]
    return ["train", "--model", "wild.xml", "--bins", *"1111", "--episodes", "8", *greedy]


def test_a_failing_seed_does_not_take_the_others_down(wild, capsys):
    arguments = [*wild, "--seed", "3", "--seeds", "3", "--run-dir", "many"]
    code, out, err = call(arguments, capsys)
    assert code == 2
    assert err.startswith("mjcartpole: no policy can balance this: ")
    assert err.count("\n") == 3
    for seed in (3, 4):
        assert re.search(rf"seed {seed} failed: episode \d+, step \d+: .*wild.xml diverged", err)
        assert re.search(rf"^ +{seed} +failed$", out, re.M)
    assert call([*wild, "--seed", "5", "--no-video", "--run-dir", "alone"], capsys)[0] == 0
    assert_equal_runs("many/seed-5", "alone")
    rows = Path("many/seeds.csv").read_text().splitlines()
    assert [row.split(",")[3] for row in rows[1:]] == ["yes", "yes", "no"]
    assert rows[1] == "3,,,yes"
    figures = json.loads(Path("many/aggregate.json").read_text())
    assert sorted(figures["failed"]) == ["3", "4"]
    assert figures["greedy_return"]["count"] == 1


def test_a_seed_that_is_blocked_is_named_and_goes_on_once_it_is_free(alone, capsys):
    assert call([*FEW, "--seeds", "3", "--run-dir", "many"], capsys)[0] == 0
    shutil.rmtree("many/seed-4")
    Path("many/seed-4").write_text("a file in the way")
    shutil.rmtree("many/seed-5")
    code, _, err = call(["train", "--resume", "many"], capsys)
    assert (code, err.count("\n")) == (2, 1)
    assert "seed 4 failed" in err
    assert_equal_runs("many/seed-5", "alone-5")
    Path("many/seed-4").unlink()
    code, _, err = call(["train", "--resume", "many"], capsys)
    assert (code, err) == (0, "")
    assert_equal_seeds("many")


@pytest.mark.parametrize(
    "events", [[], pytest.param(["--tensorboard"], marks=pytest.mark.slow)], ids=["plain", "events"]
)
def test_many_seeds_are_only_overwritten_on_request(events, alone, capsys):
    old = ["train", "--episodes", "5", "--seeds", "4", "--run-dir", "many", *events]
    assert call(old, capsys)[0] == 0
    before = {path: path.read_bytes() for path in Path("many").rglob("*") if path.is_file()}
    new = [*FEW, "--seeds", "3", "--run-dir", "many"]
    code, _, err = call(new, capsys)
    assert (code, err.count("\n")) == (2, 1)
    assert "--overwrite" in err
    assert "--resume many" in err
    assert {path: path.read_bytes() for path in Path("many").rglob("*") if path.is_file()} == before
    code, _, err = call([*new, "--overwrite"], capsys)
    assert (code, err) == (0, "")
    assert_equal_seeds("many")


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (["--seeds", "0"], "seeds must be a number from 1"),
        (["--seeds", "-2"], "seeds must be a number from 1"),
        (["--seeds", "1000001"], "seeds must be a number from 1"),
        (["--seeds", "2.5"], "2.5"),
        (["--seeds", "2", "--workers", "0"], "workers must be a number from 1"),
        (["--seeds", "2", "--workers", "-1"], "workers must be a number from 1"),
        (["--workers", "2"], "--workers is for several --seeds"),
        (["--seeds", "2", "--engine", "fast"], "fast"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_seeds_and_workers_that_make_no_sense(flags, message, here, capsys):
    code, out, err = call(["train", "--run-dir", "many", *flags], capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err
    assert not Path("many").exists()


# -------------------------------------------------------------------------------- TensorBoard


def test_events_are_replaced_with_the_run_they_belong_to(here, capsys):
    pytest.importorskip("tensorboardX")
    assert call([*SHORT, "--tensorboard", "--run-dir", "run"], capsys)[0] == 0
    assert len(list(here.glob("run/events.out.tfevents.*"))) == 1
    assert call([*SHORT, "--overwrite", "--run-dir", "run"], capsys)[0] == 0
    assert names("run") == sorted(runs.FILES)


def test_without_tensorboardx_nothing_is_begun(here, fork):
    child = fork(
        [*SHORT, "--tensorboard", "--run-dir", "run"],
        prepare=lambda: sys.modules.update(tensorboardX=None),
    )
    assert child.wait() == 2
    assert child.err.count("\n") == 1
    assert "pip install 'mjcartpole[tensorboard]'" in child.err
    assert (child.out, Path("run").exists()) == ("", False)


# -------------------------------------------------------------------------------------- words


def test_what_training_prints(here, capsys):
    code, out, err = call(["train", "--episodes", "25", "--log-every", "10", "--no-video"], capsys)
    assert (code, err) == (0, "")
    assert re.search(r"^tuned on mujoco: 25 episodes, seed 0$", out, re.M)
    returns = train(TrainConfig(episodes=25)).returns
    for end, block in ((10, returns[:10]), (20, returns[10:20]), (25, returns[20:])):
        assert re.search(rf"^\s+{end}\s+{block.mean():.1f}$", out, re.M)
    assert "run    runs/tuned-mujoco-episodes25-log_every10-seed0" in out
    assert (here / "runs" / "tuned-mujoco-episodes25-log_every10-seed0" / "summary.json").is_file()
    assert not (here / "videos").exists()


NINE = ["train", "--backend", "gym", "--episodes", "9", "--no-video"]


def test_a_second_training_says_where_it_goes(here, capsys):
    first = Path("runs/tuned-gym-episodes9-seed0")
    assert "is there already" not in call(NINE, capsys)[1]
    code, out, _ = call(NINE, capsys)
    assert code == 0
    assert out.splitlines()[1] == f"{first} is there already: this goes to {first}-2"
    assert f"run    {first}-2" in out
    assert contents(first) == contents(f"{first}-2")
    code, out, _ = call([*NINE, "--overwrite"], capsys)
    assert (code, "is there already" in out) == (0, False)
    assert names("runs") == [first.name, f"{first.name}-2"]


def test_a_complete_run_names_the_unfinished_one_beside_it(here, capsys):
    first = Path("runs/tuned-gym-episodes9-seed0")
    for _ in range(2):
        call(NINE, capsys)
    Path(f"{first}-2/summary.json").unlink()
    hint = f"; unfinished beside it: mjcartpole train --resume {first}-2"
    code, out, _ = call(["train", "--resume", first], capsys)
    assert (code, out) == (0, f"{first} is complete: nothing is left to do{hint}\n")
    assert f"this goes to {first}-3{hint}\n" in call(NINE, capsys)[1]


def test_a_hint_names_the_folder_as_a_shell_takes_it(here, fork, capsys):
    child = fork([*SLOW, "--run-dir", "my run", "--checkpoint-every", "0"])
    wait_until((here / "my run" / LATEST).exists, child)
    child.kill(signal.SIGINT)
    assert child.wait() == 130
    hint = shlex.split(re.search(r"go on with: mjcartpole (.*)$", child.err.strip())[1])
    assert hint == ["train", "--resume", "my run"]
    assert call(hint, capsys)[0] == 0


def test_a_header_says_what_was_changed(here, capsys):
    flags = ["--set", "pole.length=1.5,pole.mass=0.2", "--bins", "1,3,6,9", "--model", "cartpole"]
    out = call([*SHORT, *flags], capsys)[1]
    assert out.splitlines()[0] == (
        "tuned on mujoco: 4 episodes, seed 0, "
        "with --set pole.length=1.5 pole.mass=0.2 --bins 1,3,6,9"
    )
    assert "run    runs/tuned-mujoco-pole.length1.5-pole.mass0.2-episodes4-bins1_3_6_9-seed0" in out
    assert (
        "2 at once, with --alpha 0.5"
        in call([*NINE, "--seeds", "2", "--workers", "2", "--alpha", "0.5"], capsys)[1]
    )


def test_equal_trainings_print_the_same(here, capsys):
    outs = [call([*NINE, "--run-dir", f"{n}/run"], capsys)[1].replace(f"{n}/", "") for n in "ab"]
    assert outs[0] == outs[1]
    assert "per second" not in outs[0]


FILM = [*NINE[:-1], "--run-dir"]


def test_a_film_of_another_run_stays(here, capsys):
    Path("videos").mkdir()
    for name, film in (("a/run", "run"), ("b/run", "run-2"), ("c/run", "run-3")):
        assert f"video  videos/{film}.mp4" in call([*FILM, name], capsys)[1]
        assert json.loads(Path(name, "summary.json").read_text())["video"] == f"videos/{film}.mp4"
    before = {path: path.read_bytes() for path in Path("videos").iterdir()}
    out = call([*FILM, "b/run", "--overwrite", "--alpha", "0.7"], capsys)[1]
    assert "video  videos/run-2.mp4" in out
    after = {path: path.read_bytes() for path in Path("videos").iterdir()}
    changed = [path.name for path in before if before[path] != after[path]]
    assert (changed, before.keys()) == (["run-2.mp4"], after.keys())


@pytest.mark.parametrize("film", ["thesis.mp4", "videos/other.mp4", "../videos/run.mp4"])
def test_only_a_film_of_its_own_goes_with_a_run(film, here, capsys):
    (here / "work/videos").mkdir(parents=True)
    os.chdir("work")
    assert call([*NINE, "--run-dir", "run"], capsys)[0] == 0
    Path(film).parent.mkdir(exist_ok=True)
    Path(film).write_text("years of work")
    summary = json.loads(Path("run/summary.json").read_text())
    Path("run/summary.json").write_text(json.dumps({**summary, "video": film}))
    assert call([*NINE, "--run-dir", "run", "--overwrite"], capsys)[0] == 0
    assert Path(film).read_text() == "years of work"


@pytest.mark.slow
def test_a_film_that_a_kill_cut_short_keeps_its_name(here, fork, capsys):
    Path("videos").mkdir()
    Path("videos/run.mp4").write_text("another's")
    child = fork([*FILM, "run"], prepare=_dies_when_it_has_filmed)
    assert child.wait() == -signal.SIGKILL
    assert call(["train", "--resume", "run"], capsys)[0] == 0
    assert names("videos") == ["run-2.mp4", "run.mp4"]
    assert call([*FILM, "other/run", "--no-video"], capsys)[0] == 0
    summaries = [
        json.loads(Path(name, "summary.json").read_text()) for name in ("run", "other/run")
    ]
    assert list(summaries[0].items()) == [*summaries[1].items(), ("video", "videos/run-2.mp4")]


def _dies_when_it_has_filmed():
    runs.finish_run = lambda folder: os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="needs a terminal that a program can read")
def test_a_terminal_is_told_of_compiling_and_of_the_speed_without_it(here):
    import pty

    reader, writer = pty.openpty()
    cache = {"NUMBA_CACHE_DIR": str(here / "cache"), "TERM": "xterm", "COLUMNS": "120"}
    command = [sys.executable, "-m", "mjcartpole", *FILM, "run", "--no-video"]
    process = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=writer, env={**os.environ, **cache}
    )
    shown = b""
    while process.poll() is None or select.select([reader], [], [], 0.5)[0]:
        if select.select([reader], [], [], 0.1)[0]:
            shown += os.read(reader, 4096)
    os.close(writer)
    os.close(reader)
    assert b"compiling \x1b" in shown
    # Nine episodes take less than a millisecond, and to compile takes seconds.
    assert re.search(rb"[\d,]+ steps in 0\.0 s \([\d,]+ per second\)\r\n$", shown)
    assert json.loads(Path("run/timing.json").read_text())["training_seconds"] < 0.5


def test_a_training_that_is_refused_leaves_nothing(here, capsys):
    assert call([*NINE, "--run-dir", "run"], capsys)[0] == 0
    code, out, err = call([*FILM, "run"], capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert names(".") == ["run"]
    os.chdir("run")
    assert call(["train", "--resume", "."], capsys)[1] == ". is complete: nothing is left to do\n"


def test_an_unwritable_videos_folder_is_noticed_before_training(here, capsys):
    (here / "videos").write_text("a file in the way")
    code, out, err = call(["train"], capsys)
    assert (code, out) == (2, "")
    assert "videos" in err
    assert not list(here.glob("runs/*/*"))
