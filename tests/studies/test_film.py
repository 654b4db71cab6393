"""Episodes as pictures."""

import subprocess
import sys
import textwrap

import gymnasium
import numpy as np
import pytest

from mjcartpole.errors import ConfigError, RenderError
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.episodes import Episode
from mjcartpole.learning.evaluation import SEED, evaluate
from mjcartpole.learning.policy import Policy
from mjcartpole.media.montage import state_at
from mjcartpole.media.overlay import Overlay
from mjcartpole.media.renderer import open_renderer
from mjcartpole.physics.load import load_model
from mjcartpole.studies.film import Film, Rollout, play
from mjcartpole.studies.policy_setup import PolicySetup
from mjcartpole.studies.video_options import FALL_SECONDS, FALL_SPEED, VideoOptions
from mjcartpole.task import CONTROL_STEP

WIDTH, HEIGHT = 160, 120
SMALL = {"size": f"{WIDTH}x{HEIGHT}", "quality": "draft"}
BACKENDS = pytest.mark.parametrize("backend", ["mujoco", "gym"])


def some_policy(seed=0):
    """A policy that takes either action somewhere, and falls soon."""
    discretizer = Discretizer((1, 3, 6, 8), (-2.4, -1, -0.21, -1.5), (2.4, 1, 0.21, 1.5))
    values = np.random.default_rng(seed).normal(size=(1, 3, 6, 8, 2))
    return Policy(discretizer, values)


def balancing_policy():
    """A policy that stays up for a while."""
    discretizer = Discretizer((1, 1, 12, 12), (-2.4, -1, -0.21, -1.5), (2.4, 1, 0.21, 1.5))
    values = np.zeros((1, 1, 12, 12, 2))
    for theta in range(12):
        for theta_dot in range(12):
            values[0, 0, theta, theta_dot, int(theta + theta_dot > 11)] = 1
    return Policy(discretizer, values)


@pytest.fixture(scope="module")
def take():
    return play(PolicySetup("some", some_policy()))[0]


def drawn(casts, **look):
    with Film(casts, VideoOptions(**{**SMALL, **look})) as film:
        frames = [frame.copy() for frame in film.frames()]
        assert len(frames) == film.length
    return frames


@pytest.fixture(scope="module")
def renderer():
    with open_renderer(load_model(), width=WIDTH, height=HEIGHT, quality="draft") as renderer:
        yield renderer


@BACKENDS
@pytest.mark.parametrize("seed", [SEED, 7])
def test_a_take_is_what_the_environment_does(backend, seed):
    setup = PolicySetup("some", some_policy(), backend, seed=seed)
    take = play(setup)[0]
    env = gymnasium.make({"mujoco": "mjcartpole/CartPole-v1", "gym": "CartPole-v1"}[backend])
    observation, _ = env.reset(seed=seed)
    over, total = False, 0.0
    for step, state in enumerate(take.states):
        assert np.array_equal(env.unwrapped.state, state)
        moment = take.moment(step)
        assert (moment.step, moment.total) == (step, total)
        if over:
            break
        assert moment.action == setup.policy(observation)
        observation, reward, terminated, truncated, _ = env.step(moment.action)
        over, total = terminated or truncated, total + reward
    assert over
    assert step == take.episode.steps == len(take.states) - 1
    assert total == take.episode.total
    env.close()


@BACKENDS
def test_the_episodes_are_the_first_of_an_evaluation(backend):
    takes = play(PolicySetup("some", some_policy(), backend), 5)
    result = evaluate(some_policy(), backend=backend, episodes=5)
    assert [take.episode.total for take in takes] == result.returns.tolist()
    assert len({tuple(take.states[0]) for take in takes}) == 5


def test_a_moment_shows_the_table_s_row(take):
    policy = take.setup.policy
    actions = set()
    for step in range(take.episode.steps):
        moment = take.moment(step)
        cell = policy.discretizer(take.states[step].astype(np.float32).tolist())
        assert moment.values == tuple(policy.q_table.reshape(-1, 2)[cell])
        assert moment.action == np.argmax(moment.values)
        assert np.array_equal(moment.state, take.states[step])
        actions.add(moment.action)
    assert actions == {0, 1}


def test_after_the_last_step_there_is_no_action(take):
    last = take.moment(take.episode.steps)
    assert (last.step, last.total) == (take.episode.steps, take.episode.total)
    assert (last.action, last.values) == (None, None)
    assert np.array_equal(last.state, take.states[-1])


def test_between_two_states_the_action_is_that_of_the_first(take):
    before, moment = take.moment(3), take.moment(3.75)
    assert (moment.step, moment.action, moment.values) == (3, before.action, before.values)
    assert np.allclose(moment.state, 0.25 * take.states[3] + 0.75 * take.states[4])


