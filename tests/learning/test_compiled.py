"""The compiled engine against the reference loop: the same bits, whatever is asked for."""

import dataclasses
import os
import shutil
import signal
import subprocess
import sys
import textwrap
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from gymnasium.utils import seeding
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import mjcartpole
from mjcartpole.errors import SimulationError
from mjcartpole.learning import compiled
from mjcartpole.learning.compiled import CompiledLoop
from mjcartpole.learning.config import PRESETS, TrainConfig
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.training import Training, train
from mjcartpole.physics.load import load_model
from mjcartpole.studies.evaluation import evaluate

REFERENCE = load_model().xml
ENGINES = ("python", "compiled")


def edited(*changes):
    """The reference document with words replaced."""
    text = REFERENCE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


def to(new):
    """A change of the timestep or the integrator."""
    name = new.split("=")[0]
    return {"timestep": 'timestep="0.02"', "integrator": 'integrator="Euler"'}[name], new


RUBBING = ('damping="0" frictionloss="0"', 'damping="0.2" frictionloss="0.05"')
LIMITED = ('type="slide"', 'type="slide" range="-0.1 0.2"')
TOUCHING = (
    ('contype="0" conaffinity="0"', 'contype="1" conaffinity="1"'),
    # Cart and rail do not overlap; the cart and its stops do from 0.1 m on.
    ('pos="0 0.11 -0.14" size="2.68 0.05 0.04"', 'pos="0 0.11 -0.34" size="2.68 0.05 0.04"'),
    ('"2.63 0.11 -0.03"', '"0.33 0.11 -0.03"'),
    ('"-2.63 0.11 -0.03"', '"-0.33 0.11 -0.03"'),
)
HINGE_FIRST = """
<mujoco>
  <option timestep="0.005" gravity="0.1 0 -9"/>
  <worldbody>
    <body name="wagon">
      <joint name="Schiene" type="slide" axis="-1 0 0.1" springref="0.1" stiffness="0.5"/>
      <geom type="box" size="0.2 0.1 0.1" contype="0" conaffinity="0"/>
      <body name="ballast" pos="0 0 0.1"><geom type="sphere" size="0.05"/></body>
      <body name="rod" pos="0.1 0 0">
        <joint name="a hinge" type="hinge" axis="0 1 0.05" armature="0.01"/>
        <geom type="capsule" fromto="0 0 0 0.02 0 0.7" size="0.02" contype="0" conaffinity="0"/>
      </body>
    </body>
  </worldbody>
  <actuator><position joint="Schiene" kp="30" ctrlrange="-0.3 0.7" ctrllimited="true"/></actuator>
</mujoco>
"""
MODELS = {
    "reference": REFERENCE,
    "half steps": edited(to('timestep="0.01"')),
    "fifths of steps": edited(to('timestep="0.004"'), RUBBING),
    "damping and friction": edited(RUBBING),
    "implicit damping": edited(RUBBING, to('integrator="implicit"')),
    "implicitfast": edited(RUBBING, to('integrator="implicitfast"'), to('timestep="0.005"')),
    "RK4": edited(to('integrator="RK4"')),
    "RK4 in half steps": edited(RUBBING, to('integrator="RK4"'), to('timestep="0.01"')),
    "a limited cart": edited(LIMITED),
    "a limited pole": edited(('type="hinge"', 'type="hinge" range="-0.03 0.1"')),
    "contacts": edited(*TOUCHING, to('timestep="0.005"')),
    "all at once": edited(*TOUCHING, RUBBING, LIMITED, to('timestep="0.01"')),
    "no range of control": edited((' gear="10" ctrlrange="-1 1"', ' gear="3"')),
    "a lopsided range": edited(('ctrlrange="-1 1"', 'ctrlrange="-0.2 1.3"')),
    "a range to one side": edited(('ctrlrange="-1 1"', 'ctrlrange="0.5 2"')),
    "other names": edited(('"slider"', '"hinge 2"'), ('name="hinge"', 'name="a slider"')),
    "another cart-pole": HINGE_FIRST,
    "the moon, in a wind": edited(
        ('gravity="0 0 -9.8"', 'gravity="0 0 -1.62" density="1.2" wind="3 0 0"')
    ),
    "asleep": edited(
        ('integrator="Euler"/>', 'integrator="Euler"><flag sleep="enable"/></option>')
    ),
}
# A push into this limit, and nothing is sane any more.
BRITTLE = 'type="slide" range="-0.9 0.9" solreflimit="-{} -1" solimplimit="0.9999 0.9999 0.001"'
DIVERGING = {
    # The model of test_cli.py: at once.
    "wild": edited(('mass="1.0"', 'mass="1e-12"'), ('gear="10"', 'gear="1e12"')),
    "NaN in the second step": edited(('gravity="0 0 -9.8"', 'gravity="0 0 1e200"')),
    "too large, later": edited(('type="slide"', BRITTLE.format("1e18"))),
    "NaN, later": edited(('type="slide"', BRITTLE.format("1e300"))),
    "NaN, later, in half steps": edited(
        ('type="slide"', BRITTLE.format("1e300")), to('timestep="0.01"')
    ),
}


