"""Models are found, checked and understood, or refused with the reason."""

import math
import pickle
import re
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from mjcartpole.errors import (
    ConfigError,
    ModelError,
    ModelNotFoundError,
    ModelSyntaxError,
    NotACartPoleError,
)
from mjcartpole.physics.cartpole import INTEGRATORS, with_options
from mjcartpole.physics.includes import read_whole
from mjcartpole.physics.load import (
    is_its_document,
    load_model,
    model_names,
    models_folder,
    same_model,
)

REFERENCE = (models_folder() / "cartpole.xml").read_text(encoding="utf-8")


def changed(pattern, replacement):
    """The reference document with one change."""
    text, count = re.subn(pattern, replacement, REFERENCE, count=1, flags=re.DOTALL)
    assert count == 1
    return text


def test_the_reference_is_cartpole_v1_to_the_last_digit():
    model = load_model("cartpole").model
    cart, pole = model.body("cart"), model.body("pole")
    assert (cart.mass[0], pole.mass[0]) == (1.0, 0.1)
    assert pole.ipos.tolist() == [0.0, 0.0, 0.5]
    assert pole.inertia[1] == 0.1 * 1.0**2 / 12
    assert model.opt.gravity.tolist() == [0.0, 0.0, -9.8]
    assert model.opt.timestep == 0.02
    assert model.body_mass.sum() == 1.1
    assert model.actuator_gear[0, 0] == 10.0
    assert load_model("cartpole").controls == (-1.0, 1.0)


def test_nothing_in_the_reference_hinders_the_motion():
    model = load_model("cartpole").model
    assert not model.geom_contype.any()
    assert not model.geom_conaffinity.any()
    assert not model.dof_damping.any()
    assert not model.dof_frictionloss.any()
    assert not model.dof_armature.any()
    assert not model.jnt_limited.any()


def test_every_part_of_the_reference_has_a_name():
    model = load_model("cartpole").model
    for count, accessor in (
        (model.nbody, model.body),
        (model.njnt, model.joint),
        (model.ngeom, model.geom),
        (model.ncam, model.cam),
        (model.nlight, model.light),
        (model.nu, model.actuator),
        (model.nmat, model.mat),
    ):
        assert all(accessor(index).name for index in range(count))
    assert {model.cam(index).name for index in range(model.ncam)} >= {"side", "follow"}


@pytest.mark.parametrize("name", model_names())
def test_shipped_models_are_well_formed_xml(name):
    assert ElementTree.parse(models_folder() / f"{name}.xml").getroot().tag == "mujoco"


def test_the_same_model_by_name_path_text_and_spec(tmp_path):
    path = tmp_path / "mine.xml"
    path.write_text(REFERENCE, encoding="utf-8")
    spec = mujoco.MjSpec.from_string(REFERENCE)
    by_name = load_model("cartpole")
    for source in (path, str(path), REFERENCE, spec):
        assert same_model(load_model(source).model, by_name.model)
    assert by_name.xml == REFERENCE
    assert load_model(path).name == str(path)


def test_names_are_listed_and_a_slip_is_answered_with_the_nearest():
    assert "cartpole" in model_names()
    with pytest.raises(ModelNotFoundError, match=r"'cartpoel'.*did you mean 'cartpole'.*available"):
        load_model("cartpoel")


@pytest.mark.parametrize("source", ["nowhere.xml", "no/such/file", "/tmp"])
def test_a_path_that_leads_nowhere(source):
    with pytest.raises(ModelNotFoundError, match=f"'{source}' is"):
        load_model(source)


def test_an_xml_error_is_named_with_line_and_element(tmp_path):
    path = tmp_path / "broken.xml"
    path.write_text(changed('type="slide"', 'type="slide" colour="red"'), encoding="utf-8")
    with pytest.raises(ModelSyntaxError, match=r"broken\.xml .*colour.*joint.*line \d+") as caught:
        load_model(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["<mujoco><worldbody>", "<html/>", "< not xml"])
def test_documents_that_are_no_mjcf(text):
    with pytest.raises(ModelSyntaxError, match="not a valid MJCF"):
        load_model(text)


