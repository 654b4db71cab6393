"""A checkpoint is taken whole and of the right training, or refused."""

import dataclasses
import hashlib
import io
import json
import os
import pickle
import zipfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjcartpole.errors import CheckpointError, FileError
from mjcartpole.learning.checkpoints import (
    LATEST,
    Checkpoint,
    checksum,
    load_checkpoint,
    save_checkpoint,
)
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.methods import METHODS
from mjcartpole.learning.training import Training
from nightly import examples, few

CONFIG = TrainConfig(mirror=False, backend="gym", episodes=12, seed=5)
DOCUMENT = "<mujoco/>"
HEAD = b"mjcartpole checkpoint 1 "


def checkpoint_after(episodes, config=CONFIG, document=DOCUMENT):
    training = Training(config, engine="python")
    run = training.run()
    while len(training.log) < episodes:
        next(run)
    return Checkpoint(config, checksum(document), training.snapshot())


@pytest.fixture(scope="module")
def checkpoint():
    return checkpoint_after(7)


@pytest.fixture(scope="module")
def content(checkpoint, tmp_path_factory):
    folder = tmp_path_factory.mktemp("good")
    save_checkpoint(folder, checkpoint)
    return (folder / LATEST).read_bytes()


@pytest.fixture(scope="module")
def scratch(tmp_path_factory):
    return tmp_path_factory.mktemp("scratch") / "checkpoint.bin"


def assert_refused(path, config=CONFIG, document=DOCUMENT):
    """With one line that names the file."""
    with pytest.raises(CheckpointError) as refused:
        load_checkpoint(path, config, document)
    assert str(path) in str(refused.value)
    assert "\n" not in str(refused.value)
    return str(refused.value)


def test_a_checkpoint_comes_back_bit_for_bit(checkpoint, content, scratch):
    scratch.write_bytes(content)
    again = load_checkpoint(scratch, CONFIG, DOCUMENT)
    old, new = checkpoint.snapshot, again.snapshot
    assert (again.config, again.model, again.episodes) == (CONFIG, checksum(DOCUMENT), 7)
    assert new.memory["q_table"].tobytes() == old.memory["q_table"].tobytes()
    assert (new.env_rng, new.learner_rng, new.seconds) == (
        old.env_rng,
        old.learner_rng,
        old.seconds,
    )
    for before, after in zip(old.columns, new.columns, strict=True):
        assert (after.tobytes(), after.dtype) == (before.tobytes(), before.dtype)


@pytest.mark.parametrize(
    "config",
    [
        TrainConfig(backend="gym", episodes=12, td_lambda=None, ties="random"),
        TrainConfig.preset("article", episodes=12, bins=(2, 2, 2, 2)),
        TrainConfig(episodes=12, integrator="mujoco"),
        *(TrainConfig(backend="gym", episodes=12, method=method) for method in METHODS),
    ],
    ids=str,
)
def test_a_training_goes_on_from_its_checkpoint(config, tmp_path):
    save_checkpoint(tmp_path, checkpoint_after(7, config))
    whole, resumed = Training(config, engine="python"), Training(config, engine="python")
    resumed.restore(load_checkpoint(tmp_path / LATEST, config, DOCUMENT).snapshot)
    assert list(whole.run())[7:] == list(resumed.run())
    assert resumed.result().q_table.tobytes() == whole.result().q_table.tobytes()
    memories = (training.snapshot().memory for training in (resumed, whole))
    for ours, theirs in zip(*(memory.items() for memory in memories), strict=True):
        assert (ours[0], ours[1].tobytes()) == (theirs[0], theirs[1].tobytes())
    assert list(resumed.log) == list(whole.log)
    assert (resumed.result().visits == whole.result().visits).all()


EVALUATED = TrainConfig(backend="gym", episodes=12, evaluate_every=3)


@pytest.fixture(scope="module")
def evaluated():
    return checkpoint_after(7, EVALUATED)


def test_evaluations_come_back_to_the_digit(evaluated, tmp_path):
    save_checkpoint(tmp_path, evaluated)
    loaded = load_checkpoint(tmp_path / LATEST, EVALUATED, DOCUMENT).snapshot.evaluations
    assert loaded == evaluated.snapshot.evaluations
    assert [(point.episodes, type(point.steps)) for point in loaded] == [(3, int), (6, int)]


@pytest.mark.parametrize(
    "numbers",
    [
        None,
        np.zeros(10),
        np.arange(9.0),
        np.array([3, 9, 0, np.nan, 9, 6, 9, 0, 9, 9]),
        np.zeros(99),
    ],
)
def test_evaluations_that_the_training_does_not_have_are_refused(numbers, evaluated, tmp_path):
    save_checkpoint(tmp_path, evaluated)
    path = tmp_path / LATEST
    path.write_bytes(forged(path.read_bytes(), evaluations=numbers))
    assert_refused(path, EVALUATED)


