"""Several poles on one cart, from the physics to the film: beside each other and on each other."""

import json
import math
import warnings
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st

from mjcartpole.cli import main
from mjcartpole.envs.cartpole import CartPoleEnv
from mjcartpole.envs.vector import CartPoleVectorEnv
from mjcartpole.errors import ConfigError, SimulationError
from mjcartpole.learning import runs
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.training import Training, train
from mjcartpole.physics.load import load_model
from mjcartpole.physics.simulation import Simulation
from mjcartpole.studies.film import Film, play
from mjcartpole.studies.policy_setup import PolicySetup
from mjcartpole.studies.transfer import transfer
from mjcartpole.studies.video_options import VideoOptions
from mjcartpole.task import CARTPOLE_V1
from nightly import examples

CHAIN = str(Path(__file__).parent / "models" / "chain.xml")
BESIDE = "twopoles"
LIMIT = CARTPOLE_V1.theta_limit
both = pytest.mark.parametrize("model", [BESIDE, CHAIN], ids=["beside", "chain"])
integrators = pytest.mark.parametrize("integrator", ["gym", "mujoco"])

ROD = """<body name="{0}" pos="{1} 0 {2!r}"><joint name="{0}" axis="0 1 0"/>
  <inertial pos="0 0 {3!r}" mass="{4!r}" diaginertia="{5!r} {5!r} {6!r}"/>{7}</body>"""
CART = """<mujoco><option timestep="0.02" gravity="0 0 -9.8"/><worldbody><body>
  <joint name="slider" type="slide" axis="1 0 0"/>
  <inertial pos="0 0 0" mass="{0!r}" diaginertia="0.01 0.01 0.01"/>{1}</body></worldbody>
  <actuator><motor joint="slider" gear="10" ctrlrange="-1 1"/></actuator></mujoco>"""


def rod(name, mass, length, *, x=0.0, z=0.0, on_it=""):
    across = mass * length**2 / 12
    return ROD.format(name, x, z, length / 2, mass, across, across / 2, on_it)


# --- physics ------------------------------------------------------------------------------------

masses, lengths = st.floats(0.02, 3), st.floats(0.1, 3)
many_states = st.lists(st.floats(-1.5, 1.5), min_size=6, max_size=6)


@given(masses, st.tuples(masses, lengths), st.tuples(masses, lengths), many_states)
@examples(50)
def test_poles_beside_each_other_accelerate_as_wielands(cart, first, second, state):
    """Wieland (1991, doi:10.1109/IJCNN.1991.155416): each pole pulls the cart by itself.

    Where the hinges are on the cart makes no difference.
    """
    poles = rod("a", *first, x=-0.1) + rod("b", *second, x=0.2, z=0.05)
    simulation = Simulation(load_model(CART.format(cart, poles)))
    force, mass = 10.0, cart
    for (m, length), theta, rate in zip((first, second), state[2::2], state[3::2], strict=True):
        half, sin, cos = length / 2, math.sin(theta), math.cos(theta)
        force += m * half * rate**2 * sin - 0.75 * m * 9.8 * cos * sin
        mass += m * (1 - 0.75 * cos**2)
    expected = [force / mass]
    for (_, length), theta in zip((first, second), state[2::2], strict=True):
        torque = 9.8 * math.sin(theta) - expected[0] * math.cos(theta)
        expected.append(1.5 / length * torque)
    found = simulation.accelerations(np.array([state]), np.array([1.0]))[0]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


@given(masses, st.tuples(masses, lengths), st.tuples(masses, lengths), many_states)
@examples(50)
def test_a_pole_on_a_pole_accelerates_as_lagrange_says(cart, lower, upper, state):
    """In the angles against the vertical, of which a hinge's own is the difference."""
    (m1, length), (m2, l2) = lower, (upper[0], upper[1] / 2)
    on_it = rod("b", *upper, z=length)
    simulation = Simulation(load_model(CART.format(cart, rod("a", *lower, on_it=on_it))))
    phi1, phi2 = state[2], state[2] + state[4]
    rate1, rate2 = state[3], state[3] + state[5]
    a, b, e = m1 * length / 2 + m2 * length, m2 * l2, m2 * length * l2
    apart = phi1 - phi2
    inertia = np.array([
        [cart + m1 + m2, a * math.cos(phi1), b * math.cos(phi2)],
        [a * math.cos(phi1), m1 * length**2 / 3 + m2 * length**2, e * math.cos(apart)],
        [b * math.cos(phi2), e * math.cos(apart), 4 / 3 * m2 * l2**2],
    ])  # fmt: skip
    right = [
        10 + a * math.sin(phi1) * rate1**2 + b * math.sin(phi2) * rate2**2,
        a * 9.8 * math.sin(phi1) - e * math.sin(apart) * rate2**2,
        b * 9.8 * math.sin(phi2) + e * math.sin(apart) * rate1**2,
    ]
    x_acc, acc1, acc2 = np.linalg.solve(inertia, right)
    found = simulation.accelerations(np.array([state]), np.array([1.0]))[0]
    scale = np.abs([x_acc, acc1, acc2]).max()
    np.testing.assert_allclose(found, [x_acc, acc1, acc2 - acc1], atol=1e-9 * scale)


