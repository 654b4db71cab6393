"""The environment on its own; what it shares with CartPole-v1 is in tests/parity."""

import doctest
import re
import warnings

import gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from mjcartpole.envs import cartpole
from mjcartpole.envs.cartpole import CartPoleEnv
from mjcartpole.envs.vector import CartPoleVectorEnv
from mjcartpole.errors import (
    ConfigError,
    InvalidActionError,
    ModelNotFoundError,
    NotACartPoleError,
    RenderError,
    ResetNeededError,
    SimulationError,
)
from mjcartpole.physics.load import load_model
from mjcartpole.physics.simulation import Simulation

ENV_ID = "mjcartpole/CartPole-v1"
REFERENCE = load_model("cartpole").xml


@pytest.fixture
def env():
    env = CartPoleEnv()
    env.reset(seed=0)
    return env


def test_the_specification_in_the_docstring_holds():
    assert doctest.testmod(cartpole).failed == 0
    assert doctest.testmod(cartpole).attempted > 5


def complaints(env, **options):
    """What gymnasium's checker has to say."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(env.unwrapped, **options)
    env.close()
    return [str(warning.message) for warning in caught]


@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
def test_gymnasiums_checker_has_nothing_to_say(integrator):
    """But for the unbounded velocities, which it remarks on in CartPole-v1 as well."""
    ours = complaints(gymnasium.make(ENV_ID, render_mode="rgb_array", integrator=integrator))
    assert ours == complaints(gymnasium.make("CartPole-v1"), skip_render_check=True)
    assert all("infinity. This is probably too" in complaint for complaint in ours)


@pytest.mark.parametrize("action", [0, 1, np.int64(1), np.int32(0), np.array(1), True])
def test_actions_that_discrete_contains(env, action):
    assert env.action_space.contains(action)
    before = env.state[1]
    env.step(action)
    assert (env.state[1] > before) == (action == 1)


@pytest.mark.parametrize("action", [2, -1, 1.0, 0.5, "1", None, np.array([1]), np.int64(2), [1]])
def test_actions_that_discrete_does_not_contain(env, action):
    before = env.state
    with pytest.raises(InvalidActionError, match="invalid"):
        env.step(action)
    np.testing.assert_array_equal(env.state, before)


def test_a_step_needs_a_reset():
    env = CartPoleEnv()
    assert env.state is None
    with pytest.raises(ResetNeededError, match="Call reset before"):
        env.step(0)
    with pytest.raises(gymnasium.error.ResetNeeded):
        gymnasium.make(ENV_ID).step(0)


def test_the_state_is_read_and_set(env):
    env.state = (0.1, 0.2, 0.03, 0.4)
    assert env.state.dtype == np.float64
    np.testing.assert_array_equal(env.state, [0.1, 0.2, 0.03, 0.4])
    env.state[0] = 99.0
    np.testing.assert_array_equal(env.state, [0.1, 0.2, 0.03, 0.4])


def test_a_state_set_before_any_reset_can_be_stepped():
    env = CartPoleEnv()
    env.state = (0.0, 0.0, 0.0, 0.0)
    observation, *_ = env.step(1)
    assert observation[1] > 0


def test_observations_are_new_arrays(env):
    first, *_ = env.step(1)
    kept = first.copy()
    env.step(1)
    np.testing.assert_array_equal(first, kept)


def test_observations_belong_to_the_caller(env):
    """Writing into one changes nothing else, and it holds no other array's memory."""
    for observation in (env.reset()[0], env.step(1)[0]):
        assert observation.dtype == np.float32
        assert observation.shape == (4,)
        assert observation.flags.owndata
        state = env.state
        observation[:] = 7.0
        np.testing.assert_array_equal(env.state, state)
    assert np.abs(env.step(1)[0]).max() < 7.0


def test_a_subclass_may_build_on_step_and_on_reset():
    class Paid(CartPoleEnv):
        def reset(self, **arguments):
            observation, info = super().reset(**arguments)
            return observation, info | {"lean": float(self.state[2])}

        def step(self, action):
            observation, reward, *rest = super().step(action)
            return observation, reward + 1.0, *rest

    env = Paid()
    assert env.reset(seed=0)[1] == {"lean": env.state[2]}
    assert env.step(1)[1] == 2.0


