"""Runs on a Dask cluster: what travels, and workers that are killed, late, or others.

Clusters are real ones, on this machine; without the package distributed those tests skip.
"""

import contextlib
import dataclasses
import importlib.util
import json
import os
import pickle
import platform
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

import mjcartpole
from assets import MESH, OBJ, document
from command_line import call
from mjcartpole.errors import ConfigError
from mjcartpole.studies.study import cluster
from mjcartpole.studies.study.cluster import Parcel, connected, run_parcel, versions_here
from mjcartpole.studies.study.plan import plan
from mjcartpole.studies.study.records import LOG, do_run
from mjcartpole.studies.study.study_file import study_of
from mjcartpole.studies.study.tables import TIMES

HAS_DASK = importlib.util.find_spec("distributed") is not None
needs_dask = [
    pytest.mark.slow,
    pytest.mark.skipif(not HAS_DASK, reason="the package distributed comes with the extra dask"),
    pytest.mark.skipif(os.name == "nt", reason="there is no SIGKILL"),
]
FILE = """
[study]
seeds = 10
[base]
episodes = 60
[factors]
alpha = [0.1, 0.3]
pole.length = [0.5, 1.0]
"""


def first_run(**base):
    study = study_of({"study": {"seeds": 1}, "base": base, "factors": {"alpha": [0.1]}})
    return plan(study).runs[0]


def lasting(record):
    return dataclasses.replace(record, times={})


@pytest.mark.parametrize("base", [{"backend": "gym"}, {"gravity": 3.7}, {"own_timestep": True}])
def test_a_run_that_travelled_comes_to_the_same(base):
    run = first_run(episodes=8, **base)
    parcel = pickle.loads(pickle.dumps(Parcel.of(run)))
    here = do_run(run.key, run.job, None, lambda: False)
    assert lasting(run_parcel(parcel)) == lasting(here)


def test_files_that_a_model_names_travel_with_it(tmp_path):
    (tmp_path / "m.obj").write_bytes(OBJ)
    (tmp_path / "mine.xml").write_text(document(asset=MESH.format("m.obj")))
    run = first_run(episodes=4, model=str(tmp_path / "mine.xml"))
    here, parcel = do_run(run.key, run.job, None, lambda: False), Parcel.of(run)
    assert list(parcel.files.values()) == [OBJ]
    shutil.rmtree(tmp_path)
    assert not here.error and lasting(run_parcel(parcel)) == lasting(here)


def test_a_worker_of_another_version_is_refused():
    parcel = Parcel.of(first_run(episodes=2))
    other = dataclasses.replace(parcel, versions=parcel.versions | {"mujoco": "0.9"})
    with pytest.raises(ConfigError, match=r"a worker on .* has mujoco .*, and here it is 0\.9"):
        run_parcel(other)
    assert len(versions_here()["mjcartpole's sources"]) == 8


FMA = Path("/proc/cpuinfo").exists() and b" fma " in Path("/proc/cpuinfo").read_bytes()
SHOW = f"import json; from {cluster.__name__} import *; print(json.dumps(versions_here()))"


@pytest.mark.slow
@pytest.mark.skipif(not (FMA and platform.libc_ver()[0] == "glibc"), reason="glibc may go without")
def test_a_worker_whose_sines_are_rounded_otherwise_is_refused():
    """As of a processor of before 2013: two trainings of 2,400 come to something else there."""
    without = os.environ | {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-AVX2"}
    told = subprocess.check_output([sys.executable, "-c", SHOW], env=without, text=True)
    with pytest.raises(ConfigError, match=r"C library whose sines come to \w+, .* of its kind"):
        cluster.check_versions(json.loads(told), versions_here(), "a worker")


@pytest.mark.skipif(HAS_DASK, reason="distributed is installed")
def test_what_is_missing_is_named():
    with pytest.raises(ConfigError, match=r"pip install 'mjcartpole\[dask\]'"), connected("a:1"):
        pass


@pytest.mark.parametrize(
    "address", ["", "nothing", "tcp://", "tcp://a b:1", "host:port", "http://a:1"]
)
def test_what_is_no_address_is_refused(address, monkeypatch):
    monkeypatch.setattr(cluster, "check_installed", lambda *names: None)
    with pytest.raises(ConfigError, match="is no address of a scheduler"), connected(address):
        pass


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextlib.contextmanager
def started(words, folder, path=None):
    """Start one of Dask's programs; it and its children are gone afterwards."""
    source = path or Path(mjcartpole.__file__).parents[1]
    with (folder / f"{words[0]}.log").open("w") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", "distributed.cli." + words[0], *words[1:]],
            env=os.environ | {"PYTHONPATH": str(source)},
            stdout=log,
            stderr=log,
            start_new_session=True,
        )
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


