"""A model that is edited while it is watched: real files, a real process."""

import contextlib
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mjcartpole.commands.watch import Watch
from mjcartpole.commands.watch_work import affordable
from mjcartpole.commands.watched_file import SavedAgainError, Watched
from mjcartpole.errors import ConfigError, ModelNotFoundError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.episodes import Episode, EpisodeLog
from mjcartpole.learning.training import TrainResult, train
from mjcartpole.media.mp4 import why_no_mp4
from mjcartpole.physics.load import load_model, models_folder

REFERENCE = (models_folder() / "cartpole.xml").read_text(encoding="utf-8")
LIGHT = REFERENCE.replace('gravity="0 0 -9.8"', 'gravity="0 0 -3"')
assert LIGHT != REFERENCE
BROKEN = "<mujoco><wordbody/></mujoco>"
NO_CARTPOLE = "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"
SUFFIX = ".gif" if why_no_mp4() else ".mp4"

SCRIPT = """
import sys
from pathlib import Path
from mjcartpole.commands.watch import Watch
try:
    sys.exit(Watch(Path(sys.argv[1]), episodes=int(sys.argv[2]), video=sys.argv[3] == "1").run())
except KeyboardInterrupt as stop:
    print(stop, file=sys.stderr)
    sys.exit(stop.exit_code)
"""


