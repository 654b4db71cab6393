"""Files that a model may not read, or that are none."""

import os
import sys

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
from mjcartpole.errors import ModelError, ModelNotFoundError
from mjcartpole.physics.load import load_model, load_stored

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


@pytest.mark.skipif(sys.platform != "linux", reason="names that are no text")
def test_a_folder_whose_name_is_no_text_is_refused(tmp_path):
    folder = tmp_path / os.fsdecode(b"\xff")
    path = write(folder, {"main.xml": document("", MESH.format("m.obj")), "m.obj": ""})
    assert_refused(path, ModelError, "that name is not UTF-8")
