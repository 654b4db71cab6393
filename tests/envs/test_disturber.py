"""Disturbances in environments: all of them agree, bit for bit."""

import copy
import json
import pickle
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import mjcartpole  # noqa: F401 - registers the environments
from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.envs.backend import make_env
from mjcartpole.errors import ConfigError, ResetNeededError

ID = "mjcartpole/CartPole-v1"
LENGTHS = {"pole.length": (0.5, 1.5), "cart.mass": (0.5, 2.0, "log"), "force": (8, 10, 12)}
EACH: list[dict[str, Any]] = [
    {"delay": 2},
    {"hold": 0.3, "drop": 0.2},
    {"lag": 0.05},
    {"force_noise": 3.0},
    {"push": ["0.3@0.1s", "0.2@~0.2s"]},
    {"sensor_delay": 3},
    {"noise": (0.01, 0.1, 0.01, 0.1)},
    {"bias": 0.02, "quantize": 0.01},
    {"observe_actions": 3},
    {"vary": LENGTHS},
    {"vary": LENGTHS, "pool": 3, "widen": 5, "observe_context": True, "delay": 1, "noise": 0.01},
]
MORE: list[dict[str, Any]] = [
    {},
    {"model": "twopoles", "integrator": "mujoco"},
    {"task": "SwingUp-v0", "observation": "trig"},
]


def played(env: Any, seed: int, steps: int = 120, *, act: Any = None) -> list[Any]:
    """All that an environment gives, over some episodes."""
    rng = np.random.default_rng(seed)
    observation, info = env.reset(seed=seed)
    found = [(observation.tobytes(), str(info))]
    for _ in range(steps):
        action = int(rng.random() < 0.5)
        result = env.step(action if act is None else act(action))
        found.append((result[0].tobytes(), *result[1:4]))
        if result[2] or result[3]:
            observation, info = env.reset()
            found.append((observation.tobytes(), str(info)))
    return found


@pytest.mark.parametrize("given", EACH, ids=str)
def test_a_seed_gives_the_same_again(given: dict[str, Any]) -> None:
    env = gymnasium.make(ID, **given)
    first = played(env, 3)
    assert played(env, 3) == first
    assert played(gymnasium.make(ID, disturbances=given), 3) == first
    assert played(gymnasium.make(ID, disturbances=Disturbances(**given)), 3) == first
    assert played(env, 4) != first


@pytest.mark.parametrize("given", EACH, ids=str)
def test_a_disturbance_has_an_effect_and_starts_stay(given: dict[str, Any]) -> None:
    plain, env = gymnasium.make(ID), gymnasium.make(ID, **given)
    assert played(env, 3) != played(plain, 3)
    plain.reset(seed=5), env.reset(seed=5)
    assert (plain.unwrapped.state == env.unwrapped.state).all()


@pytest.mark.parametrize("more", MORE, ids=str)
@pytest.mark.parametrize("given", EACH, ids=str)
def test_a_vector_of_one_is_the_single_environment(
    given: dict[str, Any], more: dict[str, Any]
) -> None:
    if "twopoles" in more.values() and "vary" in given:
        given = {**given, "vary": {"pole1.length": (0.4, 0.6), "cart.mass": (0.5, 2)}}
    name = f"mjcartpole/{more.get('task', 'CartPole-v1')}"
    settings = {**{k: v for k, v in more.items() if k != "task"}, **given}
    single = gymnasium.make(name, **settings)
    many = gymnasium.make_vec(name, num_envs=1, vectorization_mode="vector_entry_point", **settings)
    assert many.single_observation_space == single.observation_space
    rng, expected = np.random.default_rng(0), single.reset(seed=7)
    observations, infos = many.reset(seed=7)
    for _ in range(150):
        assert observations[0].tobytes() == expected[0].tobytes()
        if len(expected) == 2:
            drawn = {
                key: value[0] for key, value in infos.get("context", {}).items() if key[0] != "_"
            }
            assert drawn == expected[1].get("context", {})
        action = int(rng.random() < 0.5)
        over = len(expected) == 5 and (expected[2] or expected[3])
        expected = single.reset() if over else single.step(action)
        observations, rewards, terminated, truncated, infos = many.step(np.array([action]))
        if len(expected) == 5:
            assert (rewards[0], terminated[0], truncated[0]) == expected[1:4]