@contextlib.contextmanager
def scheduler(folder):
    port = free_port()
    words = ["dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"]
    with started(words, folder):
        yield f"tcp://127.0.0.1:{port}"


def worker(address, folder, path=None):
    words = ["dask_worker", address, "--nworkers", "2", "--nthreads", "1", "--no-dashboard"]
    return started(words, folder, path)


@pytest.fixture
def asked(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.toml").write_text(FILE)
    return tmp_path


def tables(folder):
    """What is the same wherever it was done."""
    rows = (folder / "runs.csv").read_text().splitlines()
    return [row.rsplit(",", len(TIMES))[0] for row in rows], (folder / "curves.csv").read_text()


def wait_for(condition, patience=120):
    until = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.05)


def done(folder):
    log = folder / LOG
    return log.read_bytes().count(b"\n") if log.exists() else 0


def children(process):
    """The worker processes that a nanny has."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
            if parent == process.pid and b"spawn_main" in (entry / "cmdline").read_bytes():
                found.append(int(entry.name))
    return found


def study(*words):
    """Begin a study in a process of its own."""
    command = [sys.executable, "-m", "mjcartpole", "study", "a.toml", *map(str, words)]
    return subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


class TestCluster:
    pytestmark = needs_dask

    def test_killed_workers_and_a_killed_client_cost_nothing(self, asked, capsys):
        call(["study", "a.toml", "--run-dir", "here"], capsys)
        there = asked / "there"
        with scheduler(asked) as address, worker(address, asked) as nanny:
            begun = study("--run-dir", there, "--scheduler", address)
            for number in (3, 8):
                wait_for(lambda number=number: done(there) > number and children(nanny))
                os.kill(children(nanny)[0], signal.SIGKILL)
            wait_for(lambda: done(there) > 14)
            begun.kill()
            begun.communicate()
            code, out, err = call(
                ["study", "a.toml", "--run-dir", there, "--resume", "--scheduler", address], capsys
            )
        assert (code, err) == (0, "") and "done before" in out
        keys = [json.loads(line)["key"] for line in (there / LOG).read_bytes().splitlines()]
        assert len(keys) == len(set(keys)) == 40
        assert tables(there) == tables(asked / "here")

    def test_a_worker_of_other_sources_is_told(self, asked, capsys):
        shutil.copytree(Path(mjcartpole.__file__).parent, asked / "other" / "mjcartpole")
        with (asked / "other" / "mjcartpole" / "task.py").open("a") as file:
            file.write("# another\n")
        with scheduler(asked) as address, worker(address, asked, asked / "other"):
            time.sleep(8)
            code, _, err = call(["study", "a.toml", "--scheduler", address], capsys)
        assert code == 2 and "has mjcartpole's sources" in err and err.count("\n") == 1
        assert not (asked / "studies").exists()

    def test_a_scheduler_that_is_not_there_is_told(self, asked, capsys):
        address = f"tcp://127.0.0.1:{free_port()}"
        code, _, err = call(["study", "a.toml", "--scheduler", address], capsys)
        assert code == 2 and f"no Dask scheduler answers at '{address}'" in err
        assert err.count("\n") == 1 and not (asked / "studies").exists()

    def test_a_scheduler_that_dies_leaves_what_is_done(self, asked):
        there = asked / "there"
        with contextlib.ExitStack() as stack:
            address = stack.enter_context(scheduler(asked))
            with worker(address, asked):
                begun = study("--run-dir", there, "--scheduler", address)
                wait_for(lambda: done(there) > 3)
                stack.close()
                _, err = begun.communicate(timeout=120)
        assert begun.returncode == 2
        assert "the scheduler answers no more" in err and "done and kept" in err
        assert "Traceback" not in err and len(tables(there)[0]) == done(there) + 1
