"""Run folders that somebody else made, or broke: one line each, and nothing beside them changes."""

import io
import json
import os
import random
import shutil
import sys
import time

import pytest

from mjcartpole import cli
from mjcartpole.learning import runs
from mjcartpole.learning.checkpoints import FORMER, LATEST
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.session import Session
from mjcartpole.learning.training import Training
from mjcartpole.physics.load import load_model
from mjcartpole.studies.finish_training import finish_training
from nightly import few

LIMIT = 20.0
"""Seconds that nothing may take."""

EPISODES = ["--episodes", "6", "--no-curve"]


def interrupted(folder, config):
    """Leave a run with two checkpoints and the results so far, as a signal does."""
    folder.mkdir(parents=True)
    cartpole, training = load_model(), Training(config, engine="python")
    runs.begin_run(folder, config, cartpole, preset="tuned")
    session = Session(folder, training, cartpole, every=0)
    for finished in training.run():
        session.save()
        if finished == 3:
            break
    finish_training(session, folder, cartpole, preset="tuned")


def call(arguments, capsys):
    """Run a command; returns exit code and stderr."""
    if arguments[0] == "render":
        return call_forked(arguments)
    with pytest.raises(SystemExit) as stop:
        cli.main([str(argument) for argument in arguments])
    return stop.value.code, capsys.readouterr().err


def call_forked(arguments):
    """The same in a process of its own: one that has used OpenGL cannot be forked any more."""
    if not (child := os.fork()):
        code = 99
        try:
            with open("told", "w") as told:
                os.dup2(told.fileno(), 1)
                os.dup2(told.fileno(), 2)
                sys.stdout, sys.stderr = io.StringIO(), told
                cli.main(arguments)
        except SystemExit as stop:
            code = stop.code
        finally:
            os._exit(code)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    with open("told") as told:
        return code, told.read()


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """Runs of every kind."""
    folder = tmp_path_factory.mktemp("good")
    commands = {
        "one": ["--no-video"],
        "gym": ["--backend", "gym", "--no-video"],
    }
    for name, more in {**commands, "many": ["--seeds", "2"]}.items():
        with pytest.raises(SystemExit) as stop:
            cli.main(["train", *EPISODES, *more, "--run-dir", str(folder / name)])
        assert stop.value.code == 0
    interrupted(folder / "cut", TrainConfig(episodes=6))
    shutil.copytree(folder / "many", folder / "manycut")
    shutil.rmtree(folder / "manycut" / "seed-1")
    interrupted(folder / "manycut" / "seed-1", TrainConfig(episodes=6, seed=1))
    return folder


@pytest.fixture
def place(good, tmp_path, monkeypatch):
    """Makes a run of a kind, with somebody's own files beside it."""
    monkeypatch.chdir(tmp_path)

    def make(kind):
        for name in ("run", "mine"):
            shutil.rmtree(name, ignore_errors=True)
        shutil.copytree(good / kind, "run")
        shutil.copytree(good / "cut", "mine")
        (tmp_path / "mine" / "thesis.tex").write_text("years of work")
        return tmp_path / "run", tmp_path / "mine"

    return make


def seen(folder):
    """All that can be seen of a folder."""
    paths = [folder, *sorted(folder.rglob("*"))]
    return [
        (path, path.lstat().st_mtime_ns, path.read_bytes() if path.is_file() else None)
        for path in paths
    ]


def use(kind, rng):
    """Commands on a run, the one that replaces it last."""
    many = kind.startswith("many")
    one = f"run/seed-{rng.choice('01')}" if many else "run"
    overwrite = ["train", "--run-dir", "run", "--overwrite", *EPISODES]
    yield ["evaluate", one, "--episodes", "1"]
    yield ["evaluate", f"{one}/policy.json", "--episodes", "1"]
    if rng.random() < 0.1:
        yield ["render", one, "--sheet", "--size", "64x48", "-o", "sheet.png"]
    yield ["train", "--resume", "run"]
    yield ["train", "--resume", f"{one}/{FORMER}"]
    yield [*overwrite, "--seeds", "2"] if many else [*overwrite, "--no-video"]


def assert_one_line_each(kind, mine, what, capsys, seed=0):
    """Use a damaged run in every way: it works, or one line says why not."""
    before = seen(mine)
    for command in use(kind, random.Random(seed)):
        started = time.monotonic()
        code, err = call(command, capsys)
        told = [line for line in err.splitlines() if "pictures are drawn by" not in line]
        assert code in {0, 2}, (what, command)
        assert time.monotonic() - started < LIMIT, (what, command)
        assert all(len(line) < 1000 for line in told), (what, command)
        lines = {0: {0}, 2: {1, 2} if "failed: " in err else {1}}[code]
        assert len(told) in lines, (what, command, err)
        assert all(line.startswith("mjcartpole: error: ") for line in told), (what, command, err)
        assert seen(mine) == before, (what, command)


