"""What a notebook shows."""

import sys

import gymnasium
import pytest

from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.training import Training, train

CONFIG = TrainConfig(episodes=5, backend="gym", evaluate_every=5)


@pytest.fixture(scope="module")
def result():
    return train(CONFIG)


@pytest.mark.long
def test_results_and_policies_have_a_picture(result):
    pytest.importorskip("matplotlib")
    for shown in (result, result.policy):
        html = shown._repr_html_()
        assert html.startswith(f"<pre>{repr(shown)[:5]}")
        assert "data:image/png;base64," in html
        assert len(html) < 200_000


def test_without_matplotlib_there_is_a_line(result, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    for shown in (result, result.policy):
        assert "img" not in shown._repr_html_()


def test_what_has_nothing_to_draw_is_a_line():
    assert "img" not in Training(CONFIG).result()._repr_html_()
    grid = Discretizer((2,), (0.0,), (1.0,))
    assert "img" not in Policy(grid, train(CONFIG).q_table[0, 0, 0, :2])._repr_html_()


def test_an_evaluation_is_a_table_of_endings(result):
    played = evaluate(result.policy, backend="gym", episodes=4)
    html = played._repr_html_()
    for ending, count in played.endings.items():
        assert f"<tr><td>{ending}</td><td>{count}</td>" in html


def test_an_environment_has_a_picture_of_its_state():
    env = gymnasium.make("mjcartpole/CartPole-v1").unwrapped
    before = env._repr_html_()
    env.reset(seed=0)
    env.state = (1.0, 0.0, 0.2, 0.0)
    assert "data:image/png;base64," in before != env._repr_html_()
