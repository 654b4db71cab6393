"""Compiled code and where it is kept: said once, found again, and done without."""

import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

import mjcartpole
from engines import python
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.training import train

QUICK_TRAINING = """
    import logging
    logging.basicConfig(level=logging.INFO, format="%(name)s %(levelname)s %(message)s")
    from mjcartpole.learning.config import TrainConfig
    from mjcartpole.learning.training import train
    from mjcartpole.learning import kernels
    from mjcartpole.learning.methods import q_learning
    from mjcartpole.rewards import one_per_step
    for seed in (0, 1):
        result = train(TrainConfig(backend="gym", episodes=4, seed=seed))
    stats = kernels.learn_chunk(q_learning, one_per_step).stats
    print(result.returns.tolist(), sum(stats.cache_hits.values()))
"""


COMPILING = "mjcartpole INFO compiling the training loop"


@pytest.mark.slow
def test_the_first_training_says_that_it_compiles_and_the_second_process_need_not(tmp_path):
    environment = {"NUMBA_CACHE_DIR": str(tmp_path)}
    (first, said), (second, nothing) = (python(QUICK_TRAINING, **environment) for _ in range(2))
    returns = train(TrainConfig(backend="gym", episodes=4, seed=1)).returns.tolist()
    assert first == f"{returns} 0\n"
    assert second == f"{returns} 1\n"
    assert said.startswith(COMPILING)
    assert said.count("\n") == 1
    assert nothing == ""


@pytest.mark.slow
def test_no_place_for_a_cache_is_no_reason_to_stop(tmp_path):
    """Neither where it was asked for, nor beside the source, nor at home."""
    package = tmp_path / "mjcartpole"
    shutil.copytree(
        Path(mjcartpole.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__")
    )
    (package / "learning" / "__pycache__").write_text("in the way")
    out, said = python(
        QUICK_TRAINING,
        PYTHONPATH=str(tmp_path),
        HOME="/dev/null",
        XDG_CACHE_HOME="/dev/null/nowhere",
        NUMBA_CACHE_DIR="/dev/null/nowhere",
    )
    returns = train(TrainConfig(backend="gym", episodes=4, seed=1)).returns.tolist()
    assert out == f"{returns} 0\n"
    assert said.startswith(COMPILING)
    assert said.count("\n") == 1
    assert (package / "learning" / "__pycache__").is_file()


def remove(cache):
    shutil.rmtree(cache)


def put_a_file_in_the_way_of(cache):
    shutil.rmtree(cache)
    cache.write_text("in the way")


def empty_the_index_of(cache):
    for path in cache.rglob("*.nbi"):
        path.write_bytes(b"")


def garble_the_index_of(cache):
    for path in cache.rglob("*.nbi"):
        path.write_bytes(b"noise" * 50)


def cut_off_the_code_in(cache):
    for path in cache.rglob("*.nbc"):
        path.write_bytes(path.read_bytes()[:1000])


@pytest.mark.slow
@pytest.mark.parametrize(
    "damage",
    [
        remove,
        put_a_file_in_the_way_of,
        empty_the_index_of,
        garble_the_index_of,
        cut_off_the_code_in,
    ],
)
def test_a_damaged_cache_is_no_reason_to_stop(damage, tmp_path):
    """Damaged after the kernels were made, so that numba only sees it when it wants to compile."""
    cache = tmp_path / "cache"
    environment = {"NUMBA_CACHE_DIR": str(cache)}
    expected, _ = python(QUICK_TRAINING, **environment)
    begin, wait = "from mjcartpole.learning import compiled", "print('ready', flush=True); input()"
    process = subprocess.Popen(
        [sys.executable, "-c", f"{begin}\n{wait}\n{textwrap.dedent(QUICK_TRAINING)}"],
        env={**os.environ, **environment},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "ready\n"
    damage(cache)
    out, said = process.communicate("go\n", timeout=120)
    assert process.returncode == 0, said
    assert out.split("]")[0] == expected.split("]")[0]
