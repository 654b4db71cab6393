"""Documents that are no cart-pole, no MJCF, or too much: one line each."""

import re

import pytest

from foreign import CART, MOTOR, POLE, document
from mjcartpole.errors import ModelError, ModelNotFoundError, ModelSyntaxError, NotACartPoleError
from mjcartpole.physics.load import load_model, models_folder

REFERENCE = (models_folder() / "cartpole.xml").read_text(encoding="utf-8")


WHEEL = '<body><joint name="w" axis="0 1 0"/><geom size="0.1"/></body>'


TWIN = '<joint name="h2" axis="0 1 0"/>'


ACROSS = '<body><joint name="a" axis="1 0 0"/><geom pos="0 0 1" size="0.1"/></body>'


def with_pole(pole: str) -> str:
    return CART.format(pole)


SITE = '<site name="tip"/>'


TENDON = '<tendon><fixed name="t"><joint joint="s" coef="1"/></fixed></tendon>'


NO_CART_POLES = {
    "no joint": (document("<geom size='1'/>", ""), "no slide joint"),
    "no slider": (document(POLE.format(""), '<motor joint="h"/>'), "no slide joint"),
    "no hinge": (document(with_pole("")), "no hinge joint"),
    "two sliders": (
        document(CART.format(CART.format(POLE.format("")).replace('"s"', '"s2"'))),
        "2 slide joints where one .the cart's. is needed",
    ),
    "a wheel": (
        document(with_pole(POLE.format("") + WHEEL)),
        "a hinge .'w'. that turns about its own centre of mass, as a wheel and no pole",
    ),
    "two hinges that turn alike": (
        document(with_pole(POLE.format("").replace("<geom", TWIN + "<geom", 1))),
        "hinges that turn alike",
    ),
    "a second pole that a push does not tilt": (
        document(with_pole(POLE.format("") + ACROSS)),
        "a hinge .'a'. whose axis is along the rail",
    ),
    "a second pole beside": (
        document(with_pole(POLE.format("")) + POLE.format("").replace('"h"', '"h2"')),
        "a hinge .'h2'. whose body is not inside the cart's body",
    ),
    "pole beside": (document(with_pole("") + POLE.format("")), "not inside the cart's body"),
    "cart on pole": (
        document(POLE.format(CART.format(""))),
        "a hinge whose body is not inside the cart's body",
    ),
    "ball joint": (
        document(with_pole('<body><joint type="ball"/><geom size="1"/></body>')),
        "a ball joint, that is neither the cart's nor the pole's",
    ),
    "free joint": (
        document(with_pole(POLE.format("")) + "<body><freejoint/><geom size='1'/></body>"),
        "a free joint, that is neither",
    ),
    "no actuator": (document(motor=""), "no actuator where one plain motor"),
    "two actuators": (document(motor=MOTOR + '<motor joint="s"/>'), "2 actuators where one"),
    "motor on the hinge": (document(motor='<motor joint="h"/>'), r"acts on another joint"),
    "motor on a tendon": (
        document(motor='<motor tendon="t"/>', more=TENDON),
        r"does not push along the slide joint \(it acts on a tendon\)",
    ),
    "motor on a site": (
        document(with_pole(POLE.format(SITE)), '<motor site="tip" gear="1 0 0 0 0 0"/>'),
        r"\(it acts on a site\)",
    ),
    "integrated velocity": (
        document(motor='<intvelocity joint="s" actrange="-1 1"/>'),
        r"activation states \(integrator\)",
    ),
    "filter": (
        document(motor='<general joint="s" dyntype="filter" dynprm="0.1"/>'),
        r"activation states \(filter\)",
    ),
    "muscle": (document(motor='<muscle joint="s"/>'), "muscle"),
    "general muscle": (
        document(motor='<general joint="s" dyntype="muscle"/>'),
        "muscle",
    ),
    "cylinder": (document(motor='<cylinder joint="s"/>'), "activation states"),
    "no gear": (document(motor='<motor joint="s" gear="0"/>'), "pushes with 0 N whatever"),
    "vertical rail": (document().replace('axis="1 0 0"', 'axis="0 0 1"'), "goes up and down"),
    "hinge along the rail": (
        document().replace('axis="0 1 0"', 'axis="1 0 0"'),
        "axis is along the rail",
    ),
    "hinge upright": (document().replace('axis="0 1 0"', 'axis="0 0 1"'), "about the vertical"),
    "short of upright": (
        document().replace('name="h"', 'name="h" range="10 20"'),
        "range from 0.174533 to 0.349066 rad of joint 'h' that leaves out the upright position",
    ),
    "timestep that does not divide": (document().replace("0.02", "0.007"), "does not divide"),
    "long timestep": (document().replace("0.02", "0.05"), "does not divide"),
    "tiny timestep": (document().replace("0.02", "1e-7"), "no more than 1000 are done"),
}