def test_one_is_kept(tmp_path):
    for episodes in (3, 4, 5):
        save_checkpoint(tmp_path, checkpoint_after(episodes))
    assert [path.name for path in tmp_path.iterdir()] == [LATEST]
    assert load_checkpoint(tmp_path / LATEST, CONFIG, DOCUMENT).episodes == 5


def test_a_folder_in_the_way_is_left_alone(tmp_path):
    (tmp_path / LATEST).mkdir()
    with pytest.raises(FileError):
        save_checkpoint(tmp_path, checkpoint_after(4))
    assert [path.name for path in tmp_path.iterdir()] == [LATEST]


def test_a_checkpoint_of_a_config_without_what_came_later_is_read(content, scratch):
    """Version 0.1 wrote such, with a table of two columns."""
    archive = dict(np.load(io.BytesIO(content[len(HEAD) + 65 :])))
    about = json.loads(archive["about"].tobytes())
    later = ("task", "method", "mirror", "tilings", "evaluate_every", "until", "max_episode_steps")
    for name in later:
        del about["config"][name]
    archive["about"] = np.frombuffer(json.dumps(about).encode(), np.uint8)
    archive["q_table"] = archive["q_table"].reshape(-1, 2)
    del archive["state_visits"], archive["sides"]
    packed = io.BytesIO()
    np.savez(packed, **archive)
    scratch.write_bytes(sealed(packed.getvalue()))
    found = load_checkpoint(scratch, CONFIG, DOCUMENT)
    assert found.episodes == 7
    assert not found.snapshot.columns.sides.any()
    # What was not counted from the beginning is not known.
    training = Training(CONFIG, engine="python")
    training.restore(found.snapshot)
    assert training.result().visits is training.snapshot().visits is None