def outcome(config, engine, cartpole=None):
    """All that a training comes to, as bytes; where it diverges, up to there."""
    training = Training(config, engine=engine, cartpole=cartpole)
    assert training.engine == engine
    error = None
    try:
        for finished in training.run():
            assert finished == len(training.log)
    except SimulationError as diverged:
        error = str(diverged)
    snapshot = training.snapshot()
    return {
        "table": snapshot.memory["q_table"].tobytes(),
        "returns": snapshot.columns.totals.tolist(),
        "steps": snapshot.columns.steps.tolist(),
        "endings": [episode.ending for episode in training.log],
        "generators": (snapshot.env_rng, snapshot.learner_rng),
        "policy": training.result().policy.actions.tolist(),
        "error": error,
    }


def assert_engines_agree(config, cartpole=None):
    expected, found = (outcome(config, engine, cartpole) for engine in ENGINES)
    assert found == expected
    return found


def write(tmp_path, text, name="model.xml"):
    (tmp_path / name).write_text(text)
    return str(tmp_path / name)


@st.composite
def configs(draw):
    fractions = st.floats(0, 1)
    schedules = st.sampled_from([0.0, 0.01, 0.1, 1.0]) | fractions
    low = draw(st.tuples(*[st.floats(-3, 0)] * 4))
    width = draw(st.tuples(*[st.floats(1e-3, 5)] * 4))
    q_init = sorted(draw(st.tuples(*[st.sampled_from([0.0, 1.0, 60.0]) | st.floats(-99, 99)] * 2)))
    physics = draw(st.sampled_from([("gym", "gym"), ("mujoco", "gym"), ("mujoco", "mujoco")]))
    return TrainConfig(
        backend=physics[0],
        integrator=physics[1],
        episodes=draw(st.integers(1, 40)),
        seed=draw(st.integers(0, 9) | st.integers(0, 2**70)),
        bins=draw(st.tuples(*[st.sampled_from([1, 1, 2, 3, 8]) | st.integers(1, 30)] * 4)),
        low=low,
        high=tuple(a + b for a, b in zip(low, width, strict=True)),
        gamma=draw(st.sampled_from([0.0, 0.95, 1.0]) | fractions),
        alpha=draw(schedules),
        alpha_final=draw(schedules),
        epsilon=draw(schedules),
        epsilon_final=draw(schedules),
        decay=draw(st.sampled_from([0.0, 0.5, 1.0, 0, 1]) | fractions),
        q_init_low=q_init[0],
        q_init_high=q_init[1],
        td_lambda=draw(st.sampled_from([None, None, 0.0, 1.0, 0, 1]) | fractions),
        ties=draw(st.sampled_from(["first", "random"])),
        learn_last_step=draw(st.booleans()),
    )