def test_environments_of_a_vector_are_disturbed_apart_and_move_as_single_ones() -> None:
    given = {"vary": LENGTHS, "noise": 0.01, "force_noise": 1.0, "delay": 1}
    many = gymnasium.make_vec(ID, num_envs=5, **given)
    many.reset(seed=3)
    contexts = many.reset(seed=3)[1]["context"]
    assert len(set(contexts["pole.length"].tolist())) == 5
    for index in range(5):
        context = {name: float(contexts[name][index]) for name in LENGTHS}
        env = gymnasium.make(ID, edits=context).unwrapped
        many.reset(seed=3)
        env.reset()
        env.state = many.unwrapped.state[:, index]
        # The delay leaves the first push out; the force is noise of 1 N, which moves velocities.
        many.step(np.ones(5, np.int64))
        env.simulation.step(0.0)
        gap = np.abs(many.unwrapped.state[:, index] - env.state)
        assert gap[0] < 1e-12
        assert 0 < gap[1] < 0.2


def test_both_backends_are_disturbed_alike() -> None:
    given = Disturbances(
        delay=1, noise=0.01, lag=0.03, push="0.2@~0.5s", hold=0.1, observe_actions=1
    )
    ours, theirs = (make_env(each, disturbances=given) for each in ("mujoco", "gym"))
    ours.reset(seed=1), theirs.reset(seed=1)
    for step in range(30):
        here, there = ours.step(step % 2), theirs.step(step % 2)
        np.testing.assert_allclose(here[0], there[0], rtol=1e-5, atol=1e-6)
        assert here[1:4] == there[1:4]
        assert theirs.observation_space.contains(there[0])


def test_episodes_of_varied_physics_are_those_of_the_edits_they_name() -> None:
    env = gymnasium.make(ID, vary=LENGTHS)
    rng, contexts = np.random.default_rng(2), set()
    for number in range(12):
        info = env.reset(seed=1 if number == 0 else None)[1]
        contexts.add(tuple(info["context"].values()))
        other = gymnasium.make(ID, edits=info["context"])
        other.reset()
        other.unwrapped.state = env.unwrapped.state
        over = False
        while not over:
            action = int(rng.random() < 0.5)
            here, there = env.step(action), other.step(action)
            assert here[0].tobytes() == there[0].tobytes()
            over = here[2]
    assert len(contexts) == 12


def test_the_context_can_be_seen() -> None:
    env = gymnasium.make(ID, vary=LENGTHS, observe_context=True)
    observation, info = env.reset(seed=0)
    assert observation.shape == (7,)
    assert observation[4:].tolist() == np.float32([*info["context"].values()]).tolist()
    assert env.step(0)[0][4:].tolist() == observation[4:].tolist()
    assert env.observation_space.contains(observation)


@pytest.mark.parametrize(
    "copied", [copy.deepcopy, copy.copy, lambda e: pickle.loads(pickle.dumps(e))]
)
@pytest.mark.parametrize("given", EACH, ids=str)
def test_a_copy_goes_on_as_the_original_would(given: dict[str, Any], copied: Any) -> None:
    env = gymnasium.make(ID, **given).unwrapped
    env.reset(seed=2)
    for _ in range(5):
        env.step(1)
    twin = copied(env)
    here = [env.step(0)[0].tobytes() for _ in range(5)]
    there = [twin.step(0)[0].tobytes() for _ in range(5)]
    assert here == there


@pytest.mark.parametrize("name", ["CartPole-v1", "SwingUp-v0", "Continuous-v0"])
@pytest.mark.parametrize("given", EACH, ids=str)
def test_gymnasiums_checks_are_silent(name: str, given: dict[str, Any]) -> None:
    env = gymnasium.make(f"mjcartpole/{name}", **given)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*A Box observation space m.* value is -?infinity")
        check_env(env.unwrapped, skip_render_check=True)
    spec = json.loads(env.spec.to_json())
    again = gymnasium.make(gymnasium.envs.registration.EnvSpec.from_json(json.dumps(spec)))
    assert again.unwrapped.disturber.disturbances == env.unwrapped.disturber.disturbances


