"""Files that a document names are found from anywhere, and come along with a stored model."""

from pathlib import Path

import mujoco
import pytest

from assets import (
    CHILD,
    CUBE,
    FLEX,
    HFIELD,
    MESH,
    SKIN,
    TEXTURE,
    compiler,
    document,
    included,
    write,
)
from mjcartpole.learning.run_model import check_storable, write_model
from mjcartpole.physics.assets import is_stored
from mjcartpole.physics.includes import read_whole
from mjcartpole.physics.load import load_model, load_stored, same_model
from nightly import few

ATTACH = '<body name="B" pos="0 9 0"><attach model="child" body="b" prefix="p"/></body>'


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


@pytest.mark.parametrize("case", few(LAYOUTS, *list(LAYOUTS)[::6]))
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


@pytest.mark.parametrize("case", few(LAYOUTS, *list(LAYOUTS)[1::3]))
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


def test_one_model_may_be_attached_twice(tmp_path):
    twice = ATTACH + ATTACH.replace('"B"', '"C"').replace('"p"', '"q"')
    assets = '<model name="child" file="c.xml"/><model name="other" file="c.xml"/>'
    files = {"main.xml": document("", assets, twice), "c.xml": CHILD.format("", "m.obj")}
    assert load_model(write(tmp_path, files | {"m.obj": ""})).model.nbody == 7