@given(configs())
@settings(max_examples=60, suppress_health_check=list(HealthCheck))
def test_any_config_gives_the_same_bits(config):
    found = assert_engines_agree(config)
    assert len(found["returns"]) == config.episodes


@pytest.mark.parametrize(
    ("preset", "backend"),
    [(name, "mujoco") for name in PRESETS]
    + [(name, "gym") for name in PRESETS if "model" not in PRESETS[name]],
)
@pytest.mark.parametrize("changes", [{}, {"ties": "random", "td_lambda": None}])
def test_the_presets_give_the_same_bits(preset, backend, changes):
    assert_engines_agree(
        TrainConfig.preset(preset, backend=backend, episodes=100, seed=6, **changes)
    )


@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
@pytest.mark.parametrize("name", list(MODELS))
def test_any_model_gives_the_same_bits(name, integrator, tmp_path):
    config = TrainConfig(
        model=write(tmp_path, MODELS[name]), integrator=integrator, episodes=25, seed=4
    )
    assert_engines_agree(config)
    assert_engines_agree(dataclasses.replace(config, td_lambda=None, ties="random"))


def numbers(low, high):
    """Numbers of few digits: MuJoCo's reader refuses the smallest of all."""
    return st.integers(0, 1000).map(lambda k: low + (high - low) * k / 1000)


@given(
    st.fixed_dictionaries(
        {
            'mass="1.0"': numbers(0.05, 3),
            'mass="0.1"': numbers(0.05, 3),
            'pos="0 0 0.5"': numbers(0.05, 3).map("0 0.01 {}".format),
            'gear="10"': numbers(-30, -0.01) | numbers(0.01, 30),
            'gravity="0 0 -9.8"': (numbers(-20, -0.5) | numbers(0.5, 1)).map("0.1 0 {}".format),
            'damping="0"': st.just(0.0) | numbers(0, 2),
            'frictionloss="0"': st.just(0.0) | numbers(0, 0.5),
            'armature="0"': st.just(0.0) | numbers(0, 0.1),
            'timestep="0.02"': st.sampled_from([0.02, 0.02, 0.01, 0.004]),
            'integrator="Euler"': st.sampled_from(["Euler", "RK4", "implicit", "implicitfast"]),
            'ctrlrange="-1 1"': st.tuples(numbers(-2, 0), numbers(0.1, 2)).map(
                lambda ends: "{} {}".format(*ends)
            ),
        }
    ),
    st.sampled_from(["gym", "mujoco"]),
)
@settings(max_examples=40)
def test_any_numbers_in_a_model_give_the_same_bits(values, integrator):
    changes = [(old, f'{old.split("=")[0]}="{value}"') for old, value in values.items()]
    config = TrainConfig(episodes=25, integrator=integrator, td_lambda=None)
    assert_engines_agree(config, load_model(edited(*changes)))


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["tuned", "article-terminal"])
@pytest.mark.parametrize(
    ("backend", "integrator"), [("gym", "gym"), ("mujoco", "gym"), ("mujoco", "mujoco")]
)
def test_whole_trainings_give_the_same_bits(preset, backend, integrator):
    changes = {} if preset == "tuned" else {"episodes": 3_000}
    for seed in (0, 1):
        config = TrainConfig.preset(
            preset, backend=backend, integrator=integrator, seed=seed, **changes
        )
        found = assert_engines_agree(config)
        assert preset != "tuned" or found["steps"][-100:] == [500] * 100


def random_policy(seed, bins=(2, 3, 8, 8)):
    table = np.random.default_rng(seed).integers(3, size=(*bins, 2)).astype(float)
    return Policy(Discretizer(bins, (-2.4, -1.0, -0.2, -1.5), (2.4, 1.0, 0.25, 2.0)), table)


