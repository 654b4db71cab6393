"""The shipped models: each loads, is what it says, and moves as the equations say they do."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.evaluation import evaluate_where_trained
from mjcartpole.physics.edit.edits import describe_edits, edit_document
from mjcartpole.physics.load import load_model, model_names, models_folder, same_model
from mjcartpole.physics.simulation import Simulation
from mjcartpole.physics.unmodelled_effects import differs_from
from mjcartpole.studies.parity import Subject, run_ladder
from nightly import few

REFERENCE = load_model("cartpole").xml
EDITS = {
    "long": {"pole.length": 2},
    "short": {"pole.length": 0.4},
    "heavy": {"pole.mass": 1, "geom:pole.size": "0.05"},
    "damped": {"hinge.damping": 0.05},
    "friction": {"rail.friction": 2},
    "moon": {"gravity": 1.62},
    "wind": {"option.gravity": "0.5 0 -9.8"},
}
"""What stands in the files, as edits of the reference; "on the command line" in their comments."""

SAID = {
    "long": ["com distance 1 instead of 0.5", "inertia 0.0333333 instead of 0.00833333"],
    "short": ["com distance 0.2 instead of 0.5", "inertia 0.00133333 instead of 0.00833333"],
    "heavy": ["pole mass 1 instead of 0.1", "inertia 0.0833333 instead of 0.00833333"],
    "damped": ["hinge damping 0.05 instead of 0"],
    "friction": ["friction loss 2 instead of 0 in joint 'slider'"],
    "moon": ["gravity 1.62 instead of 9.8"],
    "wind": ["gravity 0.5 0 -9.8 instead of 9.8 straight down"],
    "stops": ["limit of joint 'slider' at -1.5 and 1.5"],
    "twopoles": ["2 poles, and the equations are those of one"],
    "wieland": ["2 poles, and the equations are those of one"],
    "bob": [
        "pole mass 0.2 instead of 0.1",
        "com distance 0.75 instead of 0.5",
        "inertia 0.0209773 instead of 0.00833333",
    ],
}
SEVERAL_POLES = {"twopoles", "wieland"}

INERTIA = {"body:pole/inertial.pos", "body:pole/inertial.diaginertia"}
DIFFERS = {
    "long": {*INERTIA, "geom:pole.fromto"},
    "short": {*INERTIA, "geom:pole.fromto"},
    "heavy": {"body:pole/inertial.mass", "body:pole/inertial.diaginertia", "geom:pole.size"},
    "damped": {"joint:hinge.damping"},
    "friction": {"joint:slider.frictionloss"},
    "moon": {"option.gravity"},
    "wind": {"option.gravity"},
    "stops": {
        "joint:slider.range",
        "joint:slider.solreflimit",
        "geom:stop_left.pos",
        "geom:stop_right.pos",
    },
    "twopoles": {
        "body:pole",
        "body:long",
        "body:short",
        "material:violet",
        "camera:side.pos",
    },
    "wieland": {
        "option.timestep",
        "body:pole",
        "body:long",
        "body:short",
        "material:violet",
    },
    "bob": {"body:bob"},
}
"""All that a file may have otherwise than the reference: an attribute, or an element (there or not)
with all in it. Files are complete in themselves; what they share is copied, and held equal here."""

gallery = pytest.mark.parametrize("name", sorted(SAID))
single = pytest.mark.parametrize("name", sorted(set(SAID) - SEVERAL_POLES))


def test_the_gallery_is_complete():
    assert set(SAID) <= set(model_names())


@gallery
def test_each_says_what_it_changes(name):
    cartpole = load_model(name)
    assert cartpole.model.names.startswith(name.encode() + b"\0")
    assert differs_from(cartpole) == SAID[name]
    header = cartpole.xml.partition("-->")[0]
    for word in (f"{name}.xml:", "Changed from cartpole.xml", "What it teaches", "Training:"):
        assert word in header
    assert "CHANGED" in cartpole.xml.partition("-->")[2]


@pytest.mark.parametrize("name", sorted(EDITS))
def test_each_is_what_its_edit_makes(name):
    text = edit_document(REFERENCE, {**EDITS[name], "mujoco.model": name})
    assert describe_edits(load_model(name).xml, text) == []
    assert same_model(load_model(text).model, load_model(name).model)


def elements_of(text):
    """Return {name: (parent's name, attributes)}, in the document's order.

    An element without a name or a class is called by its parent's and its tag.
    """
    found = {"": ("", {})}

    def visit(element, parent):
        label = element.get("name") or element.get("class")
        name = f"{element.tag}:{label}" if label else f"{parent}/{element.tag}".lstrip("/")
        assert name not in found, f"two elements {name}"
        found[name] = (parent, element.attrib)
        for child in element:
            visit(child, name)

    for section in ElementTree.fromstring(text):
        visit(section, "")
    return found


def differences(text, other):
    """Name what two documents do not share: elements, or attributes of those in both."""
    ours, theirs = elements_of(text), elements_of(other)
    shared = set(ours) & set(theirs)
    for name in {**ours, **theirs}:
        parent, attributes = ours.get(name) or theirs[name]
        if name in shared:
            assert theirs[name][0] == parent, f"{name} has moved"
            there = theirs[name][1]
            keys = {**attributes, **there}
            yield from (f"{name}.{key}" for key in keys if attributes.get(key) != there.get(key))
        elif parent in shared:
            yield name


@gallery
def test_all_else_is_as_in_the_reference(name):
    assert set(differences(load_model(name).xml, REFERENCE)) == DIFFERS[name]
    ours, theirs = (list(elements_of(text)) for text in (load_model(name).xml, REFERENCE))
    assert [one for one in ours if one in theirs] == [one for one in theirs if one in ours]


def test_a_change_of_the_look_is_not_forgotten():
    changed = REFERENCE.replace('fovy="26"', 'fovy="30"', 1).replace('size="0.035"', 'size="0.04"')
    changed = changed.replace('<material name="blue" rgba="0.16 0.42 0.74 1" specular="0.2"/>', "")
    assert set(differences(changed, REFERENCE)) == {
        "camera:side.fovy",
        "default:leg/geom.size",
        "material:blue",
    }


@gallery
def test_each_steps(name):
    for integrator in ("gym", "mujoco"):
        simulation = Simulation(load_model(name), integrator)
        simulation.state = (0.0, 0.1, *(0.02, 0.0) * simulation.cartpole.poles)
        for _ in range(20):
            state = simulation.step(1.0)
        assert np.isfinite(state).all()
        assert state[0] > 0.1


@pytest.mark.parametrize("name", few(sorted(set(SAID) - SEVERAL_POLES), "bob"))
def test_each_moves_as_its_own_equations_do(name):
    results = list(run_ladder(Subject(load_model(name), "itself", quick=True), (1, 2, 3, 4, 5)))
    assert {result.verdict for result in results} <= {"holds", "skipped"}
    assert results[0].verdict == results[4].verdict == "holds"


@pytest.mark.parametrize(
    ("model", "poles"),
    [
        ("twopoles", (("long", 0.3, 3.0), ("short", 0.05, 0.5))),
        ("wieland", (("long", 0.1, 1.0), ("short", 0.01, 0.1))),
    ],
)
def test_each_of_two_poles_is_a_uniform_rod(model, poles):
    model = load_model(model).model
    for name, mass, length in poles:
        body = model.body(name)
        across = mass * length**2 / 12
        assert (body.mass[0], body.ipos[2]) == pytest.approx((mass, length / 2), rel=1e-12)
        assert sorted(body.inertia)[1:] == pytest.approx([across, across], rel=1e-12)


def test_friction_holds_a_cart_that_is_not_pushed_hard():
    simulation = Simulation(load_model("friction"))
    for _ in range(20):
        state = simulation.step(0.15)  # 1.5 N of the 2 N
    assert 0 < state[0] < 2e-3  # it creeps with 3 mm/s


def test_the_wind_pushes_a_cart_that_is_let_go():
    simulation = Simulation(load_model("wind"))
    assert simulation.step(0.0)[1] == pytest.approx(0.02 * 0.5, rel=1e-9)
    leaning = (0.0, 0.0, np.arctan2(0.5, -9.8) - np.pi, 0.0)
    accelerations = simulation.accelerations(np.array([leaning]), np.array([-0.055]))
    np.testing.assert_allclose(accelerations, 0, atol=1e-9)


def test_the_stops_stop_the_cart():
    simulation = Simulation(load_model("stops"))
    places = [simulation.step(1.0)[0] for _ in range(200)]
    simulation.state = (1.45, 1.0, 0.0, 0.0)
    assert min(simulation.step(0.0)[1] for _ in range(20)) == pytest.approx(-0.4, abs=0.05)
    assert 1.5 < max(places) < 1.65  # it arrives with 5 m/s


@gallery
def test_every_file_names_settings_that_exist(name):
    (line,) = re.findall(r"Training: .*?\n\n", load_model(name).xml, flags=re.DOTALL)
    assert re.search(r"\d+\.\d", line)
    config = config_of(line, model=str(models_folder() / f"{name}.xml"))
    assert config.discretizer(load_model(name).poles).n_states > 1


def config_of(text, **changes):
    """The settings in a file's comment: "the preset tuned, episodes 3000, gamma 0.99"."""
    found = {}
    for word, values in re.findall(r"(episodes|gamma|bins) ([\d. ]*\d)", text):
        numbers = [float(value) if "." in value else int(value) for value in values.split()]
        found[word] = tuple(numbers) if word == "bins" else numbers[0]
    (preset, *_) = re.findall(r"preset ([\w-]+)", text)
    return TrainConfig.preset(preset, **{**found, **changes})


@pytest.mark.slow
@gallery
def test_recommended_settings_solve_it(name):
    from mjcartpole.learning.training import train

    (line,) = re.findall(r"Training: .*?\n\n", load_model(name).xml, flags=re.DOTALL)
    configs = [config_of(line, model=name, seed=seed) for seed in range(5)]
    policies = [train(config).policy for config in configs]
    models = [config.load_model() for config in configs]
    played = map(evaluate_where_trained, policies, configs, models, ["compiled"] * 5)
    least = configs[0].solved_at if name in SEVERAL_POLES else 495
    assert np.mean([each.mean for each in played]) >= least
