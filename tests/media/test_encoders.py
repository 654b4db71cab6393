"""Which ffmpeg encodes: tried with some that do not run, do not answer, or are not there."""

import logging
import re
import shutil
import stat

import numpy as np
import pytest
from PIL import Image

from mjcartpole.media import encoders
from mjcartpole.media.video import write_video

FRAME = np.full((48, 64, 3), 200, np.uint8)


def script(path, body):
    path.write_text(f"#!/bin/sh\n{body}\n")
    path.chmod(0o755)
    return str(path)


@pytest.fixture
def real():
    """The ffmpeg of the wheel."""
    found = encoders.examine("imageio-ffmpeg")
    if not found.codec:
        pytest.skip(f"the wheel's ffmpeg does not run here: {found.reason}")
    return found.program


@pytest.fixture
def without_wheel(real, monkeypatch, tmp_path):
    """As if the wheel's binary had lost its executable bit."""
    broken = tmp_path / "wheel" / "ffmpeg-broken"
    broken.parent.mkdir()
    broken.write_bytes(b"\x7fELF")
    broken.chmod(stat.S_IRUSR)
    monkeypatch.setitem(encoders.SOURCES, "imageio-ffmpeg", lambda: str(broken))
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    monkeypatch.delenv(encoders.VARIABLE, raising=False)
    (tmp_path / "bin").mkdir()
    return tmp_path / "bin"


def test_the_wheel_brings_one_with_x264(real):
    found = encoders.examine("imageio-ffmpeg")
    assert (found.program, found.codec, found.reason) == (real, "libx264", "")
    assert found.version


def test_the_users_choice_comes_first(monkeypatch, tmp_path, real):
    copy = tmp_path / "my-ffmpeg"
    copy.symlink_to(real)
    monkeypatch.setenv(encoders.VARIABLE, str(copy))
    assert encoders.find_ffmpeg().program == str(copy)
    assert encoders.why_not_the_first() == ""


def test_a_users_choice_that_does_not_run_is_explained(monkeypatch, tmp_path, real, caplog):
    monkeypatch.setenv(encoders.VARIABLE, "/no/such/ffmpeg")
    assert write_video(tmp_path / "run.mp4", [FRAME] * 3).path == tmp_path / "run.mp4"
    assert caplog.messages == [
        "IMAGEIO_FFMPEG_EXE: '/no/such/ffmpeg' cannot be run (No such file or directory); "
        f"using '{real}'"
    ]


def test_the_systems_ffmpeg_stands_in(real, without_wheel, tmp_path, caplog):
    system = without_wheel / "ffmpeg"
    system.symlink_to(real)
    video = write_video(tmp_path / "run.mp4", [FRAME] * 3)
    assert (video.path, video.frames) == (tmp_path / "run.mp4", 3)
    assert len(caplog.messages) == 1
    assert "imageio-ffmpeg: " in caplog.text
    assert f"using '{system}'" in caplog.text


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("exit 7", r"fails \(exit code 7\)"),
        ("echo hello", r"fails \(exit code 0\)"),
        ("echo ffmpeg version 5; echo ' V..... mpeg4  MPEG-4'", "was built without libx264 and"),
        ("sleep 60", "does not answer"),
    ],
)
def test_without_any_encoder_a_gif_is_written(
    without_wheel, tmp_path, caplog, monkeypatch, body, reason
):
    monkeypatch.setattr(encoders, "_SECONDS", 0.5)
    monkeypatch.setenv("PATH", f"{without_wheel}:/usr/bin:/bin")
    script(without_wheel / "ffmpeg", body.replace("sleep", "exec sleep"))
    with caplog.at_level(logging.WARNING):
        video = write_video(tmp_path / "run.mp4", [FRAME] * 3)
    assert video.path == tmp_path / "run.gif"
    assert not (tmp_path / "run.mp4").exists()
    with Image.open(video.path) as image:
        assert image.n_frames == 3
    [message] = caplog.messages
    assert message.startswith("no mp4 (IMAGEIO_FFMPEG_EXE: not set; imageio-ffmpeg: ")
    assert message.endswith(f"writing '{video.path}' instead")
    assert re.search(reason, message)


def test_another_h264_encoder_than_x264_will_do(real, without_wheel, tmp_path):
    """An ffmpeg that lists no x264, as some distributions build it."""
    listing = "echo 'ffmpeg version 5'; echo ' V..... libopenh264  H.264'"
    script(
        without_wheel / "ffmpeg",
        f'if [ "$1" = -encoders ]; then {listing}; else exec {real} "$@"; fi',
    )
    assert encoders.find_ffmpeg().codec == "libopenh264"
    video = write_video(tmp_path / "run.mp4", [FRAME] * 10)
    assert (video.path.suffix, video.frames) == (".mp4", 10)


def test_nothing_on_the_path_is_no_error(without_wheel):
    assert shutil.which("ffmpeg") is None
    assert encoders.find_ffmpeg() is None
    assert encoders.examine("PATH").reason == "no ffmpeg there"