@pytest.mark.parametrize("case", NO_CART_POLES)
def test_what_is_no_cart_pole(case):
    text, reason = NO_CART_POLES[case]
    with pytest.raises(NotACartPoleError, match=reason) as caught:
        load_model(text)
    assert_clear(caught.value)


URDF = """<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="prismatic">
<parent link="a"/><child link="b"/></joint></robot>"""


NO_MJCF = {
    "urdf": (URDF, r"outermost element is <robot> \(a URDF"),
    "html": ("<html><body/></html>", "outermost element is <html>, not <mujoco>"),
    "cut off": (REFERENCE[: len(REFERENCE) // 2], "not well-formed XML"),
    "unknown element": (REFERENCE.replace("<asset>", "<assets/><asset>"), "assets"),
    "unknown attribute": (REFERENCE.replace("<motor ", '<motor colour="1" '), "colour"),
    "missing mesh": (document(more='<asset><mesh file="no.stl"/></asset>'), r"no\.stl"),
    "missing texture": (
        document(more='<asset><texture name="t" type="2d" file="no.png"/></asset>'),
        r"no\.png",
    ),
    "words for numbers": (REFERENCE.replace('gear="10"', 'gear="ten"'), "gear"),
    "no mass": (document().replace('size="0.1"', 'size="0.1" mass="0"'), "mass and inertia"),
}


@pytest.mark.parametrize("case", NO_MJCF)
def test_what_is_no_mjcf(case):
    text, reason = NO_MJCF[case]
    with pytest.raises(ModelSyntaxError, match=reason) as caught:
        load_model(text)
    assert_clear(caught.value)


TOO_MUCH = {
    "copies": (
        document(with_pole(POLE.format("")) + '<replicate count="1000000"><site/></replicate>'),
        "asks for too much: .*(not done within|ended)",
    ),
    "copies of copies": (
        document(
            with_pole(POLE.format(""))
            + '<replicate count="900"><replicate count="900"><site/></replicate></replicate>'
        ),
        "asks for too much: .*(not done within|ended)",
    ),
    "depth": (document(with_pole(POLE.format("<body>" * 300 + "</body>" * 300))), "200 levels"),
    "pixels": (
        document(
            more='<asset><texture builtin="flat" type="2d" name="t" '
            'width="100000" height="100000"/></asset>'
        ),
        "asks for too much: .*no memory left",
    ),
    "memory": (
        document(more='<size memory="2G"/>'),
        "asks for too much: .*no memory left",
    ),
    "contacts": (document(more='<size nconmax="2000000000"/>'), "asks for too much: .*memory left"),
    "iterations": (document(more='<option iterations="1000000"/>'), "1000000 iterations in each"),
    "simulated lengths": (
        document(more='<compiler><lengthrange mode="all" inttotal="1e9"/></compiler>'),
        "asks for too much",
    ),
    "gravity": (document(more='<option gravity="0 0 nan"/>'), "NaN or infinite .gravity of"),
    "range": (document(motor='<motor joint="s" ctrlrange="-inf inf"/>'), "NaN or infinite"),
    "no time": (document().replace('"0.02"', '"0"'), "timestep of 0 s"),
    "drag": (
        document()
        .replace('name="h"', 'name="h" damping="1e308"')
        .replace('pos="0 0 1"', 'pos="0 0 1" mass="1e-4"'),
        "moves off with an acceleration that is NaN or infinite",
    ),
}


OUT_OF_TIME = {"copies", "copies of copies", "simulated lengths"}


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, marks=pytest.mark.slow) if case in OUT_OF_TIME else case
        for case in TOO_MUCH
    ],
)
def test_what_asks_for_too_much(case):
    text, reason = TOO_MUCH[case]
    with pytest.raises(ModelError, match=reason) as caught:
        load_model(text)
    assert not isinstance(caught.value, NotACartPoleError)
    assert_clear(caught.value)


