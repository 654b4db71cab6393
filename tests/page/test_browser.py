"""The page in a real browser: opened from disk, without a network, and read back."""

from dataclasses import replace

import numpy as np
import pytest

from command_line import QUICK, done
from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.page.document import page_html
from mjcartpole.page.run_data import run_data
from mjcartpole.page.told import Told
from mjcartpole.physics.load import load_model
from mjcartpole.studies.policy_setup import find_setup
from pages import drive, needs_assets

pytestmark = pytest.mark.slow

PLAY = "mjcartpole.stage?.play"
HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>\"'`${alert(3)}"


def evaluate(script):
    return {"evaluate": f"(() => {{ const play = window.{PLAY}; return {script} }})()"}


def do(script):
    return {"do": f"(() => {{ const play = window.{PLAY}; {script} }})()"}


def still(state):
    """Hold still in a state."""
    begin = f"play.restart({list(state)}); mjcartpole.stage.draw()"
    return do(f"mjcartpole.stage.paused = true; {begin}")


def badge_text():
    return evaluate("document.querySelector('.parity').innerText")


ALERT = evaluate("document.querySelector('.alert').innerText")
STATE, STEP = evaluate("play.state"), do("play.step()")
FORCES = evaluate("Array.from(play.simulation.data.xfrc_applied)")


def place_of(joint):
    index = f"play.cartpole.model.jnt_bodyid[{joint}]"
    return evaluate(f"mjcartpole.stage.windowPlaceOf({index})")


@pytest.fixture(scope="module")
def page(tmp_path_factory, trained):
    needs_assets()
    path = tmp_path_factory.mktemp("page") / "mine.html"
    done(["page", trained, "-o", path, "--no-plots"])
    return path


def found(page, *acts, **wish):
    """What a page answers; it says nothing on the console."""
    answer = drive(page, *acts, **wish)
    assert answer["said"] == []
    return answer["found"]


def test_it_begins_in_silence_and_replays_the_episode(page):
    answer = drive(page, evaluate("window.mjcartpole.parity"), badge_text())
    parity, text = answer["found"]
    assert answer["said"] == [] and answer["ready"] < 30
    assert parity["steps"] > 20 and parity["early"] <= 1e-12
    assert text.startswith(f"{parity['equal']} of {parity['steps']} steps bit-equal to MuJoCo 3.")


def test_a_step_by_key_is_mujocos(page):
    before, after = found(page, still([0, 0, 0.02, 0]), STATE, {"press": "s"}, STATE)
    assert before == [0, 0, 0.02, 0]
    assert after != before and after[2] == 0.02  # Explicit Euler: places move by old velocities.


def test_the_pole_is_dragged_as_by_a_spring(page):
    (x, y), (bx, _) = found(page, still([0, 0, 0, 0]), place_of(1), place_of(0))
    assert abs(x - bx) < 2
    free, forces, pulled, after = found(
        page, still([0, 0, 0, 0]), STEP, STATE, still([0, 0, 0, 0]),
        {"drag": [[x, y], [x + 120, y]]}, STEP, FORCES, STATE,
        {"release": True}, STEP, FORCES,
    )  # fmt: skip
    assert np.count_nonzero(forces) and forces[12] > 1  # On the pole's body, to the right.
    assert pulled[3] > free[3] + 0.1
    assert not any(after)


def test_arrow_keys_push_the_cart(page):
    still_there = still([0, 0, 0, 0])
    free, forces, pushed = found(
        page, still_there, STEP, STATE,
        still_there, do("play.keys = 1"), STEP, FORCES, STATE,
    )  # fmt: skip
    assert forces[6] == pytest.approx(10)
    assert pushed[1] > free[1]
    ((right, none),) = found(
        page, still_there,
        do("window.seen = []; setInterval(() => window.seen.push(play.keys), 5)"),
        {"hold": "ArrowRight", "ms": 300}, {"wait": 100},
        evaluate("[Math.max(...window.seen), window.seen.at(-1)]"),
    )  # fmt: skip
    assert (right, none) == (1, 0)


def test_one_may_play_against_the_table(page):
    waiting, playing, scores = found(
        page, {"press": "y"}, {"wait": 300}, evaluate("[play.player, play.isWaiting, play.steps]"),
        {"hold": "ArrowLeft", "ms": 500}, {"wait": 1500},
        evaluate("[play.steps, play.rivalSteps, play.ending]"),
        evaluate("document.querySelector('.score').innerText"),
    )  # fmt: skip
    assert waiting == ["you", True, 0]
    assert playing[0] > 5 and playing[1] > 5 and playing[2] == "pole"
    assert "You" in scores and "The table" in scores


def test_a_click_on_the_slice_starts_there(page):
    box = "document.querySelector('.slice').getBoundingClientRect()"
    ((x, y, width, height),) = found(page, evaluate(f"(b => [b.x, b.y, b.width, b.height])({box})"))
    (state,) = found(
        page,
        still([0.5, 0.1, 0, 0]),
        {"wait": 500},
        {"at": [x + 0.8 * width, y + 0.2 * height]},
        STATE,
    )
    assert state[:2] == [0.5, 0.1]
    assert state[2] > 0.05 and state[3] > 0.3