def test_the_model_argument_takes_names_paths_text_and_specs(tmp_path):
    heavier = REFERENCE.replace('mass="0.1"', 'mass="0.3"')
    path = tmp_path / "heavier.xml"
    path.write_text(heavier, encoding="utf-8")
    results = []
    for source in (path, str(path), heavier, mujoco.MjSpec.from_string(heavier)):
        env = gymnasium.make(ENV_ID, model=source)
        env.reset(seed=1)
        results.append(env.step(1)[0].tolist())
    assert results[0] == results[1] == results[2] == results[3]
    env = gymnasium.make(ENV_ID)
    env.reset(seed=1)
    assert env.step(1)[0].tolist() != results[0]


def test_what_is_edited_has_its_effect():
    def push(old, new):
        text, count = re.subn(old, new, REFERENCE, count=1)
        assert count == 1
        env = CartPoleEnv(model=text)
        env.state = (0.0, 0.0, 0.1, 0.0)
        env.step(1)
        return env.state

    usual = push("ZZZ|cartpole", "cartpole")
    assert push('gear="10"', 'gear="20"')[1] > 1.9 * usual[1]
    assert push('gravity="0 0 -9.8"', 'gravity="0 0 -1.62"')[3] < usual[3]
    assert push('mass="1.0"', 'mass="4.0"')[1] < 0.3 * usual[1]


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"model": "nothing"}, ModelNotFoundError, "no model is called 'nothing'"),
        ({"integrator": "rk4"}, ConfigError, "available: gym, mujoco"),
        ({"render_mode": "ansi"}, ConfigError, "available: None, 'human', 'rgb_array'"),
    ],
)
def test_arguments_that_make_no_sense(arguments, error, message):
    with pytest.raises(error, match=message):
        CartPoleEnv(**arguments)


def test_unknown_arguments_are_refused():
    with pytest.raises(TypeError, match="colour"):
        CartPoleEnv(colour="red")


def test_a_diverging_model_is_an_error_and_not_an_observation():
    massless = REFERENCE.replace('mass="1.0"', 'mass="1e-12"').replace('gear="10"', 'gear="1e9"')
    env = CartPoleEnv(model=massless)
    env.reset(seed=0)
    with pytest.raises(SimulationError, match="diverged"):
        for _ in range(3):
            observation, *_ = env.step(1)
            assert np.isfinite(observation).all()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("which", [{1}, {3}, {1, 3}])
def test_a_velocity_that_is_no_number_is_an_error_at_once(bad, which, env):
    """The positions are still good ones: explicit Euler moved them by the old velocities."""
    simulation = Simulation(load_model())
    step = simulation.step

    def broken(control):
        step(control)
        simulation.data.qvel[:] = [bad if place in which else 0.0 for place in (1, 3)]
        return tuple(simulation.state.tolist())

    env.simulation, env._move = simulation, broken
    env.state = np.zeros(4)
    with pytest.raises(SimulationError, match="diverged"):
        env.step(1)


def test_pictures_have_the_size_that_was_asked_for():
    env = gymnasium.make(ENV_ID, render_mode="rgb_array", width=320, height=200)
    env.reset(seed=0)
    first = env.render()
    assert first.shape == (200, 320, 3)
    assert first.dtype == np.uint8
    assert first.std() > 5
    for _ in range(8):
        env.step(1)
    assert np.abs(env.render().astype(int) - first).max() > 50
    env.close()


@pytest.mark.parametrize("mode", ["rgb_array", "human", None])
def test_an_unknown_camera_is_refused_with_those_that_are_there(mode):
    with pytest.raises(RenderError, match=r"moon.*side"):
        CartPoleEnv(render_mode=mode, camera="moon")


@pytest.mark.parametrize("size", [{"width": 0}, {"height": -5}, {"width": 10**6}, {"height": 1.5}])
def test_a_size_that_makes_no_sense_is_refused(size):
    with pytest.raises(RenderError, match="no size of a picture"):
        CartPoleEnv(**size)