FILES = {
    "empty": (b"", ModelSyntaxError, "is not a valid MJCF: it is empty"),
    "spaces": (b" \n", ModelSyntaxError, "it is empty"),
    "utf-16": (REFERENCE.encode("utf-16"), ModelSyntaxError, "is not text in UTF-8"),
    "latin-1": ("<!-- é -->".encode("latin-1"), ModelSyntaxError, "is not text in UTF-8"),
    "picture": (b"\x89PNG\r\n\x1a\n\0\0", ModelSyntaxError, "is not text in UTF-8"),
    "zeros": (bytes(100), ModelSyntaxError, "zero byte"),
    "prose": (b"A cart and a pole.", ModelSyntaxError, "not well-formed XML"),
    "json": (b'{"mujoco": {}}', ModelSyntaxError, "not well-formed XML"),
    "huge": (b"<mujoco>" + b" " * 2**24 + b"</mujoco>", ModelSyntaxError, "16777233 bytes"),
}


@pytest.mark.parametrize("case", FILES)
def test_files_that_hold_no_document(case, tmp_path):
    content, kind, reason = FILES[case]
    path = tmp_path / "model.xml"
    path.write_bytes(content)
    with pytest.raises(kind, match=reason) as caught:
        load_model(path)
    assert "model.xml" in str(caught.value)
    assert_clear(caught.value)


INCLUDES = {
    "missing": ("nowhere.xml", ModelNotFoundError, r"nowhere\.xml.* cannot be read"),
    "itself": ("main.xml", ModelSyntaxError, "includes 'main.xml' more than once, or in a circle"),
    "a folder": (".", ModelNotFoundError, "cannot be read"),
    "nothing": ("", ModelNotFoundError, "cannot be read"),
    "in a circle": ("a.xml", ModelSyntaxError, "includes 'a.xml' more than once, or in a circle"),
    "broken": ("broken.xml", ModelSyntaxError, r"'broken\.xml' is not a valid MJCF"),
}


@pytest.mark.parametrize("case", INCLUDES)
def test_includes_that_lead_nowhere(case, tmp_path):
    file, kind, reason = INCLUDES[case]
    (tmp_path / "a.xml").write_text('<x><include file="b.xml"/></x>')
    (tmp_path / "b.xml").write_text('<x><include file="a.xml"/></x>')
    (tmp_path / "broken.xml").write_text("<x><y></x>")
    path = tmp_path / "main.xml"
    path.write_text(REFERENCE.replace("</mujoco>", f'<include file="{file}"/></mujoco>'))
    with pytest.raises(kind, match=reason) as caught:
        load_model(path)
    assert_clear(caught.value)


def test_a_folder_is_no_model(tmp_path):
    with pytest.raises(ModelNotFoundError, match="is a folder"):
        load_model(tmp_path)


def assert_clear(error: Exception) -> None:
    """One line of words, not a thing's inside."""
    message = str(error)
    assert len(message.splitlines()) == 1
    assert 30 < len(message) < 600
    assert not re.search(r"Traceback|0x[0-9a-f]{6}|<class", message)
