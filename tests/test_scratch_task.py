"""A task that is written in a few lines trains, films and evaluates on both backends."""

import json
import math
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import mjcartpole
from mjcartpole.cli import main
from mjcartpole.envs.backend import make_env
from mjcartpole.envs.registration import env_id
from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.documents import read_config
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.training import train
from mjcartpole.studies.film import play
from mjcartpole.studies.policy_setup import PolicySetup
from mjcartpole.task import TASKS, Task
from nightly import few

BACKENDS = ("mujoco", "gym")


def upright(x: float, x_dot: float, theta: float, theta_dot: float, terminated: bool) -> float:
    """Pay for standing upright."""
    return -abs(theta) - 10.0 * terminated


NARROW = Task(
    "Narrow-v0",
    x_limit=1.0,
    theta_limit=math.radians(6),
    start_low=-0.02,
    start_high=0.02,
    reward=upright,
    time_limit=300,
)


@pytest.fixture(autouse=True)
def registered():
    mjcartpole.register_task(NARROW)
    yield
    del TASKS[NARROW.name], gymnasium.registry[env_id(NARROW)]


def config(backend: str, **changes) -> TrainConfig:
    return TrainConfig(backend=backend, task=NARROW.name, episodes=200, seed=1, **changes)


@pytest.mark.slow
@pytest.mark.parametrize("backend", BACKENDS)
def test_both_engines_learn_it_alike(backend):
    compiled, plain = (train(config(backend), engine=e) for e in ("compiled", "python"))
    np.testing.assert_array_equal(compiled.q_table, plain.q_table)
    np.testing.assert_array_equal(compiled.returns, plain.returns)
    assert compiled.episodes[0].total < 0
    assert max(episode.steps for episode in compiled.episodes) <= NARROW.time_limit


@pytest.mark.slow
@pytest.mark.parametrize("backend", BACKENDS)
def test_evaluation_and_film_agree(backend):
    policy = train(config(backend)).policy
    where = {"backend": backend, "task": NARROW, "episodes": 3, "seed": 5}
    played = [evaluate(policy, engine=engine, **where) for engine in ("compiled", "python")]
    assert played[0] == played[1]
    rollouts = play(PolicySetup("it", policy, backend, seed=5, task=NARROW), 3)
    assert tuple(one.episode for one in rollouts) == played[0].episodes
    for one in rollouts:
        assert one.totals[-1] == pytest.approx(one.episode.total, abs=1e-12)
        assert one.moment(1.0).total == one.totals[1] < 0


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_rules_hold_on_both_sides_of_a_limit(backend):
    env = make_env(backend, task=NARROW)
    bound = NARROW.observation_bound()
    np.testing.assert_array_equal(env.observation_space.high, bound)
    start = env.reset(seed=0)[0]
    assert (np.abs(start) <= 0.02).all()
    for value, over in ((1.0, False), (math.nextafter(1.0, 2), True)):
        env.reset()
        env.unwrapped.state = np.array([value, 0.0, 0.01, 0.0])
        _, reward, terminated, _, _ = env.step(1)
        assert terminated is over
        assert reward == -abs(env.unwrapped.state[2]) - 10.0 * over


def test_a_config_takes_a_known_task_itself():
    assert TrainConfig(task=NARROW) == TrainConfig(task=NARROW.name)
    with pytest.raises(ConfigError, match=r"'unheard-of' is unknown; available: .*Narrow-v0"):
        TrainConfig(task=Task("unheard-of"))


def test_environments_are_made_by_name():
    env = gymnasium.make(env_id(NARROW))
    assert env.spec.max_episode_steps == 300
    assert env.unwrapped.task is NARROW
    with warnings.catch_warnings():
        # It finds unbounded velocities odd, as it does in gymnasium's own.
        warnings.filterwarnings("ignore", message=".*A Box observation space m")
        check_env(env.unwrapped, skip_render_check=True)
    again = gymnasium.make(type(env.spec).from_json(env.spec.to_json()))
    assert again.unwrapped.x_threshold == 1.0