def test_a_window_takes_no_size():
    with pytest.raises(ConfigError, match="a window has the size"):
        CartPoleEnv(render_mode="human", width=320)


def test_a_model_without_our_cameras_can_be_stepped_and_drawn():
    model = REFERENCE.replace('name="side"', 'name="mine"')
    env = CartPoleEnv(model=model, render_mode="rgb_array")
    env.reset(seed=0)
    assert env.step(1)[1] == 1.0
    assert env.render().std() > 0
    env.close()
    with pytest.raises(RenderError, match="available: mine, follow"):
        CartPoleEnv(model=model, render_mode="rgb_array", camera="follows")


def test_rendering_without_a_mode_warns():
    env = gymnasium.make(ENV_ID).unwrapped
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="without specifying any render mode"):
        assert env.render() is None


def test_rendering_before_reset_gives_nothing():
    assert CartPoleEnv(render_mode="rgb_array").render() is None


def test_a_window_without_a_screen_is_a_word_and_no_more(monkeypatch, caplog):
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    env = CartPoleEnv(render_mode="human")
    env.reset(seed=0)
    assert env.step(1)[1] == 1.0
    assert len(caplog.records) == 1
    env.close()


@pytest.mark.parametrize("mode", ["human", "rgb_array", None])
def test_a_window_and_nothing_else_is_drawn_at_every_reset_and_step(mode):
    shown = []

    class Watched(CartPoleEnv):
        def render(self):
            shown.append(self.state[2])

    env = Watched(render_mode=mode)
    env.reset(seed=0)
    env.step(1)
    env.step(1)
    assert len(set(shown)) == (3 if mode == "human" else 0)


def test_closing_twice_is_fine():
    env = CartPoleEnv(render_mode="rgb_array")
    env.reset(seed=0)
    env.render()
    env.close()
    env.close()
    assert env.render() is not None
    env.close()


def test_record_video_works(tmp_path):
    pytest.importorskip("moviepy", reason="gymnasium's RecordVideo needs moviepy")
    env = gymnasium.make(ENV_ID, render_mode="rgb_array")
    env = gymnasium.wrappers.RecordVideo(env, str(tmp_path / "videos"))
    env.reset(seed=0)
    while not env.step(1)[2]:
        pass
    env.close()
    assert list(tmp_path.rglob("*.mp4"))


@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
def test_a_control_step_can_be_the_files_own(integrator):
    """0.015 s does not divide 0.02 s."""
    odd = REFERENCE.replace('timestep="0.02"', 'timestep="0.015"')
    with pytest.raises(NotACartPoleError, match="does not divide"):
        CartPoleEnv(model=odd)
    env = CartPoleEnv(model=odd, own_timestep=True, integrator=integrator)
    assert env.metadata["render_fps"] == 67
    assert CartPoleEnv.metadata["render_fps"] == 50
    env.reset(seed=0)
    env.state = (0.0, 1.0, 0.0, 0.0)
    x, x_dot = env.step(1)[0][:2]
    assert x == pytest.approx(0.015 * (1.0 if integrator == "gym" else x_dot), rel=1e-6)
    vector = CartPoleVectorEnv(2, model=odd, own_timestep=True, integrator=integrator)
    vector.reset(seed=0)
    vector.state = [(0.0, 0.0), (1.0, 1.0), (0.0, 0.0), (0.0, 0.0)]
    assert vector.step([1, 1])[0][1][0] == x


def test_making_one_simulates_nothing_and_making_many_compiles_once():
    first, second = CartPoleEnv(), CartPoleEnv()
    assert first._simulation is None
    assert first.simulation.model is not second.simulation.model
    assert first.simulation.cartpole.model is not second.simulation.cartpole.model
    first.simulation.model.opt.gravity[2] = first.simulation.cartpole.model.opt.gravity[2] = 0.0
    third = CartPoleEnv()
    second.state = third.state = (0.0, 0.0, 0.1, 0.0)
    np.testing.assert_array_equal(second.step(1)[0], third.step(1)[0])
