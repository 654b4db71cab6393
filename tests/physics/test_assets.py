"""A document with files beside it compiles to the same bytes from anywhere, or is refused."""

import os
import struct
import sys
from pathlib import Path

import mujoco
import pytest
from PIL import Image

from mjcartpole.errors import ModelError, ModelNotFoundError
from mjcartpole.learning.run_model import check_storable, write_model
from mjcartpole.physics.assets import is_stored
from mjcartpole.physics.includes import read_whole
from mjcartpole.physics.load import load_model, load_stored, same_model

MESH = '<mesh name="m" file="{}"/>'
TEXTURE = '<texture name="t" type="2d" file="{}"/>'
CUBE = '<texture name="t" type="cube" fileright="{}" fileleft="{}"/>'
HFIELD = '<hfield name="f" size="1 1 1 1" file="{}"/>'
SKIN = '<deformable><skin name="s" file="{}"/></deformable>'
FLEX = '<body name="cloth"><flexcomp name="c" type="mesh" dim="2" rigid="true" file="{}"/></body>'
CHILD = """<mujoco model="child">{}<asset><mesh name="m" file="{}"/></asset>
<worldbody><body name="b"><geom type="mesh" mesh="m"/></body></worldbody></mujoco>"""
ATTACH = '<body name="B" pos="0 9 0"><attach model="child" body="b" prefix="p"/></body>'

OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


def document(head="", asset="", world="", more=""):
    """A cart-pole that names files."""
    return f"""<mujoco model="t">{head}
  <option timestep="0.02" gravity="0 0 -9.8"><flag contact="disable"/></option>
  <asset>{asset}</asset>
  <worldbody>{world}<body name="cart">
    <joint name="s" type="slide" axis="1 0 0"/><geom type="box" size=".2 .1 .1" mass="1"/>
    <body name="pole"><joint name="h" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 0 0 1" size=".03" mass=".1"/></body>
  </body></worldbody>
  <actuator><motor joint="s" gear="10" ctrlrange="-1 1" ctrllimited="true"/></actuator>{more}
</mujoco>"""


def included(content):
    return f"<mujocoinclude>{content}</mujocoinclude>"


def skin_bytes():
    """A triangle that follows the body named cart."""
    whole = struct.pack("4i", 3, 0, 1, 1) + struct.pack("9f", *range(9))
    whole += struct.pack("3i", 0, 1, 2) + b"cart".ljust(40, b"\0")
    whole += struct.pack("7f", 0, 0, 0, 1, 0, 0, 0) + struct.pack("i", 3)
    return whole + struct.pack("3i", 0, 1, 2) + struct.pack("3f", 1, 1, 1)


def write(folder, files):
    """Write documents, given as text, and other files, named alone."""
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if text:
            path.write_text(text, encoding="utf-8")
        elif path.suffix == ".png":
            Image.effect_noise((8, 8), 50).convert("RGB").save(path)
        else:
            path.write_bytes(skin_bytes() if path.suffix == ".skn" else OBJ)
    return folder / "main.xml"


def compiler(attributes):
    return f"<compiler {attributes}/>"


