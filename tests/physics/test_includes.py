"""Included files and attached models are read as MuJoCo would, or refused before it hangs."""

import os
import re

import pytest

from mjcartpole.errors import ModelError, ModelNotFoundError, ModelSyntaxError
from mjcartpole.physics.includes import LARGEST_FILE, read_text
from mjcartpole.physics.load import load_model, models_folder, same_model

REFERENCE = (models_folder() / "cartpole.xml").read_text(encoding="utf-8")
MOTOR = re.search("<motor [^>]*/>", REFERENCE)[0]
ATTACH = '<body name="B" pos="0 9 0"><attach model="c" body="b" prefix="p"/></body>'


def document(head="", asset="", world=""):
    """The reference with more in it."""
    text = REFERENCE.replace("<compiler", f"{head}<compiler")
    text = text.replace("<asset>", f"<asset>{asset}")
    return text.replace("<worldbody>", f"<worldbody>{world}")


def write(folder, files):
    """Write documents; the first is the main one."""
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return folder / next(iter(files))


def with_motor(content):
    """The reference with something else in place of its motor."""
    return REFERENCE.replace(MOTOR, content)


def assert_refused(path, kind, reason):
    with pytest.raises(kind, match=reason) as caught:
        load_model(path)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 600


MODELS = {
    "a long chain": (
        {"main.xml": document("", '<model file="0.xml"/>')}
        | {
            f"{i}.xml": f'<mujoco><asset><model file="{i + 1}.xml"/></asset></mujoco>'
            for i in range(60)
        },
        ModelError,
        "one document too many: 50 at most",
    ),
    "many elements": (
        {
            "main.xml": document("", '<model file="c.xml"/>'),
            "c.xml": f"<mujoco><worldbody>{'<site/>' * 6000}</worldbody></mujoco>",
        },
        ModelError,
        r"'c\.xml', which .*main\.xml attaches, is not a valid MJCF: it has more than 5000 ",
    ),
    "a robot": (
        {"main.xml": document("", '<model file="r.xml"/>'), "r.xml": '<robot name="r"/>'},
        ModelSyntaxError,
        "outermost element is <robot>",
    ),
    "no xml": (
        {"main.xml": document("", '<model file="r.xml"/>'), "r.xml": "<mujoco>"},
        ModelSyntaxError,
        r"'r\.xml', which .*main\.xml attaches, is not a valid MJCF",
    ),
}


@pytest.mark.parametrize("case", MODELS)
def test_attached_models_that_would_not_end_well(case, tmp_path):
    files, kind, reason = MODELS[case]
    assert_refused(write(tmp_path, files), kind, reason)


PUSH = f"<mujocoinclude>{MOTOR}</mujocoinclude>"

INCLUDES = {
    "beside": {"main.xml": with_motor('<include file="i.xml"/>'), "i.xml": PUSH},
    "below": {"main.xml": with_motor('<include file="a/i.xml"/>'), "a/i.xml": PUSH},
    "both slashes": {"main.xml": with_motor('<include file="a\\i.xml"/>'), "a/i.xml": PUSH},
    "above": {"a/main.xml": with_motor('<include file="../i.xml"/>'), "i.xml": PUSH},
    "byte order mark": {
        "main.xml": "\ufeff" + with_motor('<include file="i.xml"/>'),
        "i.xml": "\ufeff" + PUSH,
    },
    "declared, with comments as people write them": {
        "main.xml": with_motor('<!-- a -- b --><include file="i.xml"/>'),
        "i.xml": f'<?xml version="1.0" encoding="utf-8"?><!-- a -- b --><x><!-- ä -->{MOTOR}</x>',
    },
    "beside the file that includes it": {
        "main.xml": with_motor('<include file="a/i.xml"/>'),
        "a/i.xml": '<x><include file="b/j.xml"/></x>',
        "a/b/j.xml": '<x><include file="k.xml"/></x>',
        "a/b/k.xml": PUSH,
    },
    "the main file's folder comes first": {
        "main.xml": with_motor('<include file="a/i.xml"/>'),
        "a/i.xml": '<x><include file="j.xml"/></x>',
        "a/j.xml": "<x><muscle/></x>",
        "j.xml": PUSH,
    },
    "two files of one name": {
        "main.xml": with_motor('<include file="i.xml"/>'),
        "i.xml": '<x><include file="a/i.xml"/></x>',
        "a/i.xml": PUSH,
    },
}