def test_a_second_pole_of_no_weight_leaves_the_first_as_it_was():
    light = load_model(CART.format(1.0, rod("a", 0.1, 1.0) + rod("b", 1e-10, 0.3)))
    alone, two = Simulation(load_model()), Simulation(light)
    alone.state, two.state = (0, 0.1, 0.05, -0.2), (0, 0.1, 0.05, -0.2, 0.01, 0.02)
    for step in range(60):
        control = float(step % 3 - 1)
        expected = alone.step(control)
        np.testing.assert_allclose(two.step(control)[:4], expected, rtol=1e-5, atol=1e-7)


@both
@integrators
def test_positions_move_by_the_old_velocities_with_integrator_gym(model, integrator):
    simulation = Simulation(load_model(model, own_timestep=True), integrator)
    simulation.state = state = np.array([0.1, 0.2, 0.03, 0.4, -0.05, 0.6])
    h, after = simulation.cartpole.timestep, np.array(simulation.step(1.0))
    moved = state[0::2] + h * state[1::2]
    assert (after[0::2] == moved).all() == (integrator == "gym")


# --- environments -------------------------------------------------------------------------------


@both
def test_the_environment_has_two_values_for_each_pole(model):
    env = gymnasium.make("mjcartpole/CartPole-v1", model=model)
    assert env.observation_space.shape == (6,)
    assert env.observation_space.high[[2, 4]] == pytest.approx(2 * LIMIT)
    observation, _ = env.reset(seed=3)
    expected = np.random.Generator(np.random.PCG64(3)).uniform(-0.05, 0.05, size=6)
    np.testing.assert_array_equal(observation, expected.astype(np.float32))
    np.testing.assert_array_equal(env.unwrapped.state, expected)
    observation = env.step(1)[0]
    np.testing.assert_array_equal(observation, env.unwrapped.state.astype(np.float32))
    assert observation[1] > 0.05
    with warnings.catch_warnings():
        # What it says of CartPole-v1 too: velocities have no bounds.
        warnings.filterwarnings("ignore", ".*A Box observation space m.* value is -?infinity")
        check_env(env.unwrapped, skip_render_check=True)


BEYOND = math.nextafter(LIMIT, 1)


@pytest.mark.parametrize(
    ("state", "over"),
    [
        ((0, 0, LIMIT, 0, -LIMIT, 0), False),
        ((0, 0, BEYOND, 0, 0, 0), True),
        ((0, 0, 0, 0, BEYOND, 0), True),
        ((0, 0, -BEYOND, 0, 0, 0), True),
        ((0, 0, 0.1, 0, -BEYOND, 0), True),
        ((2.4, 0, 0, 0, 0, 0), False),
        ((math.nextafter(2.4, 3), 0, 0, 0, 0, 0), True),
        ((math.nextafter(-2.4, -3), 0, LIMIT, 0, 0, 0), True),
    ],
)
def test_an_episode_ends_when_one_of_them_has_fallen(state, over):
    """At rest, integrator `gym` leaves the positions where they are for one step."""
    env, vector = CartPoleEnv(model=BESIDE), CartPoleVectorEnv(3, model=BESIDE)
    env.reset(seed=0)
    env.state = state
    assert env.step(0)[1:3] == (1.0, over)
    vector.reset(seed=0)
    states = np.zeros((3, 6))
    states[1] = state
    vector.state = states.T
    assert vector.step([0, 0, 0])[2].tolist() == [False, over, False]


@both
@integrators
def test_vector_and_dm_control_move_as_the_environment(model, integrator):
    dm = pytest.importorskip("mjcartpole.envs.dm", exc_type=ImportError)
    env, vector = CartPoleEnv(model=model, integrator=integrator), None
    env.reset(seed=5)
    vector = CartPoleVectorEnv(2, model=model, integrator=integrator)
    vector.reset(seed=5)
    vector.state = np.array([env.state, env.state]).T
    suite = dm.load("balance", model=model, seed=5, discrete=True)
    step = suite.reset()
    for action in (1, 0, 0, 1, 1, 0, 1):
        observation = env.step(action)[0]
        np.testing.assert_array_equal(vector.step([action, action])[0][1], observation)
        step = suite.step(action)
        if integrator == "mujoco":
            np.testing.assert_array_equal(suite.physics.state, env.state)
            np.testing.assert_array_equal(step.observation["position"], env.state[0::2])
            np.testing.assert_array_equal(step.observation["velocity"], env.state[1::2])