LAYOUTS = {
    "beside it": {"main.xml": document("", MESH.format("m.obj")), "m.obj": ""},
    "meshdir": {
        "main.xml": document(compiler('meshdir="a"'), MESH.format("m.obj")),
        "a/m.obj": "",
    },
    "texturedir": {
        "main.xml": document(compiler('texturedir="a"'), TEXTURE.format("t.png")),
        "a/t.png": "",
    },
    "assetdir": {
        "main.xml": document(
            compiler('assetdir="a/"'), MESH.format("x/m.obj") + TEXTURE.format("t.png")
        ),
        "a/x/m.obj": "",
        "a/t.png": "",
    },
    "assetdir and meshdir": {
        "main.xml": document(compiler('meshdir="b" assetdir="a"'), MESH.format("m.obj")),
        "b/m.obj": "",
    },
    "no meshdir": {
        "main.xml": document(compiler('meshdir="" assetdir="a"'), MESH.format("m.obj")),
        "m.obj": "",
    },
    "several compilers": {
        "main.xml": document(
            compiler('meshdir="b" texturedir="c"') + compiler('assetdir="a"') + compiler(""),
            MESH.format("m.obj") + TEXTURE.format("t.png"),
            more=compiler('texturedir="d"'),
        ),
        "a/m.obj": "",
        "d/t.png": "",
    },
    "up and down": {
        "main.xml": document(compiler('meshdir="a/b/../"'), MESH.format("../c/./m.obj")),
        "c/m.obj": "",
    },
    "both slashes": {
        "main.xml": document(compiler('meshdir="a\\b"'), MESH.format("c\\m.obj")),
        "a/b/c/m.obj": "",
    },
    "stripped": {
        "main.xml": document(
            compiler('strippath="true" meshdir="a"'),
            MESH.format("/far/away/m.obj") + TEXTURE.format("far/t.png"),
        ),
        "a/m.obj": "",
        "t.png": "",
    },
    "no name": {"main.xml": document("", '<mesh file="x/m.obj"/>'), "x/m.obj": ""},
    "sides of a cube": {
        "main.xml": document(compiler('texturedir="a"'), CUBE.format("t.png", "u.png")),
        "a/t.png": "",
        "a/u.png": "",
    },
    "height field": {
        "main.xml": document(compiler('meshdir="a" texturedir="b"'), HFIELD.format("t.png")),
        "a/t.png": "",
    },
    "skin": {
        "main.xml": document(compiler('meshdir="a"'), more=SKIN.format("s.skn")),
        "a/s.skn": "",
    },
    "cloth": {
        "main.xml": document(compiler('meshdir="a"'), world=FLEX.format("m.obj")),
        "a/m.obj": "",
    },
    "odd names": {
        "main.xml": document(compiler("meshdir='ä \"&amp;'"), MESH.format("ü &lt;.obj")),
        'ä "&/ü <.obj': "",
    },
    "include beside its mesh": {
        "main.xml": document('<include file="sub/i.xml"/>'),
        "sub/i.xml": included(f"<asset>{MESH.format('m.obj')}</asset>"),
        "sub/m.obj": "",
    },
    "include of a mesh beside the main file": {
        "main.xml": document("", '<include file="sub/i.xml"/>'),
        "sub/i.xml": included(MESH.format("m.obj") + TEXTURE.format("t.png")),
        "m.obj": "",
        "sub/m.obj": "",
        "sub/t.png": "",
    },
    "include with meshdir": {
        "main.xml": document(compiler('meshdir="b"') + '<include file="sub/i.xml"/>'),
        "sub/i.xml": included(compiler('meshdir="a"') + f"<asset>{MESH.format('m.obj')}</asset>"),
        "a/m.obj": "",
    },
    "include beside its mesh, with meshdir": {
        "main.xml": document(compiler('meshdir="b"') + '<include file="sub/i.xml"/>'),
        "sub/i.xml": included(f"<asset>{MESH.format('m.obj')}{MESH.format('n.obj')}</asset>")
        .replace('"m"', '"n"', 1),
        "sub/m.obj": "",
        "b/n.obj": "",
    },
    "include with assetdir": {
        "main.xml": document(compiler('assetdir="b" meshdir="c"') + '<include file="sub/i.xml"/>'),
        "sub/i.xml": included(f"<asset>{HFIELD.format('t.png')}</asset>"),
        "b/t.png": "",
        "c/t.png": "",
    },
    "include of a skin and a cloth": {
        "main.xml": document(
            world='<include file="sub/j.xml"/>', more='<include file="sub/i.xml"/>'
        ),
        "sub/i.xml": included(SKIN.format("s.skn")),
        "sub/j.xml": included(FLEX.format("m.obj")),
        "sub/s.skn": "",
        "sub/m.obj": "",
    },
    "include of an include": {
        "main.xml": document('<include file="sub/i.xml"/>'),
        "sub/i.xml": included('<include file="deep/j.xml"/>'),
        "sub/deep/j.xml": included(f"<asset>{MESH.format('m.obj')}</asset>"),
        "sub/deep/m.obj": "",
    },
    "attached": {
        "main.xml": document(
            compiler('meshdir="a" texturedir="b"'), '<model name="child" file="sub/c.xml"/>', ATTACH
        ),
        "sub/c.xml": CHILD.format(compiler('meshdir="d"'), "m.obj"),
        "sub/d/m.obj": "",
    },
    "attached, stripped": {
        "main.xml": document(
            compiler('strippath="true"'),
            '<model file="sub/c.xml"/>' + '<mesh name="n" file="y/m.obj"/>',
            ATTACH,
        ),
        "sub/c.xml": CHILD.format("", "x/m.obj"),
        "sub/m.obj": "",
        "m.obj": "",
    },
    "attached by an include": {
        "main.xml": document('<include file="sub/i.xml"/>', world=ATTACH),
        "sub/i.xml": included('<asset><model name="child" file="c.xml"/></asset>'),
        "sub/c.xml": CHILD.format("", "m.obj"),
        "sub/m.obj": "",
    },
    "attached to one attached": {
        "main.xml": document("", '<model name="child" file="sub/c.xml"/>', ATTACH),
        "sub/c.xml": """<mujoco><include file="x.xml"/><asset><model name="child" file="d.xml"/>
            </asset><worldbody><body name="b"><attach model="child" body="b" prefix="q"/></body>
            </worldbody></mujoco>""",
        "sub/x.xml": included("<option/>"),
        "sub/d.xml": CHILD.format("", "../m.obj"),
        "m.obj": "",
    },
}  # fmt: skip