def test_a_place_that_rounding_has_moved_belongs_to_its_step(take):
    assert int(0.29 * 100) == 28
    steps = take.episode.steps
    assert take.moment(steps - 4e-15).action is None
    for fps in (30, 48, 60, 75):
        places = VideoOptions(fps=fps, speed=0.29).places(len(take.states))
        whole = [place for place in places if abs(place - round(place)) < 1e-9]
        assert [take.moment(place).step for place in whole] == [round(place) for place in whole]


@pytest.mark.parametrize(
    ("speed", "fps", "per_step"), [(1, 50, 1), (0.25, 50, 4), (1, 25, 0.5), (0.5, 25, 1)]
)
def test_a_film_lasts_as_long_as_its_motion(take, renderer, speed, fps, per_step):
    frames = drawn([[take]], speed=speed, fps=fps)
    steps = take.episode.steps
    assert len(frames) == int(steps * per_step) + 1
    for index in (0, 1, 5, len(frames) - 1):
        expected = renderer.render(state_at(take.states, index / per_step))
        assert np.array_equal(frames[index], expected)


def test_slow_motion_lies_between_the_states(take):
    places = VideoOptions(speed=0.25).places(len(take.states))
    states = np.array([state_at(take.states, place) for place in places])
    assert np.array_equal(states[::4], take.states)
    middle = (take.states[1:] + take.states[:-1]) / 2
    assert np.allclose(states[2::4], middle, rtol=0, atol=1e-15)


@pytest.mark.long
@pytest.mark.parametrize("fps", [25, 50])
def test_a_fall_is_the_last_second_in_slow_motion(fps):
    take = play(PolicySetup("balancing", balancing_policy(), seed=3))[0]
    steps = take.episode.steps
    places = VideoOptions(fall=True, fps=fps).places(len(take.states))
    shown = FALL_SECONDS / CONTROL_STEP
    assert steps > 2 * shown
    assert (places[0], places[-1]) == (steps - shown, steps)
    assert len(places) == round(FALL_SECONDS / FALL_SPEED * fps) + 1
    assert np.allclose(np.diff(places), FALL_SPEED / CONTROL_STEP / fps)
    assert len(drawn([[take]], fall=True, fps=fps)) == len(places)


def test_the_fall_of_an_episode_shorter_than_a_second_is_all_of_it(take):
    assert take.episode.steps < 50
    places = VideoOptions(fall=True).places(len(take.states))
    assert (places[0], places[-1]) == (0, take.episode.steps)