@pytest.fixture
def file(tmp_path, monkeypatch):
    """A model where the program runs."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "mine.xml"
    path.write_text(REFERENCE, encoding="utf-8")
    return path


class Watcher:
    """`watch` in a process of its own, and what it says."""

    def __init__(self, path, episodes=100, video=False):
        arguments = [sys.executable, "-u", "-c", SCRIPT, path.name, str(episodes), str(int(video))]
        self.process = subprocess.Popen(
            arguments,
            cwd=path.parent,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.lines = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.process.stdout:
            self.lines.put(line.rstrip("\n"))

    def until(self, word, seconds=60):
        """The lines up to one whose first word is this."""
        found, end = [], time.monotonic() + seconds
        while True:
            try:
                found.append(self.lines.get(timeout=max(0.01, end - time.monotonic())))
            except queue.Empty:
                pytest.fail(f"no {word!r} in {seconds} s after {found}")
            if found[-1].split()[:1] == [word]:
                return found

    def end(self, number=signal.SIGINT):
        """Exit code, stderr."""
        self.process.send_signal(number)
        return self.process.wait(30), self.process.stderr.read()


@pytest.fixture
def watch(file):
    with contextlib.ExitStack() as stack:

        def start(**settings):
            watcher = Watcher(file, **settings)
            stack.callback(watcher.process.stdout.close)
            stack.callback(watcher.process.stderr.close)
            stack.callback(watcher.process.wait)
            stack.callback(watcher.process.kill)
            return watcher

        yield start


def replace(path, text):
    """Save as editors do: another file takes the place of the old one."""
    other = path.with_suffix(".swp")
    other.write_text(text, encoding="utf-8")
    other.replace(path)


def test_one_look(file, capsys):
    assert Watch(file, once=1, episodes=4).run() == 0
    words = [line.split()[0] for line in capsys.readouterr().out.splitlines() if line]
    expected = ["sketch", "parity", "training", "greedy", "video", "done"]
    assert [word for word in words if word in expected] == expected
    with Image.open("videos/mine-sketch.png") as picture:
        assert picture.size == (640, 480)
        assert np.asarray(picture).std() > 5
    assert Path(f"videos/mine{SUFFIX}").stat().st_size > 1000


@pytest.mark.slow
def test_parity_holds_for_the_reference_and_is_beyond_for_the_rest(file, capsys):
    Watch(file, once=1, episodes=5, video=False).run()
    assert "parity    as the equations say (rung 2, 3, 4)" in capsys.readouterr().out
    file.write_text(REFERENCE.replace('name="hinge"', 'name="hinge" stiffness="1"'))
    Watch(file, once=1, episodes=5, video=False).run()
    assert "beyond the equations" in capsys.readouterr().out


SAVES = [LIGHT, BROKEN, REFERENCE, NO_CARTPOLE, LIGHT, "", "not XML", REFERENCE, LIGHT, BROKEN]


@pytest.mark.slow
@pytest.mark.parametrize("saves", [SAVES[:3], SAVES], ids=["three", "ten"])
def test_edits_good_and_broken(saves, file, watch):
    watcher = watch(episodes=20)
    watcher.until("done")
    for text in saves:
        saved = time.monotonic()
        replace(file, text)
        good = text in (LIGHT, REFERENCE)
        lines = watcher.until("done" if good else "waiting")
        assert time.monotonic() - saved < 15
        assert any("error" in line for line in lines) == (not good)
        assert len([line for line in lines if line.startswith("  error")]) <= 1
    code, stderr = watcher.end()
    assert code == 130
    assert stderr == "no longer watching mine.xml\n"


@pytest.mark.slow
def test_a_file_that_is_written_in_pieces_is_one_save(file, watch):
    """Each piece is a broken file."""
    watcher = watch(episodes=20)
    watcher.until("done")
    pieces = [LIGHT[start : start + 2500] for start in range(0, len(LIGHT), 2500)]
    with file.open("w", encoding="utf-8") as target:
        for piece in pieces:
            target.write(piece)
            target.flush()
            time.sleep(0.2)
    assert not any("error" in line for line in watcher.until("done"))
    assert watcher.end()[0] == 130


@pytest.mark.slow
def test_from_a_save_to_a_new_video(file, watch):
    watcher = watch(episodes=1500, video=True)
    watcher.until("done")
    video = file.parent / "videos" / f"mine{SUFFIX}"
    before = video.read_bytes()
    saved = time.monotonic()
    replace(file, LIGHT)
    watcher.until("sketch")
    # A second on a machine with nothing else to do.
    assert time.monotonic() - saved < 5
    watcher.until("done")
    assert time.monotonic() - saved < 15
    assert video.read_bytes() != before
    assert watcher.end(signal.SIGTERM)[0] == 143


@pytest.mark.slow
def test_a_save_during_the_work_starts_over(file, watch):
    watcher = watch(episodes=1_000_000)
    watcher.until("parity")
    time.sleep(0.5)
    replace(file, LIGHT)
    started = time.monotonic()
    assert "starting over" in watcher.until("saved")[-1]
    assert time.monotonic() - started < 5
    watcher.until("sketch")
    # Ctrl-C in the middle of a training.
    watcher.until("parity")
    assert watcher.end() == (130, "no longer watching mine.xml\n")


def test_a_slow_training_is_cut_short():
    config = TrainConfig.preset("tuned", episodes=1000)
    policy = train(TrainConfig.preset("tuned", episodes=1)).policy

    def at(seconds, episodes):
        """A training after so many episodes of 500 steps."""
        log = EpisodeLog(config.episodes)
        for number in range(episodes):
            log.append(Episode(number, 500.0, 500, "time limit"))
        return TrainResult(config, policy, log, seconds)

    assert affordable(at(0.1, 1)) == 1000  # Too soon to tell.
    assert affordable(at(0.7, 300)) == 1000
    assert affordable(at(1.0, 50)) == 300
    assert affordable(at(60.0, 2)) == 20


class TestWatched:
    """What counts as a save."""

    @pytest.fixture
    def watched(self, file):
        found = Watched(file)
        found.take()
        return found

    def test_nothing_happened(self, watched):
        assert not watched.has_changed()
        watched.check()

    def test_touched(self, watched, file):
        os.utime(file, (1, 1))
        assert not watched.has_changed()

    def test_written(self, watched, file):
        file.write_text(LIGHT)
        assert watched.has_changed()
        with pytest.raises(SavedAgainError):
            watched.check()
        watched.take()
        assert not watched.has_changed()

    def test_written_to_the_same_size_and_time(self, watched, file):
        about = file.stat()
        file.write_text(REFERENCE.replace("-9.8", "-9.7"))
        os.utime(file, ns=(about.st_atime_ns, about.st_mtime_ns))
        assert file.stat().st_size == about.st_size
        assert watched.has_changed()

    def test_replaced(self, watched, file):
        replace(file, LIGHT)
        assert watched.has_changed()

    def test_gone_and_back(self, watched, file):
        file.unlink()
        assert not watched.has_changed()
        file.write_text(REFERENCE)
        assert not watched.has_changed()
        file.unlink()
        file.write_text(LIGHT)
        assert watched.has_changed()

    def test_half_written(self, watched, file):
        """What an editor has not finished is waited for."""

        def slowly():
            with file.open("w") as stream:
                for start in range(0, len(LIGHT), 1000):
                    stream.write(LIGHT[start : start + 1000])
                    stream.flush()
                    time.sleep(0.01)

        writer = threading.Thread(target=slowly)
        writer.start()
        while not watched.has_changed():
            pass
        assert file.read_text() == LIGHT
        writer.join()

    def test_an_include(self, file):
        head, tail = REFERENCE.split("<worldbody>", 1)
        part = file.with_name("part.xml")
        part.write_text("<mujoco><size memory='1M'/></mujoco>")
        file.write_text(f'{head}<include file="part.xml"/><worldbody>{tail}')
        load_model(file)
        watched = Watched(file)
        watched.take()
        assert not watched.has_changed()
        part.write_text("<mujoco><size memory='2M'/></mujoco>")
        assert watched.has_changed()
        watched.take()
        part.unlink()
        assert watched.has_changed()


def test_mistakes_are_told_at_once(file):
    with pytest.raises(ModelNotFoundError):
        Watch(file.with_name("nothing.xml")).run()
    with pytest.raises(ConfigError, match="preset"):
        Watch(file, preset="tnued").run()
    with pytest.raises(ConfigError, match="once"):
        Watch(file, once=0).run()
    with pytest.raises(ConfigError, match="episodes"):
        Watch(file, episodes=0).run()
    with pytest.raises(ConfigError, match="integrator"):
        Watch(file, integrator="rk4").run()


@pytest.mark.slow
def test_the_presets_own_rules_are_played(file, capsys):
    Watch(file, preset="swing-up", once=1, episodes=5, video=False).run()
    assert "pole fell" not in capsys.readouterr().out