@pytest.mark.parametrize(
    ("pattern", "replacement", "reason"),
    [
        ('type="slide"', 'type="hinge"', "no slide joint"),
        ('type="hinge"', 'type="slide"', "2 slide joints"),
        ('type="hinge" axis="0 1 0"', 'type="ball"', "a ball joint, that is neither"),
        (
            '(<joint name="hinge")',
            r'<joint name="hinge2" type="hinge" axis="0 1 0"/>\1',
            "hinges that turn alike",
        ),
        (
            "</worldbody>",
            '<body><freejoint name="free"/><geom size="1" mass="1"/></body></worldbody>',
            "neither the cart's nor the pole's",
        ),
        ("<actuator>.*</actuator>", "", "no actuator"),
        ("(<motor [^>]*/>)", r'\1<motor name="twist" joint="hinge"/>', "2 actuators"),
        ('(<motor [^>]*)joint="slider"', r'\1joint="hinge"', "does not push along the slide"),
        ("<motor ", '<general dyntype="integrator" actlimited="false" ', "activation states"),
        (
            '<motor (.*?) gear="10" ctrlrange="-1 1"',
            r'<damper \1 kv="2" ctrlrange="0 1"',
            "not in proportion",
        ),
        (
            "<motor (.*?) gear=.10.",
            r"<muscle \1 ",
            "it has a muscle",
        ),
        ('gear="10"', 'gear="0"', "a motor that pushes with 0 N whatever the control"),
        ('ctrlrange="-1 1"', 'ctrlrange="-1 1" forcerange="2 3" ', "pushes with 20 N whatever"),
        ('(name="hinge" type="hinge")', r'\1 range="0.1 1"', "leaves out the upright position"),
        ('(type="slide")', r'\1 range="1 2"', "leaves out x = 0"),
        ('axis="1 0 0"', 'axis="0 0 1"', "goes up and down"),
        ('axis="0 1 0"', 'axis="0 0 1"', "turns about the vertical"),
        ('axis="0 1 0"', 'axis="1 0 0"', "along the rail"),
        ('timestep="0.02"', 'timestep="1e-9"', "no more than 1000 are done"),
        ('timestep="0.02"', 'timestep="0.003"', "does not divide"),
        ('timestep="0.02"', 'timestep="0.03"', "does not divide"),
    ],
)
def test_what_is_no_cart_pole_is_refused_with_what_was_found(pattern, replacement, reason):
    with pytest.raises(NotACartPoleError, match=reason) as caught:
        load_model(changed(pattern, replacement))
    assert "\n" not in str(caught.value)


def test_a_hinge_outside_the_cart_is_refused():
    text = """<mujoco><worldbody>
      <body name="cart"><joint name="s" type="slide" axis="1 0 0"/><geom size="1"/></body>
      <body name="pole"><joint name="h" type="hinge" axis="0 1 0"/><geom size="1"/></body>
    </worldbody><actuator><motor joint="s"/></actuator></mujoco>"""
    with pytest.raises(NotACartPoleError, match="not inside the cart's body"):
        load_model(text)


def test_actions_are_the_ends_of_the_control_range():
    assert load_model(changed('ctrlrange="-1 1"', 'ctrlrange="-3 2"')).controls == (-3.0, 2.0)
    assert load_model(changed('ctrlrange="-1 1"', "")).controls == (-1.0, 1.0)


def test_action_1_pushes_to_the_right_whatever_the_gears_sign():
    assert load_model(changed('gear="10"', 'gear="-10"')).controls == (1.0, -1.0)


def test_a_pole_that_hangs_at_angle_0_is_counted_from_upright():
    """The pose is the file's, its coordinate is not; the rest of the model follows."""
    text = changed('pos="0 0 0.5" mass', 'pos="0 0 -0.5" mass')
    attributes = 'name="hinge" range="-1 4" springref="3" ref="0.5"'
    hanging = load_model(text.replace('name="hinge"', attributes))
    by_ref = mujoco.MjModel.from_xml_string(
        text.replace(
            'name="hinge"',
            'name="hinge" range="-4.6415926535897931 0.3584073464102069"'
            ' springref="-0.6415926535897931" ref="-3.1415926535897931"',
        )
    )
    assert hanging.upright == (pytest.approx(math.pi + 0.5),)
    for field in ("qpos0", "qpos_spring", "jnt_range"):
        found, wanted = getattr(hanging.model, field), getattr(by_ref, field)
        np.testing.assert_allclose(found, wanted, atol=1e-12, err_msg=field)
    assert load_model(hanging.xml).upright == hanging.upright
    assert load_model().upright == (0.0,)


def test_a_hanging_pole_that_cannot_stand_is_refused():
    text = changed('pos="0 0 0.5" mass', 'pos="0 0 -0.5" mass')
    with pytest.raises(NotACartPoleError, match="leaves out the upright position"):
        load_model(text.replace('name="hinge"', 'name="hinge" range="-1 1"'))
    tendon = '<tendon><fixed name="t"><joint joint="hinge" coef="1"/></fixed></tendon>'
    with pytest.raises(
        NotACartPoleError, match="upright at 180 degrees instead of 0, with tendons"
    ):
        load_model(text.replace("</worldbody>", f"</worldbody>{tendon}"))


def test_a_short_timestep_makes_several_physics_steps():
    assert load_model(changed('timestep="0.02"', 'timestep="0.005"')).substeps == 4


