"""The compiled engine where it can run; the reference loop, with one word about it, elsewhere."""

import json
import logging
import os
import subprocess
import sys
import textwrap

import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.engine import choose_engine
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.training import Training, train

TRAININGS = """
    import hashlib, json, logging, sys
    logging.basicConfig(level=logging.INFO, format="%(name)s %(levelname)s %(message)s")
    from mjcartpole.learning.config import TrainConfig
    from mjcartpole.learning.training import Training, train
    from mjcartpole.learning.evaluation import evaluate
    found = {}
    for backend in ("mujoco", "gym"):
        config = TrainConfig(backend=backend, episodes=30, seed=2)
        result = train(config)
        evaluation = evaluate(result.policy, backend=backend, episodes=3, engine="compiled")
        found[backend] = {
            "engine": Training(config).engine,
            "table": hashlib.sha256(result.q_table.tobytes()).hexdigest(),
            "returns": result.returns.tolist(),
            "greedy": evaluation.returns.tolist(),
        }
    print(json.dumps(found))
"""
WARNING = "mjcartpole WARNING the compiled engine cannot run here (%s"


def trained_here():
    import hashlib

    found = {}
    for backend in ("mujoco", "gym"):
        result = train(TrainConfig(backend=backend, episodes=30, seed=2), engine="compiled")
        evaluation = evaluate(result.policy, backend=backend, episodes=3)
        found[backend] = {
            "engine": "python",
            "table": hashlib.sha256(result.q_table.tobytes()).hexdigest(),
            "returns": result.returns.tolist(),
            "greedy": evaluation.returns.tolist(),
        }
    return found


def trained_elsewhere(**environment):
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(TRAININGS)],
        env={**os.environ, "MUJOCO_GL": "disable", **environment},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), done.stderr


def without(package, tmp_path, error):
    """A search path on which a package cannot be imported."""
    (tmp_path / package).mkdir()
    (tmp_path / package / "__init__.py").write_text(f"raise {error}\n")
    before = os.environ.get("PYTHONPATH")
    return {"PYTHONPATH": os.pathsep.join([str(tmp_path), *([before] if before else [])])}


def test_the_compiled_engine_runs_where_it_can(caplog):
    with caplog.at_level(logging.INFO, "mjcartpole"):
        for backend in ("mujoco", "gym"):
            assert choose_engine("compiled", backend) == "compiled"
            assert choose_engine("python", backend) == "python"
            config = TrainConfig(backend=backend, episodes=1)
            assert Training(config).engine == "compiled"
            assert Training(config, engine="python").engine == "python"
    assert not caplog.records


@pytest.mark.long
def test_what_was_compiled_before_is_loaded_without_what_compiling_needs():
    config = TrainConfig(backend="gym", episodes=1)
    train(config)
    code = (
        "import sys, mjcartpole\n"
        f"assert mjcartpole.train(mjcartpole.{config!r}).returns.tolist() == "
        f"{train(config).returns.tolist()}\n"
        "print('numba.core' in sys.modules, 'numba.np.arraymath' in sys.modules)"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True) == "True False\n"


@pytest.mark.parametrize("engine", ["cython", "", "Compiled"])
def test_an_unknown_engine_is_refused(engine):
    message = f"engine '{engine}' is unknown; available: compiled, python"
    with pytest.raises(ConfigError, match=message):
        choose_engine(engine, "gym")
    with pytest.raises(ConfigError, match=message):
        train(TrainConfig(episodes=1), engine=engine)
    with pytest.raises(ConfigError, match=message):
        evaluate(lambda observation: 1, episodes=1, engine=engine)


def test_an_engine_cannot_be_asked_of_an_environment_that_is_given():
    from mjcartpole.envs.backend import make_env

    assert Training(TrainConfig(episodes=2), make_env("gym")).engine == "python"


@pytest.mark.slow
def test_where_numba_compiles_nothing_the_reference_loop_does_the_same():
    found, said = trained_elsewhere(NUMBA_DISABLE_JIT="1")
    assert found == trained_here()
    assert said.startswith(WARNING % "NUMBA_DISABLE_JIT is set")
    assert said.count("\n") == 1


@pytest.mark.long
@pytest.mark.parametrize(
    ("package", "error", "reason"),
    [
        (
            "numba",
            "ImportError('Numba needs NumPy 2.1 or less')",
            "Numba does not work: Numba needs NumPy 2.1 or less",
        ),
        pytest.param(
            "llvmlite",
            "OSError('Could not find libllvmlite')",
            "Numba does not work: ",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_where_numba_cannot_be_imported_the_reference_loop_does_the_same(
    package, error, reason, tmp_path
):
    found, said = trained_elsewhere(**without(package, tmp_path, error))
    assert found == trained_here()
    assert said.startswith(WARNING % reason)
    assert said.count("\n") == 1
