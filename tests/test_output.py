"""Output that degrades and never fails: real processes, with all that can happen to a stream."""

import io
import json
import os
import subprocess
import sys

import pytest

from mjcartpole import output
from mjcartpole.physics.load import load_model
from nightly import at_night, few

TRAIN = "train --episodes 20 --no-video --no-curve --run-dir run"
FULL = "error: stdout could not be written (No space left on device)"
on_unix = pytest.mark.skipif(os.name == "nt", reason="needs a POSIX shell")
needs_full = pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")


def shell(line, here, **environment):
    """Run a line of bash in which MJ is the command; returns its last exit code, stdout, stderr."""
    line = f'MJ() {{ "{sys.executable}" -m mjcartpole "$@"; }}\n{line}'
    done = subprocess.run(
        ["bash", "-c", line],
        cwd=here,
        env={**os.environ, **environment},
        capture_output=True,
        timeout=120,
        check=False,
    )
    return done.returncode, done.stdout.decode("latin-1"), done.stderr.decode("latin-1")


def assert_complete(run):
    assert json.loads((run / "summary.json").read_text())["interrupted"] is False
    assert not list(run.glob("checkpoint*"))


@pytest.mark.long
@on_unix
@pytest.mark.parametrize(
    "where",
    [
        "| head -1",
        *(
            pytest.param(where, marks=pytest.mark.slow)
            for where in ("<&- >&- 2>&-", "| true", ">&-", "2>&-", "2>&1 | true")
        ),
    ],
)
def test_a_training_goes_on_when_nobody_listens(where, tmp_path):
    code, _, err = shell(f"MJ {TRAIN} {where}; exit ${{PIPESTATUS[0]}}", tmp_path)
    assert code == 0
    assert [line for line in err.splitlines() if "compiling" not in line] == []
    assert_complete(tmp_path / "run")


@pytest.mark.slow
@on_unix
@needs_full
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_full_disk_under_stdout_is_one_line_and_the_run_is_complete(unbuffered, tmp_path):
    code, _, err = shell(f"MJ {TRAIN} > /dev/full", tmp_path, PYTHONUNBUFFERED=unbuffered)
    assert (code, err.count(FULL), "Traceback" in err) == (2, 1, False)
    assert_complete(tmp_path / "run")
    assert shell(f"MJ {TRAIN} --overwrite > /dev/full 2>&1", tmp_path)[0] == 2
    assert_complete(tmp_path / "run")


@on_unix
@pytest.mark.parametrize(
    "command",
    [
        "--version",
        *(pytest.param(c, marks=pytest.mark.slow) for c in ("--help", "model show moon")),
    ],
)
def test_other_commands_end_without_noise_as_well(command, tmp_path):
    places = ("| true", ">&-", ">&- 2>&-")
    for where in places[: at_night(3, fast=1)]:
        code, _, err = shell(f"MJ {command} {where}; exit ${{PIPESTATUS[0]}}", tmp_path)
        assert (code, err) == (0, "")
    if os.path.exists("/dev/full"):
        code, _, err = shell(f"MJ {command} > /dev/full", tmp_path)
        assert (code, err.count(FULL), err.count("\n")) == (2, 1, 1)


@pytest.mark.slow
@on_unix
def test_nothing_is_written_into_a_file_that_takes_a_closed_streams_place(tmp_path):
    shell(f"MJ {TRAIN} <&- >&- 2>&-", tmp_path)
    shell(f"MJ {TRAIN.replace('run-dir run', 'run-dir other')}", tmp_path)
    for name in ("policy.json", "episodes.csv", "model.xml"):
        assert (tmp_path / "run" / name).read_bytes() == (tmp_path / "other" / name).read_bytes()


@pytest.mark.slow
@on_unix
def test_a_watch_whose_reader_has_left_ends(tmp_path):
    (tmp_path / "mine.xml").write_text(load_model().xml)
    code, out, err = shell(
        "MJ watch mine.xml --episodes 20 --no-video | head -1; exit ${PIPESTATUS[0]}", tmp_path
    )
    assert (code, out.count("\n"), err) == (0, 1, "")