def sparse(path):
    with path.open("wb") as file:
        file.truncate(6 * 2**30)


OTHERS = {
    "folder": lambda path, mine: path.mkdir(),
    "link": lambda path, mine: path.symlink_to(mine / path.name),
    "link to a folder": lambda path, mine: path.symlink_to(mine),
    "second name": lambda path, mine: path.hardlink_to(mine / "thesis.tex"),
    "dangling": lambda path, mine: path.symlink_to(mine / "nothing"),
    "loop": lambda path, mine: path.symlink_to(path.name),
    "pipe": lambda path, mine: os.mkfifo(path),
    "zeros": lambda path, mine: path.symlink_to("/dev/zero"),
    "sparse": lambda path, mine: sparse(path),
    "empty": lambda path, mine: path.touch(),
}
PLACES = [
    *(("one", name) for name in (*runs.FILES, ".lock", ".config-0123abcd.json")),
    *(("cut", name) for name in (LATEST, FORMER)),
    *(("many", name) for name in ("seeds.json", "model.xml", "seed-0", "seed-1/config.json")),
    *(("manycut", name) for name in ("seed-0/summary.json", "seed-1", f"seed-1/{LATEST}")),
]


def replace(path, how, mine):
    if path.is_dir():
        shutil.rmtree(path)
    path.unlink(missing_ok=True)
    OTHERS[how](path, mine)


@pytest.mark.parametrize(
    "part", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in range(1, 7))]
)
@pytest.mark.parametrize("number", few(range(len(PLACES)), *range(0, len(PLACES), 12)))
def test_what_is_no_plain_file_is_one_line_and_leads_nowhere(number, part, place, capsys):
    kind, name = PLACES[number]
    for how in list(OTHERS)[(number + part) % 7 :: 7]:
        run, mine = place(kind)
        replace(run / name, how, mine)
        assert_one_line_each(kind, mine, (name, how), capsys, seed=number)


EXTREMES = [
    None, True, 0, -1, 1.5, 1e308, 10**38, 10**400, float("nan"), float("inf"), "", "x", "a\nb",
    "x" * 100_000, "/etc/passwd", [], {}, [[]], {"a": 1}, [0] * 1000, [10**6] * 4, 2**63,
]  # fmt: skip


def places_in(value, at=()):
    inner = value.items() if isinstance(value, dict) else enumerate(value[:4])
    yield at
    for key, each in inner if isinstance(value, dict | list) else ():
        yield from places_in(each, (*at, key)) if isinstance(each, dict | list) else [(*at, key)]


def with_value(text, at, new):
    """JSON with another value at a place."""
    value = whole = {"": json.loads(text)}
    for key in ("", *at)[:-1]:
        value = value[key]
    value[("", *at)[-1]] = new
    return json.dumps(whole[""])


def damage_value(path, rng):
    text = path.read_text()
    at = rng.choice(list(places_in(json.loads(text))))
    deep = "[" * 900 + "]" * 900 if rng.random() < 0.5 else "[" * 100_000
    new = rng.choice([*EXTREMES, "deep"])
    path.write_text(with_value(text, at, new).replace('"deep"', deep))
    return at, str(new)[:20]


def damage_bytes(path, rng):
    content = bytearray(path.read_bytes())
    start = rng.randrange(len(content))
    end = rng.choice([start, start + 1, start + 100, len(content)])
    content[start:end] = rng.randbytes(rng.choice([0, 1, 10]))
    path.write_bytes(content)
    return start, end


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in range(9))])
@pytest.mark.parametrize("damage", few([damage_value, damage_bytes], damage_bytes))
def test_damaged_values_and_bytes_are_one_line(damage, seed, place, capsys):
    rng = random.Random(f"{damage.__name__}{seed}")
    for kind in ("one", "gym", "many", "cut", "manycut"):
        for _ in range(1 if seed == 0 else 10):
            run, mine = place(kind)
            json_only = damage is damage_value
            files = sorted(run.rglob("*.json" if json_only else "*.*"))
            path = rng.choice([path for path in files if path.is_file()])
            what = damage(path, rng)
            assert_one_line_each(kind, mine, (path.name, what), capsys, seed=seed)


def test_a_folder_that_may_not_be_read_is_one_line(place, capsys):
    if os.geteuid() == 0:
        pytest.skip("root may read everything")
    for kind, name in (("one", "."), ("many", "seed-0"), ("cut", LATEST), ("one", "policy.json")):
        run, mine = place(kind)
        (run / name).chmod(0)
        assert_one_line_each(kind, mine, name, capsys)
        (run / name).chmod(0o700)