@pytest.mark.parametrize("place", range(6))
@pytest.mark.parametrize("bad", [math.nan, math.inf, 1e11])
def test_no_value_gone_wild_becomes_an_observation(place, bad):
    env = CartPoleEnv(model=BESIDE)
    state = [0.0] * 6
    state[place] = bad
    env.reset(seed=0)
    env.state = state
    with pytest.raises(SimulationError, match="x, x_dot, theta1, theta1_dot, theta2, theta2_dot"):
        env.step(1)


def test_states_of_another_length_are_refused():
    env, vector = CartPoleEnv(model=BESIDE), CartPoleVectorEnv(2, model=BESIDE)
    for wrong in (np.zeros(4), np.zeros(8)):
        with pytest.raises(ConfigError, match=r"6 values \(x, x_dot, theta1, .*theta2_dot\)"):
            env.state = wrong
        with pytest.raises(ConfigError, match="theta2_dot"):
            vector.state = np.array([wrong, wrong])


# --- learning -----------------------------------------------------------------------------------


@both
@integrators
@pytest.mark.parametrize("changes", [{}, {"td_lambda": None, "ties": "random"}])
def test_both_engines_learn_the_same_bits(model, integrator, changes):
    config = TrainConfig(model=model, integrator=integrator, episodes=40, **changes)
    ours, reference = (train(config, engine=engine) for engine in ("compiled", "python"))
    assert ours.q_table.shape == (1, 3, 6, 8, 6, 8, 2)
    assert ours.q_table.tobytes() == reference.q_table.tobytes()
    assert list(ours.episodes) == list(reference.episodes)
    played = [
        evaluate(
            ours.policy, model=model, integrator=integrator, episodes=12, seed=4, engine=engine
        )
        for engine in ("compiled", "python")
    ]
    assert played[0] == played[1]


def test_diverging_poles_stop_both_engines_at_the_same_step():
    wild = load_model(
        CART.format(1e-9, rod("a", 0.1, 1.0) + rod("b", 1e-9, 0.02)).replace('"10"', '"1e9"')
    )
    said = []
    for engine in ("compiled", "python"):
        with pytest.raises(SimulationError, match="diverged") as error:
            for _ in Training(TrainConfig(episodes=9), engine=engine, cartpole=wild).run():
                pass
        said.append(str(error.value))
    assert said[0] == said[1]
    assert "theta2_dot" in said[0]


def test_the_grid_follows_the_poles():
    config = TrainConfig()
    assert config.discretizer(1).bins == (1, 3, 6, 8)
    assert config.discretizer(3).bins == (1, 3, 6, 8, 6, 8, 6, 8)
    assert config.discretizer(2).low == (-2.4, -0.75, -0.2095, -1.5, -0.2095, -1.5)
    own = TrainConfig(bins=(1, 2, 3, 4, 5, 6), high=(2.4, 1, 0.2, 2, 0.2, 4))
    assert own.discretizer(2).bins == (1, 2, 3, 4, 5, 6)
    assert own.discretizer(2).high == (2.4, 1, 0.2, 2, 0.2, 4)
    with pytest.raises(ConfigError, match=r"bins has 6 values, and the model has 1 pole; give 4"):
        own.discretizer(1)
    with pytest.raises(ConfigError, match=r"bins has 6 values, .* 3 poles; give 4 or 8"):
        own.discretizer(3)


def test_a_policy_is_refused_where_there_are_other_poles(tmp_path):
    one = train(TrainConfig(backend="gym", episodes=3)).policy
    two = train(TrainConfig(model=BESIDE, episodes=3)).policy
    said = "the policy is for 2 poles, and cartpole has 1 pole"
    for play_it in (
        lambda: evaluate(two),
        lambda: evaluate(two, engine="python"),
        lambda: play(PolicySetup("two", two)),
        lambda: transfer({"two": two}, ["cartpole"]),
    ):
        with pytest.raises(ConfigError, match=said):
            play_it()
    with pytest.raises(ConfigError, match="for 1 pole, and twopoles has 2 poles"):
        evaluate(one, model=BESIDE)
    with pytest.raises(ConfigError, match="for 2 poles, and CartPole-v1 has 1 pole"):
        evaluate(two, backend="gym")
    assert transfer({"two": two}, [BESIDE, CHAIN], episodes=3).means.shape == (1, 2)


