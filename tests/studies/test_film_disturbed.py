"""Films of disturbed episodes: what is shown is what was seen and what moved."""

import numpy as np
import pytest

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.envs.backend import make_env
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.policy import Policy
from mjcartpole.physics.load import load_model
from mjcartpole.studies.film import Film, play
from mjcartpole.studies.policy_setup import PolicySetup
from mjcartpole.studies.video_options import VideoOptions

GRID = Discretizer((1, 3, 6, 8, 2), (-2.4, -1, -0.21, -1.5, -1), (2.4, 1, 0.21, 1.5, 1), actions=1)
POLICY = Policy(GRID, np.random.default_rng(0).normal(size=(*GRID.shape, 2)))
SMALL = VideoOptions(size="64x48", quality="draft", overlay=False)


@pytest.mark.parametrize("backend", ["mujoco", "gym"])
def test_the_overlay_shows_what_was_decided_on_what_was_seen(backend):
    some = Disturbances(delay=2, noise=0.1, sensor_delay=1, push="1@~0.1s", observe_actions=1)
    takes = play(PolicySetup("it", POLICY, backend, seed=3, disturbances=some), 2)
    env = make_env(backend, disturbances=some)
    for number, take in enumerate(takes):
        observation, _ = env.reset(seed=3 if number == 0 else None)
        for step in range(take.episode.steps):
            moment = take.moment(step)
            assert moment.values == POLICY.values(observation)
            assert moment.action == POLICY(observation)
            observation, *_ = env.step(moment.action)
            assert np.array_equal(env.unwrapped.state, take.states[step + 1])
    env.close()


def test_every_episode_is_drawn_with_the_pole_that_moves_in_it():
    some = Disturbances(vary="pole.length=0.3:2", observe_actions=1)
    setup = PolicySetup("it", POLICY, disturbances=some, seed=1)
    takes = play(setup, 2)
    env = make_env("mujoco", disturbances=some)
    for number, take in enumerate(takes):
        _, info = env.reset(seed=1 if number == 0 else None)
        assert take.setup.cartpole.xml == load_model("cartpole", info["context"]).xml
        over = False
        while not over:
            _, _, terminated, truncated, _ = env.step(0)
            over = terminated or truncated
    with Film([takes], SMALL) as film:
        frames = [frame.copy() for frame in film.frames()]
    assert len(frames) == film.length
    for number, take in enumerate(takes):
        with Film([[take]], SMALL) as film:
            alone = [frame.copy() for frame in film.frames()]
        start = sum(len(each.places(SMALL)) for each in takes[:number])
        assert np.array_equal(frames[start], alone[0])
    assert len({take.setup.cartpole.xml for take in takes}) == 2
    env.close()


def test_the_sheet_shows_the_first_episodes_pole():
    some = Disturbances(vary="pole.length=0.3,2", observe_actions=1)
    takes = play(PolicySetup("it", POLICY, disturbances=some, seed=1), 2)
    with Film([takes], SMALL) as film:
        _ = [None for _ in film.frames()]
        sheet = film.contact_sheet(2).copy()
    with Film([takes[:1]], SMALL) as film:
        assert np.array_equal(film.contact_sheet(2), sheet)