@pytest.mark.parametrize("step", few([3, 41], 41))
def test_a_flipped_bit_is_refused_wherever_it_is(step, content, scratch):
    for place in (*range(0, 200, 1 + step // 10), *range(200, len(content), step)):
        damaged = bytearray(content)
        damaged[place] ^= 1 << place % 8
        scratch.write_bytes(damaged)
        assert_refused(scratch)


@pytest.mark.parametrize("step", few([7, 83], 83))
def test_every_length_but_the_right_one_is_refused(step, content, scratch):
    lengths = (*range(0, 200, 1 + step // 20), *range(200, len(content), step), len(content) - 1)
    for length in lengths:
        scratch.write_bytes(content[:length])
        assert_refused(scratch)
    for more in (b"\0", b"\n", b"x" * 1000, content):
        scratch.write_bytes(content + more)
        assert_refused(scratch)
        scratch.write_bytes(more + content)
        assert_refused(scratch)


@examples(200)
@given(data=st.data())
def test_no_change_is_accepted(data, content, scratch):
    start = data.draw(st.integers(0, len(content)))
    end = data.draw(st.integers(start, min(start + 300, len(content))))
    damaged = content[:start] + data.draw(st.binary(max_size=300)) + content[end:]
    scratch.write_bytes(damaged)
    if damaged == content:
        load_checkpoint(scratch, CONFIG, DOCUMENT)
    else:
        assert_refused(scratch)


@examples(100)
@given(noise=st.binary(max_size=2000))
def test_noise_is_refused_even_with_a_right_checksum(noise, scratch):
    for start in (b"", HEAD, HEAD + hashlib.sha256(noise).hexdigest().encode() + b"\n"):
        scratch.write_bytes(start + noise)
        assert_refused(scratch)


OTHERS = {
    "seed": 6,
    "episodes": 13,
    "gamma": 0.5,
    "bins": (1, 3, 6, 9),
    "td_lambda": None,
    "ties": "random",
    "backend": "mujoco",
}


@pytest.mark.parametrize("name", OTHERS)
def test_one_of_another_config_is_refused_and_says_what_differs(name, content, scratch):
    scratch.write_bytes(content)
    other = dataclasses.replace(CONFIG, **{name: OTHERS[name]})
    message = assert_refused(scratch, other)
    assert f"{name} {getattr(CONFIG, name)!r}, not {OTHERS[name]!r}" in message


def test_one_of_another_model_is_refused(content, scratch):
    scratch.write_bytes(content)
    assert "another model" in assert_refused(scratch, document=DOCUMENT + "\n")


def test_what_is_not_there_or_no_file_is_refused(tmp_path):
    assert "No such file" in assert_refused(tmp_path / "nothing")
    assert "it is a folder" in assert_refused(tmp_path)


class Trap:
    """Unpickling it leaves a trace."""

    def __reduce__(self):
        return os.mkdir, ("sprung",)


def sealed(archive):
    """An archive behind a right checksum."""
    return HEAD + hashlib.sha256(archive).hexdigest().encode() + b"\n" + archive


def forged(content, **changes):
    """A checkpoint with other arrays and a right checksum; None leaves one out."""
    with np.load(io.BytesIO(content[len(HEAD) + 65 :])) as archive:
        arrays = {**archive, **changes}
    file = io.BytesIO()
    np.savez(file, **{name: array for name, array in arrays.items() if array is not None})
    return sealed(file.getvalue())


def about(content, **changes):
    """`about` of a checkpoint with other values; None leaves one out."""
    with np.load(io.BytesIO(content[len(HEAD) + 65 :])) as archive:
        values = {**json.loads(archive["about"].tobytes()), **changes}
    values = {name: value for name, value in values.items() if value is not None}
    return np.frombuffer(json.dumps(values).encode(), np.uint8)


def text(words):
    return np.frombuffer(words.encode(), np.uint8)


FORGED = {
    "pickle": lambda c: forged(c, q_table=np.array([Trap()], object)),
    "pickled about": lambda c: forged(c, about=np.array([Trap()], object)),
    "no table": lambda c: forged(c, q_table=None),
    "no episodes": lambda c: forged(c, totals=None),
    "no about": lambda c: forged(c, about=None),
    "small table": lambda c: forged(c, q_table=np.zeros((3, 2))),
    "table of text": lambda c: forged(c, q_table=np.full((144, 2), "x")),
    "table of numbers": lambda c: forged(c, q_table=np.zeros((144, 2), np.complex128)),
    "a column too short": lambda c: forged(c, totals=np.zeros(6)),
    "columns too long": lambda c: forged(
        c, totals=np.zeros(99), steps=np.zeros(99, np.int32), endings=np.zeros(99, np.int8)
    ),
    "other visits": lambda c: forged(c, state_visits=np.ones(288, np.int64)),
    "visits of another table": lambda c: forged(c, state_visits=np.ones(3, np.int64)),
    "sides that there are not": lambda c: forged(c, sides=np.full(7, 3, np.int8)),
    "about is noise": lambda c: forged(c, about=text("{")),
    "about is not text": lambda c: forged(c, about=np.full(9, 255, np.uint8)),
    "about is a list": lambda c: forged(c, about=text("[]")),
    "about is a number": lambda c: forged(c, about=text("3")),
    "about is deep": lambda c: forged(c, about=text("[" * 100_000)),
    "no config": lambda c: forged(c, about=about(c, config=None)),
    "a strange config": lambda c: forged(c, about=about(c, config={"colour": "red"})),
    "a wrong config": lambda c: forged(c, about=about(c, config={"gamma": 7})),
    "no generator": lambda c: forged(c, about=about(c, env_rng=None)),
    "a strange generator": lambda c: forged(c, about=about(c, env_rng={"state": 3})),
    "another generator": lambda c: forged(c, about=about(c, learner_rng={"bit_generator": "X"})),
    "seconds are words": lambda c: forged(c, about=about(c, seconds="long")),
    "empty archive": lambda c: sealed(b""),
    "text": lambda c: sealed(b"words"),
    "one array": lambda c: sealed(npy(np.zeros(3))),
    "a pickle file": lambda c: sealed(pickle.dumps(Trap())),
    "a zip of text": lambda c: sealed(zipped({"about.npy": b"text"})),
    "an empty zip": lambda c: sealed(zipped({})),
    "a huge array": lambda c: sealed(zipped({"about.npy": huge()})),
    "half a zip": lambda c: sealed(c[len(HEAD) + 65 : -30]),
    "a zip with a flipped bit": lambda c: sealed(flipped(c[len(HEAD) + 65 :])),
}


@pytest.mark.parametrize("method", METHODS)
def test_a_memory_that_no_training_has_is_refused_by_its_field(method, tmp_path):
    config = TrainConfig(method=method, backend="gym", episodes=5)
    save_checkpoint(tmp_path, found := checkpoint_after(2, config))
    path, content = tmp_path / LATEST, (tmp_path / LATEST).read_bytes()
    for name, array in found.snapshot.memory.items():
        values = array.copy()
        values[-1] = np.nan if array.dtype.kind == "f" else 2**60
        path.write_bytes(forged(content, **{name: values}))
        assert f"be understood: {name} has values that are not " in assert_refused(path, config)


def npy(array):
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def zipped(files):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for name, words in files.items():
            archive.writestr(name, words)
    return file.getvalue()


def huge():
    """An array that claims to be larger than any memory."""
    right = npy(np.zeros(3))
    return right.replace(b"(3,), }" + b" " * 12, b"(3" + b"0" * 12 + b",), }")


def flipped(archive):
    return archive[:300] + bytes([archive[300] ^ 1]) + archive[301:]


@pytest.mark.parametrize("kind", FORGED)
def test_a_forgery_with_a_right_checksum_is_refused_and_runs_no_code(
    kind, content, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / LATEST
    path.write_bytes(FORGED[kind](content))
    assert_refused(path)
    assert [entry.name for entry in tmp_path.iterdir()] == [LATEST]


def test_the_archive_is_the_same_for_the_same_state(checkpoint, content, tmp_path):
    save_checkpoint(tmp_path, checkpoint)
    assert (tmp_path / LATEST).read_bytes()[: len(HEAD)] == content[: len(HEAD)]
    assert len((tmp_path / LATEST).read_bytes()) == len(content)