@pytest.mark.parametrize("case", LAYOUTS)
def test_the_stored_document_is_the_same_model_from_anywhere(case, tmp_path, monkeypatch):
    path = write(tmp_path / "here", LAYOUTS[case])
    monkeypatch.chdir(tmp_path)
    cartpole = load_model(Path("here", "main.xml"))
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    again = load_model(cartpole.xml)
    assert same_model(again.model, cartpole.model)
    assert same_model(load_model(path).model, cartpole.model)
    assert again.xml == cartpole.xml
    edited = load_model(path, {"gravity": 5})
    assert edited.model.opt.gravity[2] == -5
    check_storable(cartpole)
    check_storable(edited)


@pytest.mark.parametrize("case", LAYOUTS)
def test_a_stored_model_needs_nothing_but_its_folder(case, tmp_path):
    path = write(tmp_path / "here", LAYOUTS[case])
    cartpole = load_model(path)
    write_model(tmp_path / "run", cartpole)
    (tmp_path / "here").rename(tmp_path / "gone")
    (tmp_path / "run").rename(tmp_path / "moved")
    document = (tmp_path / "moved" / "model.xml").read_text(encoding="utf-8")
    stored = load_stored(document, "it", tmp_path / "moved")
    assert same_model(stored.model, cartpole.model)
    assert stored.stored[0] == document
    assert str(tmp_path) not in document
    assert all(is_stored(each.name) for each in (tmp_path / "moved").glob("[!m]*"))


OUTSIDE = {
    "above": (document("", MESH.format("../m.obj")), "m.obj"),
    "absolute": (document("", MESH.format("{}/m.obj")), "m.obj"),
    "a link": (document("", MESH.format("link.obj")), "link.obj"),
    "by a folder": (document(compiler('meshdir="../run/.."'), MESH.format("m.obj")), "m.obj"),
    "stripped": (
        document(compiler('meshdir=".." strippath="true"'), MESH.format("m.obj")),
        "m.obj",
    ),
    "a texture": (document("", TEXTURE.format("../t.png")), "t.png"),
    "a side": (document("", CUBE.format("../t.png", "../t.png")), "t.png"),
    "a height field": (document("", HFIELD.format("../t.png")), "t.png"),
    "a skin": (document(more=SKIN.format("../s.skn")), "s.skn"),
    "a cloth": (document(world=FLEX.format("../m.obj")), "m.obj"),
    "a model": (document("", '<model file="../c.xml"/>'), "c.xml"),
    "a model's mesh": (document("", '<model file="d.xml"/>'), "m.obj"),
    "an include": (document('<include file="../i.xml"/>'), "i.xml"),
}


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights")
@pytest.mark.parametrize("case", OUTSIDE)
def test_a_stored_model_reads_no_other_files_unless_allowed(case, tmp_path):
    text, named = OUTSIDE[case]
    text = text.replace("{}", str(tmp_path))
    other = {"m.obj": "", "t.png": "", "s.skn": "", "c.xml": "<mujoco/>", "i.xml": included("")}
    write(tmp_path, other)
    write(tmp_path / "run", {"d.xml": CHILD.format("", "../m.obj"), "main.xml": text})
    (tmp_path / "run" / "link.obj").symlink_to(tmp_path / "m.obj")
    with pytest.raises(ModelNotFoundError, match="lies outside the run's folder") as caught:
        load_stored(text, "it", tmp_path / "run")
    assert named in str(caught.value)
    assert f"--allow-assets {tmp_path.resolve()} " in str(caught.value)
    load_stored(text, "it", tmp_path / "run", [tmp_path])


def test_only_names_of_files_are_written_anew(tmp_path):
    text = document("<!-- a -- b --><compiler  meshdir = 'a'\n/>", MESH.format("m.obj"))
    path = write(tmp_path, {"main.xml": text, "a/m.obj": ""})
    file = tmp_path.resolve() / "a" / "m.obj"
    assert load_model(path).xml == text.replace("'a'", "''").replace("m.obj", str(file))
    plain = document("<!-- a -- b --><compiler meshdir='a' assetdir='b'/>", "<!-- mesh -->")
    assert read_whole(plain, "it", tmp_path).text == plain