# --- the command line ---------------------------------------------------------------------------


def call(argv):
    with pytest.raises(SystemExit) as stop:
        main(argv)
    return stop.value.code


@pytest.mark.long
def test_a_run_is_stored_continued_evaluated_and_filmed(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    flags = ["--model", CHAIN, "--episodes", "30", "--no-video", "--no-curve"]
    assert call(["train", *flags, "--run-dir", "whole"]) == 0
    first = Path("whole")
    assert runs.load_run(first).policy.poles == 2
    assert call(["train", *flags, "--run-dir", "again", "--checkpoint-every", "0"]) == 0
    assert (first / "policy.json").read_bytes() == Path("again/policy.json").read_bytes()
    capsys.readouterr()
    assert call(["evaluate", "whole", "--json"]) == 0
    stored = json.loads((first / "summary.json").read_text())["evaluation"]
    assert json.loads(capsys.readouterr().out)["mean"] == stored["mean"]
    assert call(["render", "whole", "--overlay", "--size", "320x240", "-o", "it.gif"]) == 0
    assert call(["transfer", "whole", "--episodes", "3"]) == 0
    out = capsys.readouterr().out
    assert "twopoles" in out
    assert "moon" not in out
    assert call(["model", "show", BESIDE]) == 0
    assert "pole 2 " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("train --model twopoles --bins 1 3 6 8 6", "two more for each further pole"),
        ("train --bins 1 3 6 8 6 8", "bins has 6 values, and the model has 1 pole"),
        ("train --model twopoles --set pole.length=1", "use pole1.length or pole2.length"),
        ("train --model twopoles --set pole2.lenght=1", "did you mean 'pole2.length'?"),
        ("train --model twopoles --set pole3.mass=1", "use pole1.mass or pole2.mass"),
        ("train --set hinge1.damping=1", "it has 1 pole; use hinge.damping"),
        ("parity --model twopoles --against itself", "2 poles, and the equations are those of one"),
    ],
)
def test_mistakes_are_one_line(words, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert call(words.split()) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


# --- pictures -----------------------------------------------------------------------------------


@both
def test_a_film_shows_both_poles_and_their_numbers(model):
    policy = train(TrainConfig(model=model, episodes=5)).policy
    take = play(PolicySetup("it", policy, model=model))[0]
    assert take.states.shape == (take.episode.steps + 1, 6)
    look = VideoOptions(size="320x240", overlay=True, quality="draft")
    with Film([[take]], look) as film:
        frames = [frame.copy() for frame in film.frames()]
    assert len(frames) == len(take.states)
    assert len({frame.tobytes() for frame in frames}) == len(frames)


def test_gymnasiums_double_pendulum_is_taken_as_it_is():
    path = Path(gymnasium.__file__).parent / "envs/mujoco/assets/inverted_double_pendulum.xml"
    if not path.is_file():
        pytest.skip("this gymnasium has no such file")
    cartpole = load_model(path)
    assert (cartpole.poles, cartpole.upright) == (2, (0.0, 0.0))
    result = train(TrainConfig(model=str(path), episodes=20))
    assert result.q_table.ndim == 7


@settings(max_examples=20)
@given(
    st.floats(0.05, 5),
    st.floats(0.01, 5),
    st.floats(0, 1, allow_subnormal=False),
    st.sampled_from([1, 2]),
)
def test_edits_of_one_pole_leave_the_other(length, mass, damping, which):
    before = load_model(BESIDE)
    name = f"pole{which}"
    edits = {f"{name}.length": length, f"{name}.mass": mass, f"hinge{which}.damping": damping}
    after = load_model(BESIDE, edits)
    for pole, hinge in enumerate(after.hinges, start=1):
        body = int(after.model.jnt_bodyid[hinge])
        new, old = (each.model.body(body) for each in (after, before))
        if pole != which:
            for field in ("mass", "ipos", "inertia"):
                np.testing.assert_array_equal(getattr(new, field), getattr(old, field))
            assert after.model.dof_damping[hinge] == before.model.dof_damping[hinge]
            continue
        assert new.mass[0] == pytest.approx(mass, rel=1e-12)
        assert new.ipos[2] == pytest.approx(length / 2, rel=1e-12)
        across = mass * length**2 / 12
        assert sorted(new.inertia)[1:] == pytest.approx([across, across], rel=1e-12)
        assert after.model.dof_damping[hinge] == damping