def test_the_vector_pays_as_the_environment_does():
    envs = gymnasium.make_vec(env_id(NARROW), num_envs=2)
    single = gymnasium.make(env_id(NARROW))
    envs.reset(seed=0)
    single.reset(seed=0)
    single.unwrapped.state = envs.unwrapped.state[:, 0]
    over = False
    while not over:
        _, rewards, terminations, _, _ = envs.step(np.array([1, 1]))
        _, reward, over, _, _ = single.step(1)
        assert rewards[0] == np.float32(reward)
        assert terminations[0] == over


def test_what_follows_the_end_earns_nothing_and_costs_on():
    env = gymnasium.make(env_id(NARROW)).unwrapped
    env.reset(seed=0)
    env.state = (0.0, 0.0, 0.2, 0.0)
    assert env.step(1)[1] < -10
    with pytest.warns(UserWarning, match="step"):
        assert env.step(1)[1] == upright(*env.state, True) < -10


def test_dm_control_plays_it():
    dm = pytest.importorskip("mjcartpole.envs.dm", exc_type=ImportError)
    env = dm.load(NARROW.name, seed=0)
    first = env.reset()
    assert abs(first.observation["position"]).max() <= 0.02
    step = env.step([0.0])
    assert step.reward == -abs(step.observation["position"][1])


def run(*words: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(words)
    return ended.value.code


@pytest.mark.long
@pytest.mark.parametrize("backend", few(BACKENDS, "mujoco"))
def test_the_command_line_trains_films_and_evaluates_it(backend, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = ["train", "--backend", backend, "--task", NARROW.name, "--episodes", "40"]
    assert run(*words, "--run-dir", "run", "--log-every", "20") == 0
    trained = capsys.readouterr().out
    plain = train(TrainConfig(backend=backend, task=NARROW, episodes=40), engine="python")
    learned = Policy.load(tmp_path / "run" / "policy.json").q_table
    np.testing.assert_array_equal(learned, plain.q_table)
    assert (tmp_path / "videos" / "run.mp4").stat().st_size > 1_000
    assert run("evaluate", "run") == 0
    figures = capsys.readouterr().out.split("greedy evaluation")[1]
    assert figures.split("\n", 1)[1] in trained
    assert run("evaluate", "run", "--task", "CartPole-v1", "--json") == 0
    assert '"minimum": -' not in capsys.readouterr().out


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_run_remembers_how_long_its_episodes_were(backend, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = ["train", "--backend", backend, "--episodes", "150", "--max-episode-steps", "30"]
    assert run(*words, "--no-video", "--no-curve", "--run-dir", "run") == 0
    config = read_config(tmp_path / "run")[2]
    assert train(config).returns.max() == 30
    capsys.readouterr()
    for words, most in ((), 30), (["--max-episode-steps", "20"], 20):
        assert run("evaluate", "run", "--json", *words) == 0
        assert json.loads(capsys.readouterr().out)["mean"] <= most
    longer = ["--task", "CartPole-v1", "--max-episode-steps", "31"]
    assert run("evaluate", "run", "--json", *longer) == 0
    assert json.loads(capsys.readouterr().out)["endings"]["time limit"] > 0
    assert run("evaluate", "run", "--max-episode-steps", "0") == 2
    assert "max_episode_steps must be a whole number from 1" in capsys.readouterr().err


AT_EXIT = """
import gymnasium, mjcartpole

def pay(x, x_dot, theta, theta_dot, terminated):
    return 0.5

mjcartpole.register_task(mjcartpole.Task("Half-v0", reward=pay))
mjcartpole.train(mjcartpole.TrainConfig(task="Half-v0", episodes=5))
env = gymnasium.make("mjcartpole/Half-v0", render_mode="rgb_array")
env.reset()
env.render()
"""


@pytest.mark.slow
def test_an_environment_that_a_compiled_reward_keeps_alive_goes_in_silence():
    """The compiler holds on to the reward, and with it to all that the script has made."""
    done = subprocess.run(
        [sys.executable, "-c", AT_EXIT], capture_output=True, text=True, check=True
    )
    assert "ignored" not in done.stderr
