"""CartPole-v1 for dm_control users."""

import copy
import doctest
import pickle
import subprocess
import sys

import gymnasium
import mujoco
import numpy as np
import pytest

import mjcartpole
from mjcartpole.errors import ConfigError, ModelNotFoundError
from mjcartpole.physics.load import load_model

dm = pytest.importorskip("mjcartpole.envs.dm", exc_type=ImportError)
# They come along with dm_control.
from absl.testing import absltest  # noqa: E402
from dm_env import specs, test_utils  # noqa: E402

FRICTION = """<mujoco><option gravity="0 0 -9.8" timestep="0.005" integrator="implicitfast"/>
<worldbody><body name="wagon">
<joint name="rail" type="slide" axis="1 0 0" frictionloss="0.4" damping="0.1"/>
<geom name="wagon" type="box" size=".2 .1 .1" mass="1"/>
<body name="stick"><joint name="pin" type="hinge" axis="0 1 0" frictionloss="0.001"/>
<geom name="stick" type="capsule" fromto="0 0 0 0 0 1" size=".03" mass=".1"/></body></body>
</worldbody>
<actuator><motor name="push" joint="rail" gear="20" ctrllimited="true" ctrlrange="-0.5 0.5"/>
</actuator></mujoco>"""


class TestReference(test_utils.EnvironmentTestMixin, absltest.TestCase):
    """dm_env's own tests, with forces."""

    def make_object_under_test(self):
        return dm.load("balance", seed=0)

    def make_action_sequence(self):
        """Long enough for the pole to fall, and for what comes after."""
        for _ in range(40):
            yield np.array([1.0])


class TestDiscrete(TestReference):
    """The same with actions 0 and 1."""

    def make_object_under_test(self):
        return dm.load("balance", seed=0, discrete=True)

    def make_action_sequence(self):
        for _ in range(40):
            yield 1


class TestForeign(TestReference):
    """The same on another model, with flat observations."""

    def make_object_under_test(self):
        flat = {"flat_observation": True}
        return dm.load("balance", model=FRICTION, seed=0, environment_kwargs=flat)

    def make_action_sequence(self):
        for _ in range(100):
            yield np.array([0.5])


def steady(position, velocity):
    """A hand-made controller that never fails."""
    (x, theta), (x_dot, theta_dot) = position, velocity
    return int(theta + 0.5 * theta_dot + 0.02 * x + 0.05 * x_dot > 0)


def test_specs():
    env = dm.load("balance")
    spec = env.action_spec()
    assert (spec.shape, spec.dtype) == ((1,), np.float64)
    assert (spec.minimum.item(), spec.maximum.item()) == (-1.0, 1.0)
    assert list(env.observation_spec()) == ["position", "velocity"]
    assert env.control_timestep() == 0.02
    assert spec.minimum.shape == spec.maximum.shape == (1,)
    discrete = dm.load("balance", discrete=True).action_spec()
    assert isinstance(discrete, specs.DiscreteArray)
    assert discrete.num_values == 2


def test_a_steady_hand_reaches_the_time_limit():
    env = dm.load("balance", seed=4, discrete=True)
    step, steps = env.reset(), 0
    while not step.last():
        step = env.step(steady(**step.observation))
        assert step.reward == 1.0
        assert step.discount == 1.0
        steps += 1
    assert steps == 500
    assert env.step(0).first()


def test_a_fallen_pole_ends_the_episode_with_discount_0():
    env = dm.load("balance", seed=4)
    step = env.reset()
    while not step.last():
        step = env.step([-1.0])
    assert (step.reward, step.discount) == (1.0, 0.0)
    assert np.abs(env.physics.pole_angles()) > 0.2094


def test_falling_on_the_last_step_counts_as_falling():
    env = dm.load("balance", seed=4)
    steps, step = 0, env.reset()
    while not step.last():
        step, steps = env.step([-1.0]), steps + 1
    short = dm.load("balance", seed=4, time_limit=steps * 0.02)
    step = short.reset()
    while not step.last():
        step = short.step([-1.0])
    assert short.task.steps == steps
    assert step.discount == 0.0


