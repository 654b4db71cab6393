"""Ctrl-C, SIGTERM and SIGHUP."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from mjcartpole.signals import EXIT_CODES, Interrupted, StopSignals
from nightly import few

BOTH = pytest.mark.parametrize("number", list(EXIT_CODES))


def send(number):
    os.kill(os.getpid(), number)


@BOTH
def test_a_signal_raises_and_names_its_exit_code(number):
    signals = StopSignals()
    with signals.caught(), pytest.raises(Interrupted) as stopped:
        send(number)
    assert stopped.value.exit_code == 128 + number == EXIT_CODES[number]
    assert str(stopped.value) == "interrupted"
    assert isinstance(stopped.value, KeyboardInterrupt)
    assert signals.stop()
    assert signals.number == number


@BOTH
def test_a_deferred_signal_is_only_noted(number):
    signals = StopSignals()
    with signals.caught():
        with signals.deferred():
            assert not signals.stop()
            send(number)
            assert signals.stop()
        assert signals.number == number


@BOTH
def test_a_second_signal_raises_even_then(number):
    signals = StopSignals()
    with signals.caught(), pytest.raises(Interrupted) as stopped, signals.deferred():
        send(signal.SIGINT)
        send(number)
    assert stopped.value.exit_code == 128 + number


def test_after_something_was_finished_a_signal_raises_again():
    signals = StopSignals()
    with signals.caught():
        with signals.deferred():
            pass
        with pytest.raises(Interrupted):
            send(signal.SIGTERM)


def test_the_handlers_that_were_there_come_back():
    before = [signal.getsignal(number) for number in EXIT_CODES]
    signals = StopSignals()
    with pytest.raises(RuntimeError), signals.caught():
        assert [signal.getsignal(number) for number in EXIT_CODES] != before
        raise RuntimeError
    assert [signal.getsignal(number) for number in EXIT_CODES] == before


def test_another_thread_leaves_the_signals_alone():
    before, seen = [signal.getsignal(number) for number in EXIT_CODES], []

    def work():
        signals = StopSignals()
        with signals.caught(), signals.deferred():
            seen.append([signal.getsignal(number) for number in EXIT_CODES])
            seen.append(signals.stop())

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [before, False]


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="needs SIGHUP")
@pytest.mark.parametrize("number", [signal.SIGTERM, getattr(signal, "SIGHUP", 0)])
def test_a_signal_that_is_ignored_stays_ignored(number):
    before = signal.signal(number, signal.SIG_IGN)
    try:
        signals = StopSignals()
        with signals.caught():
            send(number)
            assert not signals.stop()
        assert signal.getsignal(number) is signal.SIG_IGN
    finally:
        signal.signal(number, before)


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="needs SIGHUP")
@pytest.mark.parametrize("seeds", few(["1", "2"], "1"))
def test_a_terminal_that_is_closed_ends_all_of_a_training_in_order(seeds, tmp_path):
    command = ["train", "--engine", "python", "--episodes", "100000", "--seeds", seeds]
    with subprocess.Popen(
        [sys.executable, "-m", "mjcartpole", *command, "--checkpoint-every", "0", "--run-dir", "r"],
        cwd=tmp_path,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        limit = time.monotonic() + 60
        while not list(tmp_path.glob("r/**/checkpoint.bin")) and time.monotonic() < limit:
            time.sleep(0.01)
        os.killpg(process.pid, signal.SIGHUP)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 129
    assert err.startswith("mjcartpole: interrupted ")
    assert err.count("\n") == 1
    assert "go on with: mjcartpole train --resume r" in err
    assert not list(tmp_path.rglob(".*"))