@pytest.mark.parametrize("case", INCLUDES)
def test_includes_are_found_as_mujoco_finds_them(case, tmp_path, monkeypatch):
    path = write(tmp_path, INCLUDES[case])
    cartpole = load_model(path)
    assert "<include" not in cartpole.xml
    monkeypatch.chdir("/")
    assert same_model(load_model(cartpole.xml).model, cartpole.model)
    assert same_model(cartpole.model, load_model().model)


NO_INCLUDES = {
    "no file": (
        {"main.xml": with_motor("<include/>")},
        ModelNotFoundError,
        r"main\.xml cannot be read whole: an <include> of it names no file",
    ),
    "no file further down": (
        {"main.xml": with_motor('<include file="i.xml"/>'), "i.xml": '<x><include file=""/></x>'},
        ModelNotFoundError,
        r"'i\.xml' cannot be read whole: an <include> of it names no file",
    ),
    "missing": (
        {"main.xml": with_motor('<include file="i.xml"/>')},
        ModelNotFoundError,
        r"'i\.xml', which .*main\.xml includes, cannot be read: .*No such file",
    ),
    "missing further down": (
        {
            "main.xml": with_motor('<include file="a/i.xml"/>'),
            "a/i.xml": '<x><include file="j.xml"/></x>',
        },
        ModelNotFoundError,
        r"'j\.xml', which 'a/i\.xml' includes, cannot be read",
    ),
    "twice by two names": (
        {
            "main.xml": with_motor('<include file="i.xml"/><include file="./i.xml"/>'),
            "i.xml": PUSH,
        },
        ModelSyntaxError,
        r"includes '\./i\.xml' more than once, or in a circle",
    ),
    "itself, further down": (
        {
            "main.xml": with_motor('<include file="a/i.xml"/>'),
            "a/i.xml": '<x><include file="./i.xml"/></x>',
        },
        ModelSyntaxError,
        "more than once, or in a circle",
    ),
    "too many together": (
        {
            "main.xml": with_motor('<include file="i.xml"/><include file="j.xml"/>'),
            "i.xml": f"<x>{MOTOR}{'<motor/>' * 2500}</x>",
            "j.xml": f"<x>{'<motor/>' * 2500}</x>",
        },
        ModelSyntaxError,
        "more than 5000 elements",
    ),
    "a long chain": (
        {"main.xml": with_motor('<include file="0.xml"/>')}
        | {f"{i}.xml": f'<x><include file="{i + 1}.xml"/></x>' for i in range(60)},
        ModelError,
        "one document too many: 50 at most",
    ),
    "entities": (
        {
            "main.xml": with_motor('<include file="i.xml"/>'),
            "i.xml": '<!DOCTYPE x [<!ENTITY a "b">]><x><motor name="&a;"/></x>',
        },
        ModelSyntaxError,
        "declares XML entities",
    ),
}


@pytest.mark.parametrize("case", NO_INCLUDES)
def test_includes_that_cannot_be_followed(case, tmp_path):
    files, kind, reason = NO_INCLUDES[case]
    assert_refused(write(tmp_path, files), kind, reason)


def test_what_is_not_included_stays_as_it_was_written(tmp_path):
    text = REFERENCE.replace(
        MOTOR, '<!-- a -- b --><include\n file="i.xml" ></include  ><!-- c -->'
    )
    write(tmp_path, {"main.xml": text, "i.xml": f"<x ><!-- d -- e -->\n {MOTOR}</x >"})
    inner = f"<!-- d -- e -->\n {MOTOR}"
    assert load_model(tmp_path / "main.xml").xml == REFERENCE.replace(
        MOTOR, f"<!-- a -- b -->{inner}<!-- c -->"
    )


def test_two_attached_models_may_include_the_same_file(tmp_path):
    child = '<mujoco model="{0}"><include file="i.xml"/><worldbody/></mujoco>'
    files = {
        "main.xml": document("", '<model file="a.xml"/><model file="b.xml"/>'),
        "a.xml": child.format("a"),
        "b.xml": child.format("b"),
        "i.xml": "<x><option/></x>",
    }
    assert load_model(write(tmp_path, files)).stored[1]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes")
def test_only_regular_files_of_a_sane_size_are_read(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "large").write_bytes(b" " * (LARGEST_FILE + 1))
    for path in (tmp_path / "pipe", tmp_path, "/dev/zero"):
        with pytest.raises(ModelNotFoundError, match=r"is (a folder|no regular file)"):
            read_text(tmp_path / path)
    with pytest.raises(ModelSyntaxError, match=f"large' has {LARGEST_FILE + 1} bytes"):
        read_text(tmp_path / "large")
    with pytest.raises(ModelNotFoundError, match=r"^it cannot be read: .*No such file"):
        read_text(tmp_path / "nothing", "it")