@pytest.mark.parametrize("model", ["cartpole", FRICTION])
def test_states_are_those_of_our_environment_bit_for_bit(model):
    theirs = dm.load("balance", model=model, seed=3, discrete=True)
    ours = gymnasium.make("mjcartpole/CartPole-v1", model=model, integrator="mujoco").unwrapped
    rng, seed = np.random.default_rng(0), 3
    for _ in range(20):
        theirs.reset()
        ours.reset(seed=seed)
        seed, over = None, False
        while not over:
            assert theirs.physics.state.tobytes() == ours.state.tobytes()
            action = int(rng.integers(2))
            step = theirs.step(action)
            _, _, over, _, _ = ours.step(action)
            assert step.last() == over
        assert theirs.physics.state.tobytes() == ours.state.tobytes()


@pytest.mark.parametrize("model", ["cartpole", FRICTION])
def test_states_are_those_of_mj_step_bit_for_bit(model):
    env, cartpole = dm.load("balance", model=model, seed=5), load_model(model)
    data = mujoco.MjData(cartpole.model)
    env.reset()
    data.qpos[:], data.qvel[:] = env.physics.data.qpos, env.physics.data.qvel
    low, high = sorted(cartpole.controls)
    for control in np.random.default_rng(1).uniform(low, high, size=30):
        env.step([control])
        data.ctrl[0] = control
        mujoco.mj_step(cartpole.model, data, cartpole.substeps)
        assert env.physics.data.qpos.tobytes() == data.qpos.tobytes()
        assert env.physics.data.qvel.tobytes() == data.qvel.tobytes()
        if env._reset_next_step:
            break


def test_the_ends_of_the_range_are_the_two_actions():
    forces, actions = dm.load("balance", seed=1), dm.load("balance", seed=1, discrete=True)
    forces.reset(), actions.reset()
    for action, force in ((1, 1.0), (0, -1.0), (1, 1e6), (0, -1e6)):
        forces.step(np.array([force]))
        actions.step(action)
        assert forces.physics.state.tobytes() == actions.physics.state.tobytes()


def test_a_seed_repeats_and_no_seed_does_not():
    first, again, other, free = (
        dm.load("balance", seed=seed).reset().observation["position"].tolist()
        for seed in (7, 7, 8, None)
    )
    assert first == again != other
    assert free not in (first, other)
    expected, _ = mjcartpole.CartPoleEnv().reset(seed=7)
    assert np.float32(first).tolist() == expected[[0, 2]].tolist()


def positions(env):
    return env.reset().observation["position"].tolist()


def test_a_task_is_seeded_as_those_of_dm_controls_suite():
    env = dm.load("balance", seed=5)
    first, second = positions(env), positions(env)
    env.task.random.seed(5)
    assert [positions(env), positions(env)] == [first, second]
    # Wrappers put a generator of their own in its place.
    starts = []
    for _ in range(2):
        env.task._random = np.random.RandomState(3)
        assert env.task.random is env.task._random
        starts.append(positions(env))
    assert starts[0] == starts[1] != first
    given = dm.Balance(load_model(), random=np.random.RandomState(3), limit=9, discrete=False)
    assert given.random.uniform() == np.random.RandomState(3).uniform()