def test_sliders_edit_as_set_does(page):
    numbers = "(m => [...m.body_mass, ...m.body_ipos, ...m.body_inertia])(play.cartpole.model)"
    height = f"window.{PLAY}.cartpole.model.body_ipos[8]"
    edited, moved, badge = found(
        page, still([0, 0, 0, 0]), do("mjcartpole.model.set('pole.length', 1.5)"),
        {"until": f"{height} === 0.75"}, evaluate(numbers),
        do("window.slider = document.querySelector('[data-edit=\"pole.length\"]')"),
        do("slider.value = 300; slider.dispatchEvent(new Event('input'))"),
        {"until": f"{height} !== 0.75"}, evaluate(height), badge_text(),
    )  # fmt: skip
    model = load_model("cartpole", {"pole.length": 1.5}).model
    wanted = np.concatenate([model.body_mass, model.body_ipos.ravel(), model.body_inertia.ravel()])
    np.testing.assert_allclose(edited, wanted, rtol=1e-12, atol=0)
    assert moved == pytest.approx(1.0)  # A slider in its third quarter: twice the length.
    assert badge.startswith("another pole")


def compiled(old, new):
    """Write another document in the editor's place."""
    return do(f"mjcartpole.model.compile(play.cartpole.xml.replace({old!r}, {new!r}))")


def test_the_editor_compiles_or_says_mujocos_words(page):
    mass = evaluate("play.cartpole.model.body_mass[1]")
    error = "document.querySelector('.error')"
    words, before, quiet, heavy, own, badge = found(
        page, compiled('type="slide"', 'type="slyde"'), evaluate(f"{error}.innerText"), mass,
        compiled('mass="1.0"', 'mass="3"'), evaluate(f"{error}.hidden"), mass,
        do("mjcartpole.model.reset()"), mass, badge_text(),
    )  # fmt: skip
    assert "slyde" in words and before == 1.0
    assert quiet and heavy == 3.0
    assert own == 1.0 and "bit-equal" in badge


def test_without_webgl_the_table_and_the_figures_are_there(page):
    blind = """
    const get = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
      return kind.startsWith("webgl") ? null : get.call(this, kind, ...rest);
    };"""
    count = "document.querySelectorAll('{}').length"
    text, slices, facts = found(
        page,
        ALERT,
        evaluate(count.format(".slice")),
        evaluate(count.format(".facts")),
        before=blind,
    )
    assert "WebGL" in text and (slices, facts) == (1, 1)


def test_without_webassembly_it_says_so(page):
    (text,) = found(
        page, evaluate("document.querySelector('.alert').innerText"), without=["WebAssembly"]
    )
    assert "WebAssembly" in text


def test_reduced_motion_begins_paused(page):
    assert found(page, evaluate("mjcartpole.stage.paused"), still=True) == [True]


def test_it_says_that_disturbances_are_left_out(tmp_path, trained):
    needs_assets()
    setup = replace(find_setup(trained), disturbances=Disturbances(delay=2, push="1@~4s"))
    path = tmp_path / "rough.html"
    path.write_text(page_html([run_data(setup, Told(), "mujoco")]), encoding="utf-8")
    choose = "(n, value) => { const s = document.querySelectorAll('.choice select')[n];"
    choose += " s.value = value; s.dispatchEvent(new Event('change')); }"
    lead, parity, early, late = found(
        path, evaluate("document.querySelector('.lead').innerText"), evaluate("mjcartpole.parity"),
        still([0, 0, 0.02, 0]), STEP, evaluate("play.simulation.data.ctrl[0]"),
        do(f"({choose})(1, '6')"), still([0, 0, 0.02, 0]), STEP,
        evaluate("play.simulation.data.ctrl[0]"),
    )  # fmt: skip
    assert "trained with --delay 2 --push '1@~4s', and is played here without, but for" in lead
    assert parity["early"] <= 1e-12
    assert (abs(early), late) == (1, 0)


def test_nothing_hostile_runs(tmp_path, trained):
    needs_assets()
    setup = find_setup(trained)
    told = Told({HOSTILE: HOSTILE}, {HOSTILE: [HOSTILE]}, {HOSTILE: HOSTILE})
    data = run_data(setup, told, "mujoco") | {"name": HOSTILE}
    data["document"] = data["document"].replace("<worldbody>", f"<!-- {HOSTILE} --><worldbody>")
    data["task"]["name"] = HOSTILE
    path = tmp_path / "hostile.html"
    path.write_text(page_html([data, data]), encoding="utf-8")
    scripts, images, title, shown = found(
        path, {"wait": 500},
        evaluate("document.scripts.length"), evaluate("document.images.length"),
        evaluate("document.title"), evaluate("document.querySelector('.facts dt').textContent"),
    )  # fmt: skip
    assert (scripts, images) == (3, 0)
    assert title == f"{HOSTILE}, {HOSTILE} · mjcartpole" and shown == HOSTILE


def test_the_policy_forbids_what_is_put_in_later(page):
    image = "<img src=x onerror='window.bad = 1'>"
    script = "Object.assign(document.createElement('script'), {text: 'window.bad = 2'})"
    said = drive(
        page, do(f'document.body.insertAdjacentHTML("beforeend", "{image}")'),
        do(f"document.body.append({script})"), {"wait": 300}, evaluate("window.bad ?? null"),
    )  # fmt: skip
    assert said["found"][-1] is None
    assert any("Content Security Policy" in line for line in said["said"])


def test_several_runs_have_a_switch_and_a_table(tmp_path, trained, here):
    needs_assets()
    done(["train", *QUICK, "--model", "twopoles", "--seed", "2", "--run-dir", "two"])
    done(["page", trained, "two", "-o", tmp_path / "both.html", "--no-plots"])
    rows, poles, steps = found(
        tmp_path / "both.html", evaluate("document.querySelectorAll('.runs tbody tr').length"),
        {"click": ".runs tbody tr:nth-child(2) button"}, {"wait": 1500},
        evaluate("window.mjcartpole.stage.play.cartpole.hinges.length"),
        evaluate("[mjcartpole.parity.early <= 1e-12, document.querySelector('select').value]"),
    )  # fmt: skip
    assert (rows, poles, steps) == (2, 2, [True, "1"])