def test_absolute_names_need_no_folder(tmp_path):
    write(tmp_path, {"m.obj": ""})
    text = document("", MESH.format(tmp_path / "m.obj"))
    assert load_model(text).xml == text


def test_a_document_as_text_names_files_where_the_program_runs(tmp_path, monkeypatch):
    write(tmp_path, {"a/m.obj": ""})
    monkeypatch.chdir(tmp_path)
    cartpole = load_model(document(compiler('meshdir="a"'), MESH.format("m.obj")))
    monkeypatch.chdir("/")
    assert same_model(load_model(cartpole.xml).model, cartpole.model)


def test_a_spec_leads_to_its_files(tmp_path):
    path = write(tmp_path, LAYOUTS["assetdir"])
    cartpole = load_model(mujoco.MjSpec.from_file(str(path)))
    assert load_model(cartpole.xml).model.nmesh == cartpole.model.nmesh == 1


def test_a_linked_model_has_its_files_beside_the_link(tmp_path):
    original = write(tmp_path / "store", {"main.xml": document("", MESH.format("m.obj"))})
    write(tmp_path / "here", {"m.obj": ""})
    (tmp_path / "here" / "main.xml").symlink_to(original)
    (tmp_path / "link").symlink_to(tmp_path / "here")
    cartpole = load_model(tmp_path / "link" / ".." / "link" / "main.xml")
    assert same_model(load_model(cartpole.xml).model, cartpole.model)


def assert_refused(path, kind, reason):
    with pytest.raises(kind, match=reason) as caught:
        load_model(path)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 600


MISSING = {
    "mesh": (document(compiler('meshdir="a"'), MESH.format("no.obj")), r"opening file '.*no\.obj"),
    "texture": (document("", TEXTURE.format("no.png")), r"opening file '.*no\.png"),
    "model": (
        document("", '<model file="no.xml"/>'),
        r"'no\.xml', which .*main\.xml attaches, cannot be read: .*No such file",
    ),
}


@pytest.mark.parametrize("case", MISSING)
def test_a_missing_file_is_named(case, tmp_path):
    text, reason = MISSING[case]
    assert_refused(write(tmp_path, {"main.xml": text}), ModelError, reason)


STRANGE = {
    "mesh": document("", MESH.format("strange")),
    "mesh, stripped": document(compiler('strippath="true"'), MESH.format("x/strange")),
    "texture": document("", TEXTURE.format("strange")),
    "side": document("", CUBE.format("strange", "strange")),
    "height field": document("", HFIELD.format("strange")),
    "skin": document(more=SKIN.format("strange")),
    "cloth": document(world=FLEX.format("strange")),
    "model": document("", '<model file="strange"/>'),
    "include": document('<include file="strange"/>'),
    "include of a mesh": document('<include file="sub/i.xml"/>'),
    "mesh of a model": document("", '<model file="c.xml"/>'),
}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes")
@pytest.mark.parametrize("case", STRANGE)
@pytest.mark.parametrize("kind", ["pipe", "device", "folder"])
def test_what_is_no_plain_file_is_refused(case, kind, tmp_path):
    path = write(tmp_path, {"main.xml": STRANGE[case], "c.xml": CHILD.format("", "strange")})
    strange = tmp_path / "strange"
    if case == "include of a mesh":
        write(tmp_path, {"sub/i.xml": included(f"<asset>{MESH.format('strange')}</asset>")})
        strange = tmp_path / "sub" / "strange"
    if kind == "pipe":
        os.mkfifo(strange)
    elif kind == "device":
        strange.symlink_to("/dev/zero")
    else:
        strange.mkdir()
    what = "a folder" if kind == "folder" else "no regular file"
    assert_refused(path, ModelNotFoundError, f"cannot be read: '.*strange' is {what}")


def test_one_model_may_be_attached_twice(tmp_path):
    twice = ATTACH + ATTACH.replace('"B"', '"C"').replace('"p"', '"q"')
    assets = '<model name="child" file="c.xml"/><model name="other" file="c.xml"/>'
    files = {"main.xml": document("", assets, twice), "c.xml": CHILD.format("", "m.obj")}
    assert load_model(write(tmp_path, files | {"m.obj": ""})).model.nbody == 7


@pytest.mark.skipif(sys.platform != "linux", reason="names that are no text")
def test_a_folder_whose_name_is_no_text_is_refused(tmp_path):
    folder = tmp_path / os.fsdecode(b"\xff")
    path = write(folder, {"main.xml": document("", MESH.format("m.obj")), "m.obj": ""})
    assert_refused(path, ModelError, "that name is not UTF-8")
