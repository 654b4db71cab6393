"""The compiled engine at work: chunks, signals, threads, memory."""

import os
import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from gymnasium.utils import seeding

from engines import DIVERGING, ENGINES, TOUCHING, edited, outcome, python, random_policy, write
from mjcartpole.envs.backend import World
from mjcartpole.errors import SimulationError
from mjcartpole.learning import compiled
from mjcartpole.learning.compiled import CompiledLoop
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.training import Training, train
from mjcartpole.physics.load import load_model
from nightly import at_night, few


@pytest.mark.parametrize("chunk", few([1, 7, 1_000, 10**9], 7))
@pytest.mark.parametrize("backend", few(["mujoco", "gym"], "gym"))
def test_the_length_of_chunks_changes_nothing(chunk, backend, monkeypatch):
    config = TrainConfig(backend=backend, episodes=120, seed=5)
    expected = outcome(config, "compiled")
    monkeypatch.setattr(compiled, "CHUNK_STEPS", chunk)
    assert outcome(config, "compiled") == expected
    ends = list(Training(config).run())
    steps = np.array([0, *np.cumsum(expected["steps"])])
    # A chunk ends with the episode in which its steps are reached, or with the training.
    starts = [0, *ends[:-1]]
    assert all(
        steps[end] - steps[start] >= chunk
        for start, end in zip(starts[:-1], ends[:-1], strict=True)
    )
    assert all(
        steps[end - 1] - steps[start] < chunk for start, end in zip(starts, ends, strict=True)
    )
    assert ends[-1] == 120


def test_a_chunk_is_as_long_as_its_physics_steps_take():
    """Ctrl-C, progress and whoever watches wait for a chunk."""
    lengths = []
    for timestep in (0.02, 0.0002, 0.00002):
        loop = CompiledLoop(World("mujoco", load_model("cartpole", {"timestep": timestep})))
        lengths.append(loop._chunk)
    assert lengths == [compiled.CHUNK_STEPS, compiled.CHUNK_STEPS // 100, 50]


def test_a_loop_forgets_that_its_physics_diverged():
    """Whoever goes on hears of what is found this time, not of the last time."""
    loop = CompiledLoop(World("mujoco", load_model(DIVERGING["NaN, later"])))
    drifting = train(TrainConfig(episodes=200, seed=3)).policy
    with pytest.raises(SimulationError):
        loop.play(drifting, seeding.np_random(0)[0], 500)
    calm = loop.play(random_policy(3), seeding.np_random(0)[0], 5)
    assert list(calm) == list(
        evaluate(
            random_policy(3),
            model=load_model(DIVERGING["NaN, later"]),
            episodes=5,
            seed=0,
            engine="python",
        ).episodes
    )


CRAMPED = """
    import sys
    from mjcartpole.learning.config import TrainConfig
    from mjcartpole.learning.training import train
    try:
        train(TrainConfig(model=sys.argv[1], episodes=5), engine=sys.argv[2])
    except Exception:
        print("an exception, and the process lives")
"""


@pytest.mark.long
@pytest.mark.parametrize("engine", few(ENGINES, "compiled"))
def test_an_error_inside_mujoco_does_not_end_the_process(engine, tmp_path, monkeypatch):
    """MuJoCo's answer to too little memory for contacts is `exit`, unless somebody steps in."""
    monkeypatch.chdir(tmp_path)
    contacts = edited(*TOUCHING, ("<option", '<size memory="2K"/><option'))
    out, _ = python(CRAMPED, write(tmp_path, contacts.replace("0.33 0.11", "0.2 0.11")), engine)
    assert out == "an exception, and the process lives\n"


def test_an_interpreter_runs_on_while_a_chunk_is_computed(monkeypatch):
    """Whoever holds Python's lock stops all other threads: there would be no rounds at all."""
    monkeypatch.setattr(compiled, "CHUNK_STEPS", 10**9)
    train(TrainConfig(backend="gym", episodes=5))
    rounds, over = [0], threading.Event()

    def count():
        while not over.is_set():
            rounds[0] += 1
            time.sleep(1e-4)

    thread = threading.Thread(target=count)
    thread.start()
    training = Training(TrainConfig(backend="gym", episodes=10_000))
    before = rounds[0]
    chunks = [rounds[0] - before for _ in training.run()]
    over.set()
    thread.join()
    assert len(chunks) == 1
    assert chunks[0] > 50


@pytest.mark.parametrize("backend", ["mujoco", "gym"])
def test_trainings_in_threads_are_those_done_one_after_another(backend):
    episodes = at_night(300, fast=80)
    wanted = [TrainConfig(backend=backend, seed=seed, episodes=episodes) for seed in range(4)]
    expected = [outcome(config, "compiled") for config in wanted]
    with ThreadPoolExecutor(4) as threads:
        found = list(threads.map(lambda config: outcome(config, "compiled"), wanted))
    assert found == expected


def interrupted_training(backend):
    training = Training(TrainConfig(backend=backend, episodes=1_000_000))
    chunks = training.run()
    next(chunks)
    sender = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
    sender.start()
    with pytest.raises(KeyboardInterrupt):
        for _ in chunks:
            pass
    sender.join()
    return training


@pytest.mark.parametrize("backend", few(["mujoco", "gym"], "mujoco"))
def test_ctrl_c_is_heard_between_chunks_and_nothing_is_torn(backend):
    """What was learned is what was logged: the same as a training that was left there."""
    found = interrupted_training(backend)
    assert 0 < len(found.log) < found.config.episodes
    expected = Training(found.config)
    chunks = expected.run()
    while len(expected.log) < len(found.log):
        next(chunks)
    assert list(expected.log) == list(found.log)
    assert (
        expected.snapshot().memory["q_table"].tobytes()
        == found.snapshot().memory["q_table"].tobytes()
    )
    assert expected.snapshot().env_rng == found.snapshot().env_rng


def resident_bytes():
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="needs Linux's /proc")
@pytest.mark.parametrize("td_lambda", [None, 0.9])
@pytest.mark.parametrize(("backend", "steps"), [("gym", 20_000_000), ("mujoco", 2_000_000)])
def test_memory_does_not_grow(backend, steps, td_lambda):
    training = Training(TrainConfig(backend=backend, td_lambda=td_lambda, episodes=1_000_000))
    chunks = training.run()
    for _ in range(3):
        next(chunks)
    before = resident_bytes()
    # A chunk has at least CHUNK_STEPS steps.
    for _ in range(steps // compiled.CHUNK_STEPS):
        next(chunks)
    assert resident_bytes() - before < 4_000_000