def test_includes_are_put_in_their_place(tmp_path):
    (tmp_path / "push.xml").write_text(
        '<mujocoinclude><motor name="push" joint="slider" gear="10"/></mujocoinclude>'
    )
    path = tmp_path / "with_include.xml"
    path.write_text(changed("<motor [^>]*/>", '<include file="push.xml"/>'), encoding="utf-8")
    cartpole = load_model(path)
    assert "<include" not in cartpole.xml
    assert same_model(load_model(cartpole.xml).model, cartpole.model)
    assert read_whole(REFERENCE, "it", tmp_path).text == REFERENCE


def test_includes_inside_includes_are_sought_beside_the_main_file(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "push.xml").write_text('<x><include file="parts/motor.xml"/></x>')
    (tmp_path / "parts" / "motor.xml").write_text('<x><motor name="push" joint="slider"/></x>')
    path = tmp_path / "main.xml"
    text = changed("<motor [^>]*/>", '<include file="parts/push.xml"/>')
    path.write_text(text, encoding="utf-8")
    assert same_model(load_model(load_model(path).xml).model, load_model(path).model)


def test_comments_as_people_write_them_are_taken():
    text = changed("<worldbody>", "<!---- a -- b ----><worldbody>")
    assert same_model(load_model(text).model, load_model().model)
    assert load_model(text).xml == text
    heavy = load_model(text, {"cart.mass": 2})
    assert "<!---- a -- b ---->" in heavy.xml
    assert heavy.model.body("cart").mass[0] == 2


@pytest.mark.parametrize("field", ["numslices", "numstacks", "numquads"])
def test_pictures_of_too_many_facets_are_refused(field):
    rough = f'<visual><quality {field}="{{}}"/></visual><asset>'
    assert load_model(REFERENCE.replace("<asset>", rough.format(512), 1))
    with pytest.raises(ModelError, match=f"513 {field}; no more than 512"):
        load_model(REFERENCE.replace("<asset>", rough.format(513), 1))


def test_integrators_are_numbered_as_in_mujoco():
    assert len(INTEGRATORS) == len(mujoco.mjtIntegrator.__members__)
    for number, name in INTEGRATORS.items():
        assert mujoco.mjtIntegrator(number).name == f"mjINT_{name.upper()}"
        cartpole = load_model(changed('integrator="Euler"', f'integrator="{name}"'))
        assert cartpole.integrator == name
        assert with_options(load_model(), integrator=name).integrator == name


def test_the_files_own_timestep_on_request():
    text = changed('timestep="0.02"', 'timestep="0.013"')
    cartpole = load_model(text, own_timestep=True)
    assert (cartpole.substeps, cartpole.timestep) == (1, 0.013)
    assert load_model(cartpole) is cartpole


@pytest.mark.parametrize("timestep", [0.02, 0.005])
def test_a_loaded_model_may_be_given_its_own_timestep(timestep):
    cartpole = load_model(changed('timestep="0.02"', f'timestep="{timestep}"'))
    assert cartpole.substeps == round(0.02 / timestep)
    own = load_model(cartpole, own_timestep=True)
    assert (own.substeps, own.control_step) == (1, timestep)
    assert own.has_own_timestep == (timestep != 0.02)
    assert not cartpole.has_own_timestep


def test_edits_are_refused_where_the_document_is_not_the_model():
    cartpole = load_model("cartpole")
    cartpole.model.opt.gravity[2] = -1.0
    with pytest.raises(ConfigError, match="compiles to another model"):
        load_model(cartpole, {"pole.length": 2})
    spec = mujoco.MjSpec.from_string(REFERENCE)
    by_spec = load_model(spec, {"pole.length": 2}).model
    assert same_model(by_spec, load_model("cartpole", {"pole.length": 2}).model)


def test_options_are_changed_in_a_copy():
    cartpole = load_model()
    finer = with_options(cartpole, timestep=0.001)
    assert (finer.timestep, cartpole.timestep) == (0.001, 0.02)
    assert finer.xml == cartpole.xml


def test_a_file_may_have_any_ending_but_a_shipped_name_comes_first(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("mine.mjcf", "cartpole"):
        (tmp_path / name).write_text(changed("-9.8", "-1.62"), encoding="utf-8")
    assert load_model("mine.mjcf").model.opt.gravity[2] == -1.62
    assert load_model("cartpole").model.opt.gravity[2] == -9.8


def test_what_a_notebook_shows_is_short():
    assert repr(load_model("twopoles")) == "CartPole('twopoles', 2 poles, timestep 0.02 s)"
    edited = load_model("cartpole", {"pole.length": 1.5})
    assert repr(edited) == "CartPole('cartpole with pole.length=1.5', 1 pole, timestep 0.02 s)"


def test_a_copy_by_pickle_is_the_same_model():
    cartpole = load_model("cartpole")
    copy = pickle.loads(pickle.dumps(cartpole))
    assert copy.model is not cartpole.model
    assert same_model(copy.model, cartpole.model)
    assert is_its_document(copy)
