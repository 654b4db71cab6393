"""Events as TensorBoard reads them."""

import itertools
import struct

import numpy as np
import pytest

from mjcartpole.learning import tensorboard
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.training import Training, train

event_pb2 = pytest.importorskip("tensorboardX.proto.event_pb2")


def read_curves(folder):
    """From a curve's name to its (step, value) pairs, in the order of the file."""
    (path,) = folder.glob("events.out.tfevents.*")
    content, curves = path.read_bytes(), {}
    while content:
        (length,) = struct.unpack("<Q", content[:8])
        event = event_pb2.Event.FromString(content[12 : 12 + length])
        content = content[12 + length + 4 :]
        for value in event.summary.value:
            curves.setdefault(value.tag, []).append((event.step, value.simple_value))
    return curves


def test_each_episode_is_a_point(tmp_path):
    result = train(TrainConfig(episodes=30, seed=3, backend="gym"))
    tensorboard.write_events(tmp_path, result)
    curves = read_curves(tmp_path)
    assert sorted(curves) == ["train/alpha", "train/epsilon", "train/return"]
    for points in curves.values():
        assert [step for step, _ in points] == list(range(1, 31))
    assert [value for _, value in curves["train/return"]] == result.returns.tolist()
    for name, start, end in (("alpha", 0.1, 0.003), ("epsilon", 1.0, 0.01)):
        values = [value for _, value in curves[f"train/{name}"]]
        assert values[0] == pytest.approx(start)
        assert values[-1] == pytest.approx(end)
        assert values == sorted(values, reverse=True)


def test_greedy_evaluations_are_curves_of_their_own(tmp_path):
    result = train(TrainConfig(episodes=30, backend="gym", evaluate_every=10))
    tensorboard.write_events(tmp_path, result)
    curve = read_curves(tmp_path)["train/greedy_mean"]
    assert [step for step, _ in curve] == [10, 20, 30]
    assert [value for _, value in curve] == pytest.approx([its.mean for its in result.evaluations])


def test_a_run_that_goes_on_has_neither_gap_nor_repeat(tmp_path):
    training = Training(TrainConfig(episodes=20, backend="gym"), engine="python")
    run = training.run()
    for _ in range(8):
        next(run)
    tensorboard.write_events(tmp_path, training.result())
    assert [step for step, _ in read_curves(tmp_path)["train/return"]] == list(range(1, 9))
    for _ in run:
        pass
    tensorboard.write_events(tmp_path, training.result())
    curve = read_curves(tmp_path)["train/return"]
    assert [step for step, _ in curve] == list(range(1, 21))
    assert [value for _, value in curve] == training.result().returns.tolist()
    assert len(list(tmp_path.iterdir())) == 1


def test_nothing_learned_is_an_empty_curve(tmp_path):
    tensorboard.write_events(tmp_path, Training(TrainConfig(episodes=5)).result())
    assert read_curves(tmp_path) == {}


def test_a_long_training_is_drawn_in_means_of_blocks(tmp_path, monkeypatch):
    monkeypatch.setattr(tensorboard, "POINTS", 10)
    result = train(TrainConfig(episodes=95, backend="gym"))
    tensorboard.write_events(tmp_path, result)
    curve = read_curves(tmp_path)["train/return"]
    assert len(curve) == 10
    assert curve[-1][0] == 95
    ends = [0, *(step for step, _ in curve)]
    means = [result.returns[a:b].mean() for a, b in itertools.pairwise(ends)]
    assert np.allclose([value for _, value in curve], means)
