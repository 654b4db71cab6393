"""A folder belongs to one training at a time, whatever others do meanwhile."""

import os
import shutil
import traceback

import pytest

from mjcartpole.errors import RunError
from mjcartpole.learning.folders import LOCK, held_folder, locked_folder
from nightly import at_night


def race(folder, work, processes=4, rounds=300):
    """Let processes hold one folder again and again; returns how often each did."""
    children = []
    for _ in range(processes):
        answer, question = os.pipe()
        if not (child := os.fork()):
            done = -1
            try:
                done = sum(work(folder) for _ in range(rounds))
            except BaseException:
                traceback.print_exc()
            finally:
                os.write(question, str(done).encode())
                os._exit(0)
        os.close(question)
        children.append((child, answer))
    counts = []
    for child, answer in children:
        counts.append(int(os.read(answer, 20)))
        os.close(answer)
        os.waitpid(child, 0)
    return counts


def hold(folder):
    """Hold a folder as its only one, if nobody else does."""
    try:
        with held_folder(folder):
            (folder / "mine").touch(exist_ok=False)
            (folder / "mine").unlink()
    except RunError as error:
        assert "in use by another training" in str(error)
        return False
    return True


@pytest.mark.long
def test_racing_trainings_hold_a_folder_one_after_the_other(tmp_path):
    counts = race(tmp_path / "deep" / "run", hold, rounds=at_night(300, fast=60))
    assert min(counts) >= 0
    assert sum(counts) > 0
    assert list((tmp_path / "deep").iterdir()) == []


def test_a_lock_that_leads_elsewhere_is_refused_and_what_it_leads_to_stays(tmp_path):
    mine, lock = tmp_path / "thesis.tex", tmp_path / "run" / LOCK
    mine.write_text("years of work")
    lock.parent.mkdir()
    makers = {
        "link": lambda: lock.symlink_to(mine),
        "second name": lambda: lock.hardlink_to(mine),
        "dangling": lambda: lock.symlink_to(tmp_path / "nothing"),
        "loop": lambda: lock.symlink_to(LOCK),
        "pipe": lambda: os.mkfifo(lock),
        "folder": lock.mkdir,
    }
    for make in makers.values():
        make()
        with pytest.raises(RunError, match="no lock of a training"), locked_folder(lock.parent):
            pass
        assert os.path.lexists(lock)
        lock.rmdir() if lock.is_dir() else lock.unlink()
    assert mine.read_text() == "years of work"
    assert not (tmp_path / "nothing").exists()


def test_what_killed_writers_have_left_goes_as_soon_as_a_folder_is_locked(tmp_path):
    for name in (LOCK, ".config-0123abcd.json", ".checkpoint-89abcdef.bin"):
        (tmp_path / name).touch()
    (tmp_path / ".link-0123abcd.json").symlink_to(shutil.__file__)
    with locked_folder(tmp_path):
        assert [path.name for path in tmp_path.iterdir()] == [LOCK]
    assert list(tmp_path.iterdir()) == []
    assert os.path.exists(shutil.__file__)
