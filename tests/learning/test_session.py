"""A training that is kept on disk as it goes."""

import itertools

import pytest

from mjcartpole.errors import ConfigError, FileError, SimulationError
from mjcartpole.learning import compiled
from mjcartpole.learning.checkpoints import LATEST, load_checkpoint
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.session import Session, check_interval
from mjcartpole.learning.training import Training, train
from mjcartpole.physics.load import load_model
from nightly import few

CONFIG = TrainConfig(backend="gym", episodes=12, seed=5)
CARTPOLE = load_model()


def session_in(folder, *, every=1e9, config=CONFIG, engine="python"):
    return Session(folder, Training(config, engine=engine), CARTPOLE, every=every)


def saved(folder, name=LATEST, config=CONFIG):
    return load_checkpoint(folder / name, config, CARTPOLE.xml)


def never():
    return False


@pytest.mark.parametrize("seconds", [-1, -0.001, float("nan")])
def test_an_interval_that_makes_no_sense(seconds, tmp_path):
    with pytest.raises(ConfigError, match="checkpoint-every must be a number of seconds"):
        check_interval(seconds)
    with pytest.raises(ConfigError):
        session_in(tmp_path, every=seconds)


@pytest.mark.parametrize("seconds", [0, 0.5, 30, float("inf")])
def test_an_interval_that_makes_sense(seconds):
    check_interval(seconds)


def test_it_saves_after_each_chunk_if_the_interval_is_zero(tmp_path):
    counts = []
    for finished in session_in(tmp_path, every=0).run(never):
        if finished > 2:
            counts += [(saved(tmp_path).episodes, finished)]
    assert counts == [(n - 1, n) for n in range(3, 13)]
    assert saved(tmp_path).episodes == 12


def test_it_saves_at_the_end_only_if_the_interval_is_long(tmp_path):
    for _ in session_in(tmp_path).run(never):
        assert list(tmp_path.iterdir()) == []
    assert saved(tmp_path).episodes == 12
    assert [path.name for path in tmp_path.iterdir()] == [LATEST]


def test_it_saves_when_it_is_stopped(tmp_path):
    session, asked = session_in(tmp_path), itertools.count(1)
    assert list(session.run(lambda: next(asked) == 4)) == [1, 2, 3, 4]
    assert saved(tmp_path).episodes == 4
    assert not session.is_over


@pytest.mark.parametrize(
    ("first", "then"),
    few(itertools.product(["compiled", "python"], repeat=2), ("compiled", "python")),
)
def test_a_stopped_session_goes_on_to_the_same_end(first, then, tmp_path, monkeypatch):
    monkeypatch.setattr(compiled, "CHUNK_STEPS", 500)
    config = TrainConfig(episodes=100, seed=2, ties="random")
    session = session_in(tmp_path, config=config, engine=first)
    for finished in session.run(lambda: len(session.training.log) >= 30):
        assert finished < 100
    again = session_in(tmp_path, config=config, engine=then)
    again.resume(saved(tmp_path, config=config))
    assert len(again.training.log) == len(session.training.log)
    for _ in again.run(never):
        pass
    assert again.is_over
    whole, resumed = train(config), again.training.result()
    assert resumed.q_table.tobytes() == whole.q_table.tobytes()
    assert list(resumed.episodes) == list(whole.episodes)
    assert resumed.seconds > saved(tmp_path, config=config).snapshot.seconds * 0.5


def test_without_a_checkpoint_it_begins_at_the_beginning(tmp_path):
    session = session_in(tmp_path)
    session.resume(None)
    assert list(session.run(never)) == list(range(1, 13))


def test_a_session_that_is_over_only_saves_again(tmp_path):
    session = session_in(tmp_path)
    for _ in session.run(never):
        pass
    again = session_in(tmp_path)
    again.resume(saved(tmp_path))
    assert again.is_over
    assert list(again.run(never)) == []
    assert again.training.result().q_table.tobytes() == train(CONFIG).q_table.tobytes()


def test_a_folder_that_is_gone_is_our_error(tmp_path):
    (tmp_path / "file").write_text("")
    session = session_in(tmp_path / "file")
    with pytest.raises(FileError):
        for _ in session.run(never):
            pass


def test_a_training_that_diverges_leaves_its_last_checkpoint(tmp_path):
    text = load_model().xml.replace('ctrlrange="-1 1"', 'ctrlrange="-1 9e9"')
    config = TrainConfig(model="wild.xml", episodes=50, epsilon=0.05, q_init_low=0, q_init_high=1)
    training = Training(config, engine="python", cartpole=load_model(text))
    session = Session(tmp_path, training, load_model(text), every=0)
    with pytest.raises(SimulationError, match="episode"):
        for _ in session.run(never):
            pass
    done = len(training.log)
    if done:
        found = load_checkpoint(tmp_path / LATEST, config, text)
        assert found.episodes == done