@pytest.mark.parametrize("how", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_goes_on_bit_for_bit(how):
    env = dm.load("balance", model=FRICTION, seed=5)
    env.reset()
    for _ in range(4):
        env.step([0.3])
    copied = how(env)
    for _ in range(60):
        mine, its = env.step([0.1]), copied.step([0.1])
        assert mine.observation["position"].tobytes() == its.observation["position"].tobytes()
    copied.task.random.seed(1)
    env.task.random.seed(1)
    assert positions(copied) == positions(env)
    assert env.physics.copy().cart_position() == env.physics.cart_position()


def test_rewards_are_shown_where_that_is_wanted():
    plain, shown = (dm.load("balance", seed=0, visualize_reward=each) for each in (False, True))
    for env in (plain, shown):
        env.reset()
    own, after = plain.physics.model.geom_rgba, shown.physics.model.geom_rgba
    changed = (own != after).any(axis=1)
    names = {shown.physics.model.id2name(geom, "geom") for geom in changed.nonzero()[0]}
    assert "pole" in names
    assert not any("cart" in name for name in names)
    np.testing.assert_array_equal(after[changed, :3], np.float32([dm.HIGHLIGHT] * changed.sum()))
    shown.physics.show(-1.0)
    np.testing.assert_array_equal(own, after)
    with pytest.raises(ConfigError, match="True or False"):
        shown.task.visualize_reward = 1


def test_edits():
    env = dm.load("balance", edits={"pole.length": 2.0})
    assert env.physics.cartpole.name == "cartpole with pole.length=2.0"
    long, short = env.physics.model.body_ipos[-1], dm.load().physics.model.body_ipos[-1]
    assert long[2] == 2 * short[2]


def test_the_model_of_others_is_not_touched():
    cartpole = load_model("cartpole")
    dm.load("balance", model=cartpole).physics.model.opt.gravity[:] = 0
    assert cartpole.model.opt.gravity[2] == -9.8


@pytest.mark.parametrize("settings", [{"discrete": False}, {"discrete": True}])
def test_dm_controls_viewer_can_run_it(settings):
    """The part of the viewer that needs no window: its runtime steps and restarts the env."""
    from dm_control.viewer import runtime

    env = dm.load("balance", seed=0, **settings)
    action = 1 if settings["discrete"] else np.array([1.0])
    runner = runtime.Runtime(env, lambda step: action)
    runner.restart()
    for _ in range(60):
        runner.tick(time_elapsed=0.05, paused=False)
    assert env.physics.time() > 0
    idle = runtime.Runtime(env)
    idle.restart()
    idle.tick(time_elapsed=0.02, paused=False)
    assert runner.state is not None


@pytest.mark.parametrize("action", [[np.nan], [1.0, 2.0], []])
def test_refused_controls(action):
    env = dm.load("balance")
    env.reset()
    with pytest.raises(ConfigError, match="one finite control"):
        env.step(action)


@pytest.mark.parametrize("action", [2, -1, 0.5, None])
def test_refused_actions(action):
    env = dm.load("balance", discrete=True)
    env.reset()
    with pytest.raises(ConfigError, match="the actions are 0 and 1"):
        env.step(action)


def test_refused_settings():
    with pytest.raises(ConfigError, match="available: balance"):
        dm.load("swingup")
    with pytest.raises(ConfigError, match="time_limit"):
        dm.load("balance", time_limit=0)
    with pytest.raises(ConfigError, match="seed"):
        dm.load("balance", seed=-1)
    with pytest.raises(ModelNotFoundError):
        dm.load("balance", model="carpole")


def test_without_a_time_limit_it_goes_on():
    env = dm.load("balance", seed=4, discrete=True, time_limit=float("inf"))
    step = env.reset()
    for _ in range(600):
        step = env.step(steady(**step.observation))
    assert not step.last()


def test_doctests():
    assert doctest.testmod(dm).failed == 0


def test_importing_the_package_does_not_import_dm_control():
    code = "import sys, mjcartpole, mjcartpole.envs; print('dm_control' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def test_importing_it_is_quiet():
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", "import mjcartpole.envs.dm"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stderr == ""


def test_changed_rules_are_those_of_the_environment():
    rules = {"x_limit": 0.5, "theta_limit": 0.4, "start_angle": -0.1, "reward": "upright"}
    env = dm.load(seed=5, discrete=True, **rules)
    ours = gymnasium.make("mjcartpole/CartPole-v1", integrator="mujoco", **rules)
    ours.reset(seed=5)
    env.reset()
    over = False
    while not over:
        step, (_, reward, over, _, _) = env.step(0), ours.step(0)
        np.testing.assert_array_equal(env.physics.state, ours.unwrapped.state)
        assert (step.reward, step.discount == 0.0) == (reward, over)
    with pytest.raises(ConfigError, match="x_limit must be"):
        dm.load(x_limit=-1)