@pytest.mark.long
@on_unix
@pytest.mark.parametrize("encoding", ["ascii", pytest.param("cp1252", marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "command",
    few(["--help", "doctor", "parity --quick --rungs 5"], "--help"),
)
def test_an_encoding_without_our_signs_is_enough(command, encoding, tmp_path):
    code, out, err = shell(f"MJ {command}", tmp_path, PYTHONIOENCODING=encoding)
    assert (code, err) == (0, "")
    out.encode("latin-1").decode(encoding)


@on_unix
@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "utf-8"])
def test_names_that_no_encoding_has_do_not_matter(encoding, tmp_path):
    name = "né\udcff→"
    try:
        (tmp_path / name).mkdir()
    except (OSError, UnicodeError):
        pytest.skip("this file system takes text only")
    shown = {"ascii": r"n\xe9\xff->", "cp1252": "n\xe9\\xff->", "utf-8": "né\\xff→"}[encoding]
    shown = shown.encode(encoding).decode("latin-1")
    copy = f"{name}/copy.xml"
    for command in (
        f"model edit cartpole --set pole.length=1 -o '{copy}'",
        f"model show '{copy}'",
        f"train --episodes 5 --no-video --no-curve --model '{copy}' --run-dir '{name}/run'",
        f"render '{name}/run' --size 64x48 -o '{name}/film.gif'",
        f"transfer '{name}/run' --models '{copy}' --episodes 1 --workers 1 -o '{name}'",
    ):
        code, out, err = shell(f"MJ {command}", tmp_path, PYTHONIOENCODING=encoding)
        assert (code, "Traceback" in err) == (0, False), command
    assert f"written {shown}" in out
    code, _, err = shell(f"MJ evaluate '{name}-'", tmp_path, PYTHONIOENCODING=encoding)
    assert code == 2
    assert f"'{shown}-'" in err


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "utf-8"])
def test_what_an_encoding_lacks_is_spelled(encoding, monkeypatch):
    taken = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(taken, encoding=encoding))
    with output.patient_output():
        sys.stdout.write("a → b ≤ c \N{MULTIPLICATION SIGN} d …  café 2² \udcfe\n")
    spelled = {
        "ascii": "a -> b <= c x d ...  caf\\xe9 2^2 \\xfe",
        "cp1252": "a -> b <= c \N{MULTIPLICATION SIGN} d …  café 2² \\xfe",
        "utf-8": "a → b ≤ c \N{MULTIPLICATION SIGN} d …  café 2² \\xfe",
    }
    assert taken.getvalue().decode(encoding).rstrip() == spelled[encoding]


class Full(io.RawIOBase):
    """Takes some bytes, sometimes none, and then has no room."""

    def __init__(self, room):
        super().__init__()
        self.room, self.taken, self.calls = room, b"", 0

    def writable(self):
        return True

    def write(self, data):
        self.calls += 1
        if self.calls % 2:
            return None
        if not self.room:
            raise OSError(28, "No space left on device")
        part = bytes(data[: min(self.room, 5)])
        self.room -= len(part)
        self.taken += part
        return len(part)


def test_a_stream_is_written_as_far_as_it_goes_and_its_problem_is_known(monkeypatch):
    full = Full(12)
    before = io.TextIOWrapper(full, encoding="utf-8", write_through=True)
    monkeypatch.setattr(sys, "stdout", before)
    with output.patient_output():
        sys.stdout.write("twelve\n")
        assert output.stdout_problem() is None
        sys.stdout.write("letters, and more\n")
        assert output.stdout_problem().errno == 28
        calls = full.calls
        sys.stdout.write("nobody hears this\n")
        assert full.calls == calls
    assert full.taken == b"twelve\nlette"
    assert sys.stdout is before


def test_streams_of_other_makers_are_left_alone(monkeypatch):
    mine = io.StringIO()
    monkeypatch.setattr(sys, "stdout", mine)
    with output.patient_output():
        assert sys.stdout is mine
        assert output.stdout_problem() is None