def test_what_gymnasium_moves_is_drawn_with_our_model(renderer):
    take = play(PolicySetup("some", some_policy(), "gym"))[0]
    frames = drawn([[take]])
    for index in (0, len(frames) // 2, -1):
        assert np.array_equal(frames[index], renderer.render(take.states[index]))


def test_an_overlay_shows_the_moment_of_each_frame(take):
    look = {"size": "320x240", "overlay": True, "speed": 0.5}
    frames = drawn([[take]], **look)
    with open_renderer(load_model(), width=320, height=240, quality="draft") as renderer:
        overlay = Overlay(renderer.scene)
        for index, frame in enumerate(frames):
            plain = renderer.render(state_at(take.states, index / 2))
            expected = overlay.draw(plain.copy(), take.moment(index / 2))
            assert not np.array_equal(plain, expected)
            assert np.array_equal(frame, expected)


def test_several_start_alike_and_each_is_what_it_is_alone():
    setups = [
        PolicySetup("mujoco", some_policy()),
        PolicySetup("gym", some_policy(), "gym"),
        PolicySetup("other", some_policy(1)),
    ]
    casts = [play(setup) for setup in setups]
    starts = [takes[0].states[0] for takes in casts]
    assert np.array_equal(starts[0], starts[1])
    assert np.array_equal(starts[0], starts[2])
    frames = drawn(casts)
    assert len(frames) == max(len(takes[0].states) for takes in casts)
    for column, takes in enumerate(casts[:2]):
        left = column * (frames[0].shape[1] - WIDTH)
        for frame, alone in zip(frames, drawn([takes]), strict=False):
            top = frame.shape[0] // 2 - HEIGHT - 1
            assert np.array_equal(frame[top : top + HEIGHT, left : left + WIDTH], alone)


@pytest.mark.long
def test_several_begin_each_episode_together():
    casts = [play(PolicySetup(f"{seed}", some_policy(seed)), 3) for seed in (0, 1)]
    lengths = [[len(take.states) for take in takes] for takes in casts]
    assert lengths[0] != lengths[1]
    frames = drawn(casts)
    begin = 0
    for longest in map(max, *lengths):
        first = frames[begin]
        halves = first[-HEIGHT:, :WIDTH], first[-HEIGHT:, -WIDTH:]
        assert np.array_equal(*halves)
        begin += longest
    assert begin == len(frames)


def test_a_contact_sheet_goes_from_the_first_to_the_last_state(take, renderer):
    with Film([[take]], VideoOptions(**SMALL)) as film:
        sheet = film.contact_sheet(10)
    assert sheet.shape[1] == 5 * WIDTH + 4 * 2
    assert np.array_equal(sheet[:HEIGHT, :WIDTH], renderer.render(take.states[0]))
    rows = slice(sheet.shape[0] // 2 + 1, sheet.shape[0] // 2 + 1 + HEIGHT)
    assert np.array_equal(sheet[rows, -WIDTH:], renderer.render(take.states[-1]))


def test_a_contact_sheet_of_few_frames_shows_each_once(take):
    with Film([[take]], VideoOptions(**SMALL, speed=10)) as film:
        assert film.length == take.episode.steps // 10 + 1
        assert film.contact_sheet(10).shape[1] == film.length * (WIDTH + 2) - 2


@pytest.mark.parametrize(
    ("look", "message"),
    [
        ({"camera": "moon"}, "no camera 'moon'; available: side, follow"),
        ({"size": "15x480"}, "width 15 is no size of a picture"),
        ({"size": "640X100000"}, "height 100000 is no size of a picture"),
        ({"fps": 0}, "fps 0 makes no sense; use 1 to 1000"),
        ({"fps": 1e-9}, "fps 1e-09 makes no sense"),
        ({"fps": float("nan")}, "fps nan makes no sense"),
        ({"fps": 1001}, "fps 1001 makes no sense"),
        ({"speed": 0}, "speed 0 makes no sense"),
        ({"speed": -1, "fps": 25}, "speed -1 makes no sense"),
        ({"speed": -1, "fall": True}, "speed -1 makes no sense"),
        ({"speed": 1e-300}, "speed 1e-300 makes no sense; use 0.001 to 1000"),
        ({"speed": float("inf")}, "speed inf makes no sense"),
        ({"quality": "best"}, "quality 'best' is unknown; available: draft, normal, high"),
    ],
    ids=str,
)
def test_a_look_that_makes_no_sense_is_refused(take, look, message):
    with pytest.raises(RenderError) as refused:
        Film([[take]], VideoOptions(**look))
    assert message in str(refused.value)


def test_no_episode_and_no_seed_are_refused():
    with pytest.raises(ConfigError, match="episodes must be a whole number from 1 up, not 0"):
        play(PolicySetup("some", some_policy()), 0)
    with pytest.raises(ConfigError, match="seed must be a whole number from 0 up, not -1"):
        play(PolicySetup("some", some_policy(), seed=-1))


LONG = """
    import resource, sys
    import numpy as np
    sys.path.insert(0, sys.argv[1])
    from test_film import SMALL, some_policy
    from mjcartpole.studies.film import Film, play
    from mjcartpole.studies.policy_setup import PolicySetup
    from mjcartpole.studies.video_options import VideoOptions
    from mjcartpole.media.video import write_video

    def write(speed):
        casts = [play(PolicySetup("some", some_policy()))] * 2
        with Film(casts, VideoOptions(**SMALL, speed=speed)) as film:
            return write_video(sys.argv[2], film.frames()).frames

    write(0.2)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    frames = write(float(sys.argv[3]))
    print(frames, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="counts in Linux's kilobytes")
@pytest.mark.parametrize("speed", [0.02, 0.003], ids=["short", "long"])
def test_memory_does_not_grow_with_the_length_of_a_film(tmp_path, speed):
    here = str(__file__).rpartition("/")[0]
    command = [sys.executable, "-c", textwrap.dedent(LONG), here, str(tmp_path / "a.mp4")]
    done = subprocess.run(
        [*command, str(speed)], capture_output=True, text=True, check=True, timeout=300
    )
    frames, growth = map(int, done.stdout.split())
    # All frames would be 113 kilobytes each.
    assert growth < 8_000 < 30 * frames


def test_a_film_takes_the_time_that_control_steps_take():
    cartpole = load_model("cartpole", {"timestep": 0.01}, own_timestep=True)
    states = np.zeros((101, 4))
    slow, quick = (
        Rollout(
            PolicySetup("it", some_policy(), model=model),
            Episode(0, 100.0, 100, "time limit"),
            states,
            [],
        )
        for model in ("cartpole", cartpole)
    )
    assert slow.places(VideoOptions()).tolist() == list(range(101))
    assert quick.places(VideoOptions()).tolist() == list(range(0, 101, 2))
    assert (
        len(slow.places(VideoOptions(fall=True)))
        == len(quick.places(VideoOptions(fall=True)))
        == 201
    )
    assert quick.places(VideoOptions(fall=True))[0] == 0.0
    assert slow.places(VideoOptions(fall=True))[0] == 50.0
