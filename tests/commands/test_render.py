"""What `mjcartpole render` leaves and says; opened again by PyAV and by Pillow."""

import os
import re
import select
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from command_line import QUICK, call, done
from mjcartpole.commands.policies import set_up
from mjcartpole.studies.eval_target import EvalTarget
from mjcartpole.studies.film import play
from nightly import few

SMALL = ["--size", "160x120", "--quality", "draft"]


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A folder of runs that fall soon: mujoco, gym, article."""
    folder = tmp_path_factory.mktemp("runs")
    ways = {"mujoco": [], "gym": ["--backend", "gym"], "article": ["--preset", "article"]}
    for name, flags in ways.items():
        done(["train", *flags, *QUICK, "--seed", "8", "--run-dir", folder / name])
    return folder


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def render(arguments, capsys):
    """Render something small; returns the line on stdout."""
    code, out, err = call(["render", *arguments, *SMALL], capsys)
    assert (code, err) == (0, "")
    assert out.count("\n") == 1
    return out


def steps_of(run, episodes=1, **choice):
    takes = play(set_up(run, EvalTarget(**choice)), episodes)
    return [take.episode.steps for take in takes]


def mp4(path):
    """Frames and rate of an mp4, as FFmpeg reads it."""
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.codec.name, stream.pix_fmt) == ("h264", "yuv420p")
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
        seconds, fps = container.duration / av.time_base, float(stream.average_rate)
    frames = np.array(pictures)
    assert seconds == pytest.approx(len(frames) / fps, abs=0.011)
    return frames, fps


def animation(path):
    """Frames and durations in ms, as Pillow reads them."""
    frames, durations = [], []
    with Image.open(path) as image:
        for index in range(image.n_frames):
            image.seek(index)
            frames.append(np.asarray(image.convert("RGB")))
            durations.append(image.info["duration"])
    return frames, durations


def test_one_run_goes_where_videos_go(runs, here, capsys):
    out = render([runs / "mujoco"], capsys)
    [take] = play(set_up(runs / "mujoco", EvalTarget()))
    steps, ending = take.episode.steps, take.episode.ending
    seconds = f"{(steps + 1) / 50:.1f} s"
    assert out.startswith(f"video  videos/mujoco.mp4  ({steps} steps, {ending}; {seconds}, ")
    assert re.search(r"160x120, drawn by (egl|osmesa|sketch|glfw)\)$", out)
    frames, fps = mp4("videos/mujoco.mp4")
    assert (len(frames), fps, frames[0].shape) == (steps + 1, 50, (120, 160, 3))
    assert [path.name for path in here.rglob("*.*")] == ["mujoco.mp4"]


FORMATS = ["out.mp4", "deep/er/out.gif", "out.webp", "pictures", "dir/"]


@pytest.mark.parametrize("name", few(FORMATS, *FORMATS[1:4]))
def test_every_format_opens_elsewhere(runs, name, capsys):
    out = render([runs / "mujoco", "-o", name, "--fps", "25"], capsys)
    [steps] = steps_of(runs / "mujoco")
    assert f"  {name.rstrip('/')}  (" in out
    if name.endswith(".mp4"):
        frames, fps = mp4(name)
        assert fps == 25
    elif name.endswith((".gif", ".webp")):
        frames, durations = animation(name)
        assert set(durations) == {40}
    else:
        files = sorted(os.listdir(name))
        assert files == [f"{index:06d}.png" for index in range(len(files))]
        frames = [np.asarray(Image.open(os.path.join(name, file))) for file in files]
    assert len(frames) == steps // 2 + 1
    assert {frame.shape for frame in frames} == {(120, 160, 3)}
    assert not np.array_equal(frames[0], frames[-1])


@pytest.mark.long
def test_slow_motion_has_four_times_the_frames(runs, capsys):
    render([runs / "mujoco", "-o", "out.mp4", "--speed", "0.25"], capsys)
    frames, fps = mp4("out.mp4")
    assert (len(frames), fps) == (4 * steps_of(runs / "mujoco")[0] + 1, 50)


@pytest.mark.slow
def test_several_episodes_follow_each_other(runs, capsys):
    out = render([runs / "mujoco", "-o", "out.mp4", "--episodes", "3", "--seed", "5"], capsys)
    steps = steps_of(runs / "mujoco", 3, seed=5)
    assert f"3 episodes of {min(steps)} to {max(steps)} steps" in out
    assert len(mp4("out.mp4")[0]) == sum(steps) + 3


@pytest.mark.long
def test_a_seed_decides_where_it_starts(runs, capsys):
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        render([runs / "mujoco", "-o", f"{name}.webp", "--seed", seed], capsys)
    first = {name: animation(f"{name}.webp")[0][0] for name in "abc"}
    assert np.array_equal(first["a"], first["b"])
    assert not np.array_equal(first["a"], first["c"])


@pytest.mark.long
def test_a_camera_follows_the_cart(runs, capsys):
    for camera in ("side", "follow"):
        render([runs / "mujoco", "-o", f"{camera}.webp", "--camera", camera], capsys)
    side, follow = (animation(f"{camera}.webp")[0] for camera in ("side", "follow"))
    assert len(side) == len(follow)
    assert not np.array_equal(side[0], follow[0])


@pytest.mark.parametrize(
    "pair", [("mujoco", "gym"), pytest.param(("article", "mujoco"), marks=pytest.mark.slow)]
)
def test_two_runs_side_by_side_start_alike(runs, pair, capsys):
    out = render([*(runs / name for name in pair)], capsys)
    path = f"videos/{pair[0]}-beside-{pair[1]}.mp4"
    assert path in out
    steps = [steps_of(runs / name)[0] for name in pair]
    assert f"2 episodes of {f'{min(steps)} to ' * (len(set(steps)) > 1)}{max(steps)} steps" in out
    frames, _ = mp4(path)
    assert len(frames) == max(steps) + 1
    height, width = frames[0].shape[:2]
    assert width == 2 * 160 + 2
    assert height > 120
    left, right = frames[0][:, :160].astype(int), frames[0][:, -160:].astype(int)
    label = height - 120
    assert np.abs(left[label:] - right[label:]).mean() < 1
    # Dark letters on light paper, others on either side.
    assert left[:label].min() < 120 > right[:label].min()
    assert np.abs(left[:label] - right[:label]).max() > 50


@pytest.mark.slow
def test_many_runs_make_a_grid_with_a_short_name(runs, capsys):
    many = [runs / name for name in ("mujoco", "gym", "article", "mujoco", "gym")] * 2
    render(many, capsys)
    frames, _ = mp4("videos/mujoco-beside-9-others.mp4")
    assert frames[0].shape[1] == 4 * 160 + 3 * 2


def test_a_run_can_be_filmed_elsewhere(runs, here, capsys):
    render([runs / "mujoco", "-o", "gym.mp4", "--backend", "gym"], capsys)
    assert len(mp4("gym.mp4")[0]) == steps_of(runs / "mujoco", backend="gym")[0] + 1


@pytest.mark.long
def test_a_policy_file_alone_is_enough(runs, capsys):
    assert "videos/mujoco.mp4" in render([runs / "mujoco" / "policy.json"], capsys)
    copy = shutil.copy(runs / "mujoco" / "policy.json", runs / "mine.json")
    assert "videos/mine.mp4" in render([copy], capsys)


@pytest.mark.slow
def test_the_fall_is_shown_four_times_slower(runs, capsys):
    render([runs / "mujoco", "-o", "out.mp4", "--fall"], capsys)
    shown = min(50, steps_of(runs / "mujoco")[0])
    assert len(mp4("out.mp4")[0]) == 4 * shown + 1


@pytest.mark.slow
def test_an_overlay_changes_a_part_of_the_picture(runs, capsys):
    size = ["--size", "320x240"]
    for name, flags in (("plain", ["--no-overlay"]), ("overlay", ["--overlay"])):
        call(["render", runs / "mujoco", "-o", f"{name}.webp", *flags, *size], capsys)
    plain, overlay = (animation(f"{name}.webp")[0] for name in ("plain", "overlay"))
    assert len(plain) == len(overlay)
    different = (plain[0] != overlay[0]).any(axis=2).mean()
    assert 0.02 < different < 0.3


@pytest.mark.parametrize("output", [None, "deep/sheet.PNG"])
def test_a_contact_sheet_is_one_picture(runs, output, capsys):
    where = ["-o", output] if output else []
    out = render([runs / "mujoco", "--sheet", *where], capsys)
    path = output or "videos/mujoco.png"
    assert out.startswith(f"sheet  {path}  (")
    with Image.open(path) as image:
        assert image.format == "PNG"
        assert image.width == 5 * 160 + 4 * 2
        assert f"; {image.width}x{image.height}, drawn by" in out


def test_an_odd_size_is_cut_and_said_so(runs, capsys):
    arguments = ["render", runs / "mujoco", "-o", "out.mp4", "--size", "161x121"]
    code, out, err = call(arguments, capsys)
    assert code == 0
    assert err == "mjcartpole: H.264 needs an even width and height: 161x121 is cut to 160x120\n"
    assert "160x120" in out
    assert mp4("out.mp4")[0][0].shape == (120, 160, 3)


@pytest.mark.long
def test_a_pictures_odd_size_stays(runs, capsys):
    code, out, err = call(["render", runs / "mujoco", "-o", "p", "--size", "161x121"], capsys)
    assert (code, err) == (0, "")
    assert "161x121" in out
    with Image.open("p/000000.png") as image:
        assert image.size == (161, 121)


@pytest.mark.long
def test_a_film_is_never_replaced_unasked(runs, capsys):
    first = render([runs / "mujoco"], capsys)
    again = render([runs / "mujoco", "--backend", "gym"], capsys)
    assert "  videos/mujoco.mp4  " in first
    assert "  videos/mujoco-2.mp4  " in again
    before = {path: path.read_bytes() for path in Path("videos").iterdir()}
    for output in ("videos/mujoco.mp4", "pictures", "sheet.png"):
        sheet = ["--sheet"] if output.endswith("png") else []
        arguments = [runs / "mujoco", "-o", output, *sheet]
        if not output.endswith("mp4"):
            render(arguments, capsys)
        code, out, err = call(["render", *arguments, *SMALL], capsys)
        assert (code, out) == (2, "")
        expected = f"'{output}' exists; choose another -o, or replace it with --overwrite"
        assert err == f"mjcartpole: error: {expected}\n"
        render([*arguments, "--overwrite", "--seed", "3"], capsys)
    after = {path: path.read_bytes() for path in Path("videos").iterdir()}
    assert [path.name for path in before if before[path] != after[path]] == ["mujoco.mp4"]
    assert "  videos/mujoco.mp4  " in render([runs / "mujoco", "--overwrite"], capsys)


@pytest.mark.slow
def test_a_long_name_is_cut(runs, capsys):
    copy = shutil.copytree(runs / "mujoco", runs / ("y" * 255), dirs_exist_ok=True)
    assert re.search(r"  videos/y{200,}-[0-9a-f]{8}\.mp4  ", render([copy], capsys))
    assert re.search(r"  videos/y+-[0-9a-f]{8}-beside-", render([copy] * 3, capsys))


MISTAKES = [
    (["--camera", "moon"], "no camera 'moon'; available: side, follow"),
    (["--size", "640"], "--size is a width and a height in pixels, such as 640x480, not '640'"),
    (["--size", "640x"], "not '640x'"),
    (["--size", "-1x480"], "not '-1x480'"),
    (["--size", "6.5x480"], "not '6.5x480'"),
    (["--size", "0x480"], "width 0 is no size of a picture; use a whole number of pixels from 16"),
    (["--size", "640x99999"], "height 99999 is no size of a picture"),
    (["-o", "out.avi"], "'out.avi' is no video format that can be written; use .mp4, .gif, .webp"),
    (["-o", "a-file/out.mp4"], "a-file"),
    (["-o", "a-folder.mp4"], "'a-folder.mp4': it is a folder; give the path of a file"),
    (["-o", "full"], "'full' holds 'thesis.tex', which is no numbered picture"),
    (["-o", "a-file"], "cannot write 'a-file'"),
    (["--quality", "best"], "'best'"),
    (["--speed", "0"], "speed 0 makes no sense"),
    (["--speed", "-1", "--fps", "25"], "speed -1 makes no sense"),
    (["--speed", "1e-300"], "speed 1e-300 makes no sense"),
    (["--speed", "nan"], "speed nan makes no sense"),
    (["--speed", "fast"], "fast"),
    (["--fps", "0"], "fps 0 makes no sense; use 1 to 1000"),
    (["--fps", "1e9"], "fps 1e+09 makes no sense"),
    (["--seed", "-4"], "seed must be a whole number from 0 up, not -4"),
    (["--sheet"], "a contact sheet shows one episode, not 1000000000"),
    (["--sheet", "--episodes", "1", "-o", "out.mp4"], "a contact sheet is a .png, not 'out.mp4'"),
    (["RUN", "RUN", "--sheet"], "a contact sheet shows one run, not 2"),
    (["nowhere"], "no run folder or policy file 'nowhere'"),
    (["--episodes", "0"], "episodes must be a whole number from 1 up, not 0"),
    (["--backend", "gym", "--model", "cartpole.xml"], "cartpole.xml"),
    (["--model", "cartpol"], "did you mean 'cartpole'"),
    (["--colour", "red"], "--colour"),
]


@pytest.mark.parametrize(("arguments", "message"), few(MISTAKES, *MISTAKES[::2]), ids=str)
def test_a_mistake_is_one_line_before_anything_is_played(runs, here, arguments, message, capsys):
    (here / "full").mkdir()
    (here / "full" / "thesis.tex").write_text("years of work")
    (here / "a-file").write_text("text")
    (here / "a-folder.mp4").mkdir()
    before = sorted(here.rglob("*"))
    # To play as many would take days.
    words = [str(runs / "mujoco") if word == "RUN" else word for word in arguments]
    sources = [runs / "mujoco"] if words[0].startswith("-") else []
    often = [] if "--episodes" in words else ["--episodes", "1000000000"]
    code, out, err = call(["render", *sources, *words, *often], capsys)
    assert (code, out) == (2, "")
    assert err.startswith("mjcartpole: error: ")
    assert err.count("\n") == 1
    assert message in err
    assert sorted(here.rglob("*")) == before


@pytest.mark.skipif(sys.platform != "linux", reason="needs a folder that nobody can write")
def test_a_folder_that_nobody_can_write_is_one_line(runs, capsys):
    arguments = ["render", runs / "mujoco", "--episodes", "1000000000", "-o", "/proc/no/a.mp4"]
    code, out, err = call(arguments, capsys)
    assert (code, out) == (2, "")
    assert (
        err == "mjcartpole: error: cannot make the folder '/proc/no': No such file or directory\n"
    )


def start_long(runs, name, *more, **options):
    """Start a film of a thousand frames per control step; to try OpenGL would take longer."""
    flags = ["-o", f"out/{name}", "--speed", "0.001", *SMALL, *more]
    command = [sys.executable, "-m", "mjcartpole", "render", str(runs / "mujoco"), *flags]
    environment = {**os.environ, "MUJOCO_GL": "disable", "TERM": "xterm", "COLUMNS": "100"}
    return subprocess.Popen(command, env=environment, **options)


def wait_for_something_in(folder):
    """Wait until an encoder has begun: its temporary file is no longer empty."""
    until = time.monotonic() + 60
    while time.monotonic() < until:
        if any(path.is_file() and path.stat().st_size for path in folder.rglob("*")):
            return
        time.sleep(0.01)
    pytest.fail("nothing was written")


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="kill ends a process without a word there")
@pytest.mark.parametrize("name", ["out.gif", "pictures"])
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupted_film_leaves_nothing(runs, here, name, number, code):
    pipe = subprocess.PIPE
    with start_long(runs, name, stdout=pipe, stderr=pipe, text=True) as process:
        wait_for_something_in(here)
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (code, "", "mjcartpole: interrupted\n")
    assert not list((here / "out").iterdir())


@pytest.mark.skipif(os.name == "nt", reason="kill ends a process without a word there")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
@pytest.mark.slow
def test_an_interrupted_mp4_leaves_the_old_one(runs, here, number, code):
    (here / "out").mkdir()
    (here / "out" / "out.mp4").write_bytes(b"old")
    with start_long(runs, "out.mp4", "--overwrite", stderr=subprocess.PIPE, text=True) as process:
        until = time.monotonic() + 60
        while len(list((here / "out").iterdir())) == 1 and time.monotonic() < until:
            time.sleep(0.01)
        # The encoder holds its first frames back: let it have some.
        time.sleep(0.3)
        process.send_signal(number)
        err = process.communicate(timeout=60)[1]
    assert (process.returncode, err) == (code, "mjcartpole: interrupted\n")
    assert [path.read_bytes() for path in (here / "out").iterdir()] == [b"old"]


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt", reason="needs a terminal that a program can read")
def test_on_a_terminal_there_is_a_progress_bar_that_goes_away(runs, here):
    import pty

    reader, writer = pty.openpty()
    with start_long(runs, "out.gif", stderr=writer) as process:
        wait_for_something_in(here)
        shown = b""
        while b"filming" not in shown:
            shown += os.read(reader, 4096)
        process.send_signal(signal.SIGINT)
    # This process has it open as well: nothing is lost when the other one closes it.
    while select.select([reader], [], [], 0.5)[0]:
        shown += os.read(reader, 4096)
    os.close(writer)
    os.close(reader)
    assert process.returncode == 130
    hide, show = b"\x1b[?25l", b"\x1b[?25h"
    assert shown.count(hide) == shown.count(show) == 1
    assert shown.endswith(b"mjcartpole: interrupted\r\n")
    assert shown.index(show) < shown.index(b"mjcartpole: interrupted")
