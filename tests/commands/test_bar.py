"""A bar on a terminal, and nothing of it elsewhere."""

import io
import sys

import pytest

from mjcartpole.commands import bar
from mjcartpole.commands.bar import Bar
from mjcartpole.output import ERASE


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_line_says_how_far_it_has_come_and_how_long_it_will_take(monkeypatch):
    clock = iter([0.0, 100.0])
    monkeypatch.setattr(bar.time, "monotonic", lambda: next(clock))
    shown = Bar(lambda: "training", 1_000, "episodes")
    with shown:
        assert shown.line() == f"training {'─' * 40} 0/1,000 episodes"
        shown.done, shown.said = 25, ", mean return  20.0"
        line = f"training ━{'─' * 39} 25/1,000 episodes, mean return  20.0 1:05:00"
        assert shown.line() == line


def test_where_nobody_knows_how_much_there_is_only_a_word_is_said():
    assert Bar(lambda: "climbing …").line() == "climbing …"


def test_on_a_terminal_it_is_drawn_and_gone_at_the_end(monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setattr(bar, "EVERY", 0.001)
    monkeypatch.setenv("COLUMNS", "12")
    monkeypatch.setenv("TERM", "xterm")
    with Bar(lambda: "filming for long", 3) as shown:
        while "filming" not in sys.stderr.getvalue():
            pass
        assert list(shown.track("abc")) == ["a", "b", "c"]
        assert shown.done == 3
    first, *_, last = sys.stderr.getvalue().split(ERASE)[1:]
    assert (first, last) == ("filming for", "\x1b[?25h")


@pytest.mark.parametrize("dumb", [False, True])
def test_elsewhere_nothing_is_written(dumb, monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal() if dumb else io.StringIO())
    monkeypatch.setattr(bar, "EVERY", 0.001)
    monkeypatch.setenv("TERM", "dumb" if dumb else "xterm")
    with Bar(lambda: "filming", 2) as shown:
        assert list(shown.track("ab")) == ["a", "b"]
    assert sys.stderr.getvalue() == ""
