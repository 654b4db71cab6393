"""What works where only MuJoCo, gymnasium and NumPy are installed, and what the rest says there."""

import doctest
import hashlib
import json
import os
import subprocess
import sys
import textwrap
import tomllib
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest
from packaging.requirements import Requirement

import mjcartpole
from mjcartpole import packages
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.training import train
from mjcartpole.packages import is_installed, missing

THREE = "mujoco", "gymnasium", "numpy"
WORKS = """
    import hashlib, json, logging
    import gymnasium, numpy, mjcartpole, mjcartpole.page.report
    logging.basicConfig(level=logging.INFO, format="%(message)s")

    env = gymnasium.make("mjcartpole/CartPole-v1", model="long")
    env.reset(seed=1)
    states = [env.step(action)[0].tolist() for action in (0, 1, 1, 0)]
    vector = mjcartpole.CartPoleVectorEnv(2)
    vector.reset(seed=1)
    edited = mjcartpole.load_model("cartpole", edits=["pole.length=1.5"])
    result = mjcartpole.train(mjcartpole.TrainConfig(episodes=8, seed=2))
    played = mjcartpole.evaluate(result.policy, episodes=2)
    print(json.dumps({
        "states": states,
        "vector": vector.step(numpy.array([0, 1]))[0].tolist(),
        "edited": edited.model.body_mass.tolist(),
        "table": hashlib.sha256(result.q_table.tobytes()).hexdigest(),
        "played": played.returns.tolist(),
    }))
"""
PARITY = """
    from mjcartpole.studies.parity import Subject, run_ladder
    from mjcartpole.physics.load import load_model
    for result in run_ladder(Subject(load_model("cartpole"), quick=True)):
        print(result.rung, result.verdict, result.skipped)
"""
LACKS = {
    "mjcartpole --help": "the command line needs the package tyro: pip install tyro",
    "mjcartpole.media.sketch": "a picture needs the package pillow: pip install pillow",
    "mjcartpole.studies.film": "a picture needs the package pillow: pip install pillow",
    "controllers.lqr(load_model('cartpole'))": (
        "policy lqr or energy needs the package scipy: pip install 'mjcartpole[scipy]'"
    ),
    "train(TrainConfig.preset('planned', episodes=1))": (
        "method planning needs the package scipy: pip install 'mjcartpole[scipy]'"
    ),
    "runs.claimed_folder(Path('run')).__enter__()": (
        "a run's folder needs the package filelock: pip install filelock"
    ),
    "write_pictures(Path(), iter([]), 1)": (
        "a folder of pictures needs the package imageio: pip install imageio"
    ),
    "plots.plot_style().__enter__()": (
        "a plot needs the package matplotlib: pip install 'mjcartpole[plot]'"
    ),
    "tensorboard.write_events(None, None)": (
        "--tensorboard needs the package tensorboardX: pip install 'mjcartpole[tensorboard]'"
    ),
    "cluster.connected('').__enter__()": (
        "a cluster needs the package distributed: pip install 'mjcartpole[dask]'"
    ),
}
"""What needs another package, and all that is said of it."""


def needed(names):
    """Distributions with all that they need, by name."""
    waiting, found = [(name, "") for name in names], set()
    while waiting:
        name, extra = waiting.pop()
        if (name, extra) in found:
            continue
        found.add((name, extra))
        for line in metadata.requires(name) or ():
            one = Requirement(line)
            if one.marker is None or one.marker.evaluate({"extra": extra}):
                waiting += [(one.name, each) for each in ("", *one.extras)]
    return {name for name, _ in found}


@pytest.fixture(scope="module")
def three(tmp_path_factory):
    """A function that runs code where nothing but three packages is installed beside ours."""
    site = tmp_path_factory.mktemp("site")
    parts = {
        Path(metadata.distribution(name).locate_file(file.parts[0]))
        for name in needed(THREE)
        for file in metadata.files(name)
        if file.parts[0] not in ("..", "__pycache__")
    }
    for part in {*parts, Path(mjcartpole.__file__).parent}:
        (site / part.name).symlink_to(part)

    def run(*words):
        # -S: without the packages of this environment.
        done = subprocess.run(
            [sys.executable, "-S", *words],
            env={**os.environ, "PYTHONPATH": str(site), "MUJOCO_GL": "disable"},
            cwd=tmp_path_factory.mktemp("here"),
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )
        return done.returncode, done.stdout, done.stderr

    return run


@pytest.mark.long
def test_three_packages_are_enough_for_environments_edits_and_training(three):
    code, out, err = three("-c", textwrap.dedent(WORKS))
    assert (code, err) == (
        0,
        "the compiled engine cannot run here (it needs the package numba: pip install numba); "
        "the Python engine takes over: the same results, later\n",
    )
    found = json.loads(out)
    here = train(TrainConfig(episodes=8, seed=2))
    assert found["table"] == hashlib.sha256(here.q_table.tobytes()).hexdigest()
    assert found["played"] == mjcartpole.evaluate(here.policy, episodes=2).returns.tolist()
    assert (
        found["edited"]
        == mjcartpole.load_model("cartpole", edits=["pole.length=1.5"]).model.body_mass.tolist()
    )
    vector = mjcartpole.CartPoleVectorEnv(2)
    vector.reset(seed=1)
    assert found["vector"] == vector.step(np.array([0, 1]))[0].tolist()
    assert len(found["states"]) == 4


@pytest.mark.slow
def test_three_packages_are_enough_for_all_rungs_but_the_third_witness(three):
    code, out, err = three("-c", textwrap.dedent(PARITY))
    assert (code, err) == (0, "")
    *ours, last = out.splitlines()
    assert ours == [f"{rung} holds " for rung in range(1, 10)]
    assert last.startswith("10 skipped dm_control is not installed")


@pytest.mark.long
def test_what_lacks_a_package_says_in_one_line_what_to_type(three):
    code = """
        import io, contextlib
        from pathlib import Path
        from mjcartpole.cli import main
        from mjcartpole.errors import MjCartPoleError
        from mjcartpole.learning import controllers, runs, tensorboard
        from mjcartpole.learning.config import TrainConfig
        from mjcartpole.learning.training import train
        from mjcartpole.media import plots
        from mjcartpole.media.pictures import write_pictures
        from mjcartpole.physics.load import load_model
        from mjcartpole.studies.study import cluster
        for asked in ASKED:
            try:
                if asked.startswith("mjcartpole "):
                    with contextlib.redirect_stderr(io.StringIO()) as said:
                        try:
                            main(asked.split()[1:])
                        except SystemExit as stop:
                            assert stop.code == 2
                    print(said.getvalue().removeprefix("mjcartpole: error: "), end="")
                elif asked.startswith("mjcartpole."):
                    __import__(asked)
                else:
                    eval(asked)
            except MjCartPoleError as error:
                print(error)
    """
    code = textwrap.dedent(code).replace("ASKED", repr(list(LACKS)))
    code, out, err = three("-c", code)
    assert (code, out.splitlines()) == (0, list(LACKS.values())), err


def test_an_extra_is_one_that_pyproject_has():
    text = Path(__file__).resolve().parents[1].joinpath("pyproject.toml").read_text("utf-8")
    extras = tomllib.loads(text)["project"]["optional-dependencies"]
    for package, extra in packages.EXTRAS.items():
        assert [Requirement(line).name for line in extras[extra]] == [package]


def test_a_package_is_there_or_not():
    assert is_installed("numpy")
    assert not is_installed("no_such_package")
    assert missing("it", "PIL") == "it needs the package pillow: pip install pillow"
    assert doctest.testmod(packages).failed == 0
