"""`mjcartpole page`: what it writes, and what it refuses before it plays."""

import json
import re
import shutil
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

import pytest

from command_line import QUICK, call, done
from mjcartpole.disturbances.disturbances import NONE
from mjcartpole.page.run_data import packed
from mjcartpole.page.told import facts_of
from mjcartpole.studies.film import play
from mjcartpole.studies.policy_setup import find_setup
from pages import needs_assets


@pytest.fixture(autouse=True)
def _built():
    needs_assets()


def page(capsys, *arguments):
    return call(["page", *arguments, "--no-plots"], capsys)


def data_of(path):
    text = path.read_text(encoding="utf-8")
    return json.loads(re.search(r'id="data">(.*?)</script>', text)[1])["runs"]


def with_film(run, name):
    summary = json.loads((run / "summary.json").read_text())
    (run / "summary.json").write_text(json.dumps(summary | {"video": name}))


def test_a_run_becomes_a_page_of_its_name(run, here, capsys):
    code, out, err = page(capsys, run)
    assert (code, err) == (0, "")
    assert re.fullmatch(r"page  mine\.html  \(\d\.\d\d MB; it opens offline, .*\)\n", out)
    (data,) = data_of(here / "mine.html")
    facts, config = dict(data["facts"]), dict(data["config"])
    assert data["name"] == "mine" and data["film"] is None
    assert facts["Episodes"] == "3" and re.fullmatch(r"\d+ of 100", facts["Greedy: pole fell"])
    assert config["preset"] == "tuned" and config["seed"] == "8"
    assert dict(data["versions"])["mujoco"] == version("mujoco")


def test_a_model_may_be_edited_and_a_policys_file_has_a_page_too(run, here, capsys):
    code, _, _ = page(capsys, run / "policy.json", "--set", "pole.length=1.5", "-o", "long.html")
    (data,) = data_of(here / "long.html")
    assert code == 0 and data["facts"] == []
    assert 'fromto="0 0 0 0 0 1.5"' in data["document"]


def test_what_was_added_in_training_is_told_and_left_out(here, capsys):
    given = ["--delay", "2", "--noise", "0.1", "--vary", "pole.length=0.5:1.5"]
    done(["train", *QUICK, *given, "--run-dir", "runs/rough"])
    done(["train", *QUICK, "--observe-actions", "1", "--run-dir", "runs/sees"])
    capsys.readouterr()
    assert page(capsys, "runs/rough")[0] == 0
    (data,) = data_of(here / "rough.html")
    assert data["disturbances"] == "--vary pole.length=0.5:1.5 --delay 2 --noise 0.1"
    (undisturbed,) = play(replace(find_setup(Path("runs/rough")), disturbances=NONE))
    assert data["episode"]["states"] == packed(undisturbed.states)
    code, _, err = page(capsys, "runs/sees")
    assert code == 2 and "sees looks at actions before, which a page does not show" in err


def test_gymnasiums_policy_is_played_on_the_reference_model(run, here, capsys):
    code, _, _ = page(capsys, run, "--backend", "gym")
    (data,) = data_of(here / "mine.html")
    assert code == 0 and (data["backend"], data["integrator"]) == ("gym", "gym")
    assert '<mujoco model="cartpole">' in data["document"]


def test_the_film_of_a_run_is_in_it_and_no_other_file(run, here, capsys):
    (here / "videos").mkdir()
    (here / "videos" / "mine.mp4").write_bytes(b"film")
    with_film(run, "videos/mine.mp4")
    page(capsys, run)
    assert data_of(here / "mine.html")[0]["film"] == "data:video/mp4;base64,ZmlsbQ=="
    shutil.copy(here / "videos" / "mine.mp4", here / "mine.mp4")
    with_film(run, str(here / "mine.mp4"))
    page(capsys, run, "--overwrite")
    assert data_of(here / "mine.html")[0]["film"] is None


def test_films_are_left_out_where_there_is_no_room(run, here, capsys):
    (here / "videos").mkdir()
    (here / "videos" / "mine.mp4").write_bytes(b"x" * 2_000_000)
    with_film(run, "videos/mine.mp4")
    _, out, _ = page(capsys, run)
    assert "films are left out" in out and data_of(here / "mine.html")[0]["film"] is None


def test_what_is_there_is_not_replaced_unless_asked(run, here, capsys):
    (here / "mine.html").write_text("mine")
    code, _, err = page(capsys, run)
    assert code == 2 and "--overwrite" in err
    assert (here / "mine.html").read_text() == "mine"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "needs a RUN-OR-POLICY"),
        (["runs/mine", "-o", "page.pdf"], "a page is an .html"),
        (["runs/mine", "--delay", "2"], "a page plays without disturbances; leave out --delay"),
        (["runs/other"], "no run folder or policy file"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(run, capsys, arguments, words):
    code, _, err = page(capsys, *arguments)
    assert code == 2 and words in err and err.count("\n") == 1


def test_an_interrupted_run_has_fewer_facts():
    assert facts_of({"episodes": 1200, "steps": 7}) == {"Episodes": 1200, "Steps of training": 7}
