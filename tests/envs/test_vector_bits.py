"""The vector against single environments and gymnasium's own vector, bit for bit."""

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers.vector import RecordEpisodeStatistics
from hypothesis import given, settings
from hypothesis import strategies as st

from mjcartpole.envs.cartpole import CartPoleEnv
from mjcartpole.envs.vector import CartPoleVectorEnv
from mjcartpole.errors import (
    ConfigError,
)
from nightly import at_night, few
from vectors import ENV_ID, MODELS, run


@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
@pytest.mark.parametrize("name", few(MODELS, "all at once", "touching"))
@settings(max_examples=at_night(6, fast=3))
@given(
    seed=st.integers(0, 2**31),
    threads=st.sampled_from([1, 2, None]),
    far=st.booleans(),
    limit=st.integers(3, 40),
)
def test_each_environment_is_a_single_one_bit_for_bit(name, integrator, seed, threads, far, limit):
    n = 5
    arguments = {"model": MODELS[name], "integrator": integrator}
    envs = CartPoleVectorEnv(n, max_episode_steps=limit, threads=threads, **arguments)
    singles = [CartPoleEnv(**arguments) for _ in range(n)]
    generator = np.random.default_rng(seed)
    envs.reset(seed=seed)
    if far:
        # Where the stops are, and quick enough to reach them.
        envs.state = generator.uniform((2.1, 1, -0.1, -1), (2.3, 3, 0.1, 1), (n, 4)).T
    ages, restarting = np.zeros(n, int), np.zeros(n, bool)
    for single, state in zip(singles, envs.state.T, strict=True):
        single.state = state
    for _ in range(60):
        actions = generator.integers(0, 2, n)
        observations, rewards, terminations, truncations, _ = envs.step(actions)
        for i, single in enumerate(singles):
            if restarting[i]:
                single.reset()
                single.state = envs.state[:, i]
                ages[i] = 0
                assert (rewards[i], terminations[i], truncations[i]) == (0.0, False, False)
                continue
            observation, reward, terminated, _, _ = single.step(int(actions[i]))
            ages[i] += 1
            assert envs.state[:, i].tobytes() == single.state.tobytes()
            assert observations[i].tobytes() == observation.tobytes()
            assert (rewards[i], terminations[i]) == (reward, terminated)
            assert truncations[i] == (ages[i] >= limit)
        restarting = terminations | truncations


def test_the_models_of_the_comparison_do_what_their_names_say():
    """Else they would compare nothing."""

    def after(name, state):
        env = CartPoleEnv(model=MODELS[name])
        env.state = state
        for _ in range(3):
            env.step(1)
        return env.state

    quick = (2.3, 2.0, 0.0, 0.0)
    assert after("touching", quick)[0] < after("half steps", quick)[0] - 0.01
    still = (0.0, 1.0, 0.0, 0.0)
    assert after("limited, half steps", still)[1] < after("half steps", still)[1] - 0.1
    assert after("rubbing, quarter steps", still)[1] < after("half steps", still)[1] - 0.001
    assert CartPoleVectorEnv(model=MODELS["sleeping"])._simulation._batch.persistent


@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
@pytest.mark.parametrize("name", ["reference", "all at once"])
def test_threads_change_no_bit(name, integrator):
    results = []
    for threads in (1, 2, 3, None):
        envs = CartPoleVectorEnv(
            65, max_episode_steps=25, threads=threads, model=MODELS[name], integrator=integrator
        )
        run(envs, 60)
        results.append(envs.state.tobytes())
    assert len(set(results)) == 1


@pytest.mark.parametrize("sutton_barto", [False, True])
@pytest.mark.parametrize(
    ("integrator", "kinematics"), [("gym", "euler"), ("mujoco", "semi-implicit")]
)
@given(seed=st.integers(0, 2**31), n=st.integers(1, 12))
@settings(max_examples=at_night(8, fast=3))
def test_equal_to_gymnasiums_vector(sutton_barto, integrator, kinematics, seed, n):
    arguments = {"num_envs": n, "max_episode_steps": 30, "sutton_barto_reward": sutton_barto}
    envs = gymnasium.make_vec(ENV_ID, integrator=integrator, **arguments)
    reference = gymnasium.make_vec("CartPole-v1", **arguments)
    reference.unwrapped.kinematics_integrator = kinematics
    ours, theirs = run(envs, 100, seed), run(reference, 100, seed)
    np.testing.assert_array_equal(ours[0][0], theirs[0][0])
    endings = 0
    for mine, its in zip(ours[1:], theirs[1:], strict=True):
        np.testing.assert_allclose(mine[0], its[0], rtol=0, atol=1e-6)
        for a, b in zip(mine[1:], its[1:], strict=True):
            np.testing.assert_array_equal(a, b)
        assert [array.dtype for array in mine] == [array.dtype for array in its]
        assert [array.shape for array in mine] == [array.shape for array in its]
        endings += mine[2].sum() + mine[3].sum()
    assert endings >= 3 * n
    np.testing.assert_allclose(envs.state, reference.unwrapped.state, rtol=0, atol=1e-12)


def test_a_restart_takes_gymnasiums_draws_and_ignores_the_action():
    envs = gymnasium.make_vec(ENV_ID, num_envs=3, max_episode_steps=5)
    reference = gymnasium.make_vec("CartPole-v1", num_envs=3, max_episode_steps=5)
    for each in (envs, reference):
        each.reset(seed=11)
        for _ in range(5):
            *_, truncations, _ = each.step(np.ones(3, dtype=int))
        assert truncations.all()
        each.step(np.zeros(3, dtype=int))
    np.testing.assert_array_equal(envs.state, reference.unwrapped.state)


def test_the_state_is_read_and_set_as_in_gymnasiums_vector():
    envs, reference = CartPoleVectorEnv(3), gymnasium.make_vec("CartPole-v1", num_envs=3)
    for each in (envs, reference):
        each.reset(seed=5)
    assert envs.state.dtype == np.float64
    np.testing.assert_array_equal(envs.state, reference.unwrapped.state)
    values = np.array([[0.1, 0.2, 0.03], [0.4, -0.1, 0.0], [0.01, 0.3, 0.0], [0.0, 0.0, 0.1]])
    envs.state = values
    expected = values.tolist()
    values[0] = 9.0
    assert envs.state.tolist() == expected
    with pytest.raises(ValueError, match="read-only"):
        envs.state[1] = 9.0
    with pytest.raises(
        ConfigError, match=r"states have the shape \(4, 3\).*not the shape \(3, 4\)"
    ):
        envs.state = np.zeros((3, 4))


@pytest.mark.parametrize("n", [1, 7])
def test_gymnasiums_statistics_count_the_same(n):
    found = []
    for name in (ENV_ID, "CartPole-v1"):
        envs = RecordEpisodeStatistics(gymnasium.make_vec(name, num_envs=n, max_episode_steps=20))
        run(envs, 120)
        found.append((list(envs.return_queue), list(envs.length_queue)))
    assert len(found[0][0]) >= 5 * n
    assert found[0] == found[1]
