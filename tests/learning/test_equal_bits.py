"""The compiled engine against the reference loop: the same bits, whatever is asked for."""

import dataclasses
import itertools

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from configs import TASKS, configs
from engines import (
    DIVERGING,
    ENGINES,
    REFERENCE,
    TOUCHING,
    edited,
    outcome,
    outcome_of,
    random_policy,
    resumed,
    to,
    write,
)
from mjcartpole import task
from mjcartpole.errors import SimulationError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.methods import METHODS
from mjcartpole.learning.presets import PRESETS
from mjcartpole.learning.training import train
from mjcartpole.physics.load import load_model
from nightly import at_night, examples, few

RUBBING = ('damping="0" frictionloss="0"', 'damping="0.2" frictionloss="0.05"')


LIMITED = ('type="slide"', 'type="slide" range="-0.1 0.2"')


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


def assert_engines_agree(config, cartpole=None):
    expected, found = (outcome(config, engine, cartpole) for engine in ENGINES)
    assert found == expected
    return found


FEW = ("reference", "fifths of steps", "RK4", "contacts", "another cart-pole")
"""Of all models, those whose steps differ most."""


@pytest.fixture(autouse=True, scope="module")
def _tasks():
    """The tasks that are drawn, for as long as they are."""
    for each in TASKS.values():
        task.register(each)
    yield
    for each in TASKS.values():
        if each is not task.CARTPOLE_V1:
            del task.TASKS[each.name]


# The others take seconds each to compile; their parts are compared in test_kernels.py.
@given(
    configs(at_night(tuple(METHODS), fast=("q-learning",))),
    st.floats(0, 1),
    st.tuples(*[st.sampled_from(ENGINES)] * 2),
)
@settings(max_examples=at_night(300, fast=10), suppress_health_check=list(HealthCheck))
def test_any_config_gives_the_same_bits_also_resumed(tmp_path, config, share, engines):
    found = assert_engines_agree(config)
    assert len(found["returns"]) == config.episodes
    episode = round(share * config.episodes)
    assert outcome_of(resumed(config, engines, episode, tmp_path)) == found


@pytest.mark.parametrize(
    ("preset", "backend"),
    few(
        [(name, "mujoco") for name in PRESETS]
        + [(name, "gym") for name in PRESETS if not {"model", "set"} & PRESETS[name].keys()],
        ("article-terminal", "gym"),
    ),
)
@pytest.mark.parametrize("changed", [False, True])
def test_the_presets_give_the_same_bits(preset, backend, changed):
    config = TrainConfig.preset(preset, backend=backend, episodes=100, seed=6)
    changes = {"ties": "random", "td_lambda": None} if changed else {}
    known = {name: value for name, value in changes.items() if name in config.fields()}
    assert_engines_agree(dataclasses.replace(config, **known))


@pytest.mark.parametrize(
    ("method", "backend"),
    few(
        itertools.product(METHODS, ("mujoco", "gym")),
        ("q-learning", "gym"),  # The others' parts are compared in test_kernels.py.
    ),
)
def test_every_method_gives_the_same_bits(method, backend):
    config = TrainConfig.preset("tuned", method=method, backend=backend, episodes=60, seed=2)
    if "ties" in config.fields():
        config = dataclasses.replace(config, ties="random")
    assert_engines_agree(config)


@pytest.mark.parametrize("backend", few(["mujoco", "gym"], "gym"))
def test_tiles_give_the_same_bits(backend):
    assert_engines_agree(TrainConfig(backend=backend, tilings=4, ties="random", episodes=30))


@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
@pytest.mark.parametrize("name", few(MODELS, "fifths of steps", "contacts"))
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
@examples(40)
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


@pytest.mark.parametrize("backend", ["mujoco", "gym"])
@pytest.mark.parametrize("seed", few([0, 3], 0))
def test_evaluations_are_the_same_episodes(backend, seed):
    policies = [
        random_policy(seed),
        random_policy(seed, bins=(1, 1, 1, 1)),
        train(TrainConfig(backend=backend, seed=seed, episodes=at_night(1500, fast=400))).policy,
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
@pytest.mark.parametrize("name", few(MODELS, *FEW))
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


@pytest.mark.parametrize("name", few(DIVERGING, "NaN, later"))
def test_diverging_physics_stop_evaluations_at_the_same_step(name):
    messages = []
    for engine in ENGINES:
        with pytest.raises(SimulationError, match=r"^episode \d+, step \d+: .* diverged") as error:
            evaluate(
                train(TrainConfig(episodes=200, seed=3, mirror=False, decay=0.5)).policy,
                model=load_model(DIVERGING[name]),
                engine=engine,
            )
        messages.append(str(error.value))
    assert messages[0] == messages[1]