def test_a_step_needs_a_reset() -> None:
    with pytest.raises(ResetNeededError):
        gymnasium.make(ID, noise=0.1, disable_env_checker=True).unwrapped.step(0)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"vary": {"pole.lenght": (1, 2)}}, "did you mean 'pole.length'"),
        ({"vary": {"pole.length": (-1, 2)}}, "more than 0"),
        ({"vary": {"timestep": (0.001, 0.0301)}}, "does not divide"),
        ({"noise": -1}, "0 or more"),
        ({"vary": {"timestep": (0.01, 0.02)}}, "does not divide"),
        ({"vary": {"force": (8, 12)}, "edits": {"force": 9}}, "is set, and varies"),
        ({"delay": 500}, "no shorter than an episode"),
        ({"disturbances": {"dealy": 2}}, "did you mean 'delay'"),
        ({"disturbances": {"delay": 2}, "delay": 1}, "give one"),
    ],
)
def test_what_makes_no_sense_is_refused_when_it_is_made(given: dict[str, Any], said: str) -> None:
    for make in (gymnasium.make, gymnasium.make_vec):
        with pytest.raises(ConfigError, match=said):
            make(ID, **given)


def test_a_state_that_is_set_leaves_nothing_of_the_motion_before() -> None:
    env = gymnasium.make(ID, delay=1, disable_env_checker=True).unwrapped
    env.reset(seed=0)
    env.step(1)
    env.state = (0.0, 0.0, 0.0, 0.0)
    assert env.step(0)[0].tolist() == [0.0, 0.0, 0.0, 0.0], "no push yet"


@pytest.mark.parametrize("given", EACH, ids=str)
def test_dm_control_is_disturbed_as_gymnasium_is(given: dict[str, Any]) -> None:
    dm = pytest.importorskip("mjcartpole.envs.dm", exc_type=ImportError)
    ours = gymnasium.make(ID, integrator="mujoco", **given)
    theirs = dm.load(seed=3, discrete=True, **given)
    theirs.observation_spec()
    rng, seed = np.random.default_rng(1), 3
    for _ in range(3):
        (expected, info), step = ours.reset(seed=seed), theirs.reset()
        seed = None
        assert theirs.task.disturber.context == info.get("context", {})
        over = False
        while not over:
            theirs.observation_spec()
            found = step.observation
            state = np.ravel(np.column_stack([found["position"], found["velocity"]]))
            besides = [*found.get("actions", ()), *found.get("context", ())]
            assert np.float32([*state, *besides]).tobytes() == expected.tobytes()
            if step.last():
                break
            action = int(rng.random() < 0.5)
            expected, _, over, _, _ = ours.step(action)
            step = theirs.step(action)
        assert step.last()


def test_a_seed_of_dm_control_disturbs_alike_again() -> None:
    dm = pytest.importorskip("mjcartpole.envs.dm", exc_type=ImportError)
    env = dm.load(seed=3, noise=0.1)
    first = env.reset().observation["position"]
    env.task.random.seed(3)
    assert env.reset().observation["position"].tolist() == first.tolist()


def test_what_is_edited_for_an_episode_is_not_drawn() -> None:
    env = gymnasium.make(ID, vary=LENGTHS, observe_context=True)
    _, info = env.reset(seed=0, options={"edits": {"pole.length": 1.25, "gravity": 3.7}})
    assert info["context"]["pole.length"] == 1.25
    assert (env.unwrapped.length, env.unwrapped.gravity) == (0.625, 3.7)
    assert env.reset(seed=0)[1]["context"]["pole.length"] != 1.25
    assert env.unwrapped.gravity == 9.8


def test_names_of_a_vector_are_those_of_each_environment() -> None:
    many = gymnasium.make_vec(ID, num_envs=3, vary=LENGTHS).unwrapped
    context = many.reset(seed=2)[1]["context"]
    assert many.length == tuple(context["pole.length"] / 2)
    assert many.masscart == tuple(context["cart.mass"])
    assert gymnasium.make_vec(ID, num_envs=3, delay=1).unwrapped.length == 0.5


def test_a_delay_is_held_against_the_length_of_a_vectors_episodes() -> None:
    gymnasium.make_vec(ID, max_episode_steps=1_000, delay=600)
    with pytest.raises(ConfigError, match="no shorter than an episode"):
        gymnasium.make_vec(ID, max_episode_steps=10, delay=10)