@pytest.mark.parametrize("backend", ["mujoco", "gym"])
@pytest.mark.parametrize("seed", [0, 3])
def test_evaluations_are_the_same_episodes(backend, seed):
    policies = [
        random_policy(seed),
        random_policy(seed, bins=(1, 1, 1, 1)),
        train(TrainConfig(backend=backend, seed=seed)).policy,
        train(TrainConfig(backend=backend, seed=seed, episodes=150)).policy,
    ]
    for policy in policies:
        expected, found = (
            evaluate(policy, backend=backend, episodes=8, seed=seed, engine=engine)
            for engine in ENGINES
        )
        assert found.episodes == expected.episodes
        assert [episode.number for episode in found.episodes] == list(range(8))


@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
@pytest.mark.parametrize("name", list(MODELS))
def test_evaluations_on_any_model_are_the_same_episodes(name, integrator):
    model, policy = load_model(MODELS[name]), random_policy(1)
    expected, found = (
        evaluate(policy, model=model, integrator=integrator, episodes=5, engine=engine)
        for engine in ENGINES
    )
    assert found.episodes == expected.episodes


@pytest.mark.parametrize("td_lambda", [None, 0.9])
@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
@pytest.mark.parametrize("name", list(DIVERGING))
def test_diverging_physics_stop_both_engines_at_the_same_step(
    name, integrator, td_lambda, tmp_path
):
    model = write(tmp_path, DIVERGING[name])
    config = TrainConfig(
        model=model, integrator=integrator, td_lambda=td_lambda, episodes=300, seed=1
    )
    found = assert_engines_agree(config)
    done, later = len(found["returns"]), "later" in name
    assert (done > 0) is later
    assert found["error"].startswith(f"episode {done + 1:,}, step ")
    assert f"the simulation of {model} diverged: (x, x_dot, theta, theta_dot) = (" in found["error"]


@pytest.mark.parametrize("name", list(DIVERGING))
def test_diverging_physics_stop_evaluations_at_the_same_step(name):
    messages = []
    for engine in ENGINES:
        with pytest.raises(SimulationError, match=r"^episode \d+, step \d+: .* diverged") as error:
            evaluate(
                train(TrainConfig(episodes=200, seed=3)).policy,
                model=load_model(DIVERGING[name]),
                engine=engine,
            )
        messages.append(str(error.value))
    assert messages[0] == messages[1]


@pytest.mark.parametrize("chunk", [1, 7, 1_000, 10**9])
@pytest.mark.parametrize("backend", ["mujoco", "gym"])
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
        loop = CompiledLoop("mujoco", load_model("cartpole", {"timestep": timestep}), "gym")
        lengths.append(loop._chunk)
    assert lengths == [compiled.CHUNK_STEPS, compiled.CHUNK_STEPS // 100, 50]


def test_a_loop_forgets_that_its_physics_diverged():
    """Whoever goes on hears of what is found this time, not of the last time."""
    loop = CompiledLoop("mujoco", load_model(DIVERGING["NaN, later"]), "gym")
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


@pytest.mark.parametrize("engine", ENGINES)
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
    wanted = [TrainConfig(backend=backend, seed=seed, episodes=300) for seed in range(4)]
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


@pytest.mark.parametrize("backend", ["mujoco", "gym"])
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


def python(script, *arguments, **environment):
    """Run a script in a process of its own; returns its stdout and stderr."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", textwrap.dedent(script), *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout, done.stderr


QUICK_TRAINING = """
    import logging
    logging.basicConfig(level=logging.INFO, format="%(name)s %(levelname)s %(message)s")
    from mjcartpole.learning.config import TrainConfig
    from mjcartpole.learning.training import train
    from mjcartpole.learning import kernels
    from mjcartpole.learning.methods import q_learning
    from mjcartpole.task import one_per_step
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
