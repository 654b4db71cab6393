"""Documents that would take all memory or time, or crash MuJoCo, are refused in one line."""

import json
import os
import random
import struct
import subprocess
import sys
import zlib

import pytest

from mjcartpole.errors import ModelError
from mjcartpole.physics.guard import compile_document
from mjcartpole.physics.includes import read_whole
from mjcartpole.physics.load import load_model, model_names, models_folder, same_model
from nightly import few

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits of Linux processes")

REFERENCE = (models_folder() / "cartpole.xml").read_text(encoding="utf-8")
MEGABYTES = 1000

BALL = '<geom contype="1" conaffinity="1" size="1"/>'
TEXTURE = '<texture name="t{}" type="2d" builtin="flat" width="5700" height="5700"/>'
EGG = '<geom contype="1" conaffinity="1" type="ellipsoid" size="1 .5 .3"/>'
PLUGIN = """<plugin name="g" plugin="mujoco.sensor.touch_grid" objtype="site" objname="q">
<config key="size" value="100000 100000"/><config key="fov" value="9 9"/></plugin>"""


def document(asset="", world="", more="", head="", cart=""):
    """The reference with more in it."""
    text = REFERENCE.replace("<compiler", f"{head}<compiler", 1)
    text = text.replace("<asset>", f"<asset>{asset}").replace("<worldbody>", f"<worldbody>{world}")
    return text.replace("<inertial ", f"{cart}<inertial ", 1).replace(
        "</mujoco>", f"{more}</mujoco>"
    )


QUICK = {
    "memory": document(more='<size memory="100G"/>'),
    "user data": document(more='<size nuserdata="2000000000"/>'),
    "constraints": document(more='<size njmax="2000000000" nconmax="2000000000"/>'),
    "contact sensor": document(more='<sensor><contact geom1="cart" num="2000000000"/></sensor>'),
    "range finder": document(
        world='<camera name="c" resolution="100000 100000"/>',
        more='<sensor><rangefinder camera="c"/></sensor>',
    ),
    "samples": document(more='<sensor><clock nsample="2000000000" delay="1"/></sensor>'),
    "wide texture": document('<texture name="t" builtin="flat" width="100000" height="100000"/>'),
    "touch grid": document(
        head='<extension><plugin plugin="mujoco.sensor.touch_grid"/></extension>',
        world='<site name="q"/>',
        more=f"<sensor>{PLUGIN}</sensor>",
    ),
    "supersphere": document('<mesh name="m" builtin="supersphere" params="9000 1 1"/>'),
    "overlapping bodies": document(world=BALL * 1200, cart=BALL * 1200),
    "slow contacts": document(world=EGG * 100, cart=EGG * 100),
    "many sensors": document(more=f"<sensor>{'<clock/>' * 400_000}</sensor>"),
    "nested": document(world="<body>" * 100_000 + "</body>" * 100_000),
    "laughs": '<!DOCTYPE m [<!ENTITY a "aaaa">]>' + REFERENCE.replace('"cartpole"', '"&a;"'),
    "files": document('<mesh name="m" file="sparse.stl"/>'),
    "copies": document(world='<replicate count="6000"><site/></replicate>'),
}

SLOW = {
    "textures": document("".join(TEXTURE.format(number) for number in range(50))),
    "picture files": document(
        "".join(f'<texture name="t{i}" type="2d" file="wide.png"/>' for i in range(50))
    ),
    "cube": document(
        '<texture name="t" type="cube" '
        + "".join(f'file{side}="wide.png" ' for side in ("right", "left", "up", "down", "front"))
        + "/>"
    ),
    "height fields": document(
        "".join(f'<hfield name="h{i}" nrow="2000" ncol="2000" size="1 1 1 1"/>' for i in range(50))
    ),
    "slices": document('<mesh name="m" builtin="cone" params="1000000 0"/>'),
    "replicas": document(world=f'<replicate count="100000"><body>{BALL}</body></replicate>'),
    "replicas of replicas": document(
        world='<replicate count="1000"><replicate count="1000"><site/></replicate></replicate>'
    ),
    "cable": document(
        world='<body><composite type="cable" count="100000 1 1" size="1"><geom size=".1"/>'
        "</composite></body>"
    ),
    "grid": document(
        world='<body name="b"><flexcomp name="f" type="grid" count="300 300 300" dim="3" mass="1"/>'
        "</body>"
    ),
    "sheet": document(
        world='<body name="b"><flexcomp name="f" type="grid" count="900 900 1" mass="1"/></body>'
    ),
    "names of bodies": document(more='<size nuser_geom="20000000"/>'),
    "keyframes": document(more='<size nkey="200000000"/>'),
    "length ranges": document(head='<compiler><lengthrange mode="all" inttotal="1e9"/></compiler>'),
    "iterations": document(
        head='<option iterations="2000000000" noslip_iterations="2000000000" tolerance="0"/>'
    ).replace('name="slider"', 'name="slider" frictionloss="1"'),
    "itself": document('<model name="m" file="main.xml"/>'),
    "copies of copies": document(
        world='<body name="b0"/>'
        + "".join(
            f'<body name="b{i + 1}">'
            + "".join(f'<attach body="b{i}" prefix="{i}{k}"/>' for k in range(8))
            + "</body>"
            for i in range(20)
        )
    ),
    "points": document(
        '<mesh name="m" file="points.obj"/>',
        '<geom type="mesh" mesh="m" contype="1" conaffinity="1"/>',
    ),
}


def picture(width, height):
    """A black picture that takes little room as a file."""

    def chunk(kind, content):
        checksum = struct.pack(">I", zlib.crc32(kind + content))
        return struct.pack(">I", len(content)) + kind + content + checksum

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    pixels = zlib.compress(bytes((3 * width + 1) * height), 1)
    parts = chunk(b"IHDR", header), chunk(b"IDAT", pixels), chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def points(number):
    """A cloud whose convex hull is long in the finding: all points lie on a sphere."""
    rng = random.Random(0)
    rows = ([rng.gauss(0, 1) for _ in range(3)] for _ in range(number))
    normed = ([value / sum(each * each for each in row) ** 0.5 for value in row] for row in rows)
    vertices = "".join(f"v {x:.7f} {y:.7f} {z:.7f}\n" for x, y, z in normed)
    return vertices + "".join(f"f {i} {i + 1} {i + 2}\n" for i in range(1, number - 2, 3))


LOADER = """
import json, resource, sys
from mjcartpole.errors import ModelError
from mjcartpole.physics.load import load_model
try:
    load_model(sys.argv[1])
    said = ""
except ModelError as error:
    said = str(error)
peaks = (resource.getrusage(who).ru_maxrss // 1024 for who in (0, -1))
print(json.dumps([said, *peaks]))
"""


def assert_refused(path):
    """In another process, so that its peak of memory is seen."""
    command = [sys.executable, "-c", LOADER, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    said, own, childrens = json.loads(done.stdout)
    assert path.name in said
    assert "\n" not in said
    assert len(said) < 600
    assert max(own, childrens) < MEGABYTES


FEW = ("memory", "wide texture", "overlapping bodies", "nested", "files")
"""Of all that is refused, what differs most."""


@pytest.mark.parametrize("case", few(QUICK, *FEW))
def test_what_asks_for_too_much_is_refused(case, tmp_path):
    path = tmp_path / "main.xml"
    path.write_text(QUICK[case], encoding="utf-8")
    with (tmp_path / "sparse.stl").open("wb") as file:
        file.truncate(6 * 2**30)
    with pytest.raises(ModelError) as caught:
        load_model(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 600


@pytest.mark.slow
@pytest.mark.parametrize("case", [*QUICK, *SLOW])
def test_what_asks_for_too_much_takes_little_memory_and_time(case, tmp_path):
    path = tmp_path / "main.xml"
    path.write_text((QUICK | SLOW)[case], encoding="utf-8")
    with (tmp_path / "sparse.stl").open("wb") as file:
        file.truncate(6 * 2**30)
    if "wide.png" in path.read_text(encoding="utf-8"):
        (tmp_path / "wide.png").write_bytes(picture(5700, 5700))
    if case == "points":
        (tmp_path / "points.obj").write_text(points(600_000))
    assert_refused(path)


HONEST = {
    "sky": document('<texture type="skybox" builtin="gradient" width="512" height="3072"/>'),
    "hull": document('<mesh name="m" file="points.obj"/>', '<geom type="mesh" mesh="m"/>'),
    "height field": document(
        '<hfield name="h" nrow="200" ncol="200" size="5 5 1 1"/>',
        '<geom type="hfield" hfield="h" pos="0 0 -5" contype="1"/>',
    ),
    "cloth": document(
        world='<body name="b" pos="0 5 3"><flexcomp name="f" type="grid" count="20 20 1" '
        'spacing=".1 .1 .1" dim="2" mass="1" radius=".01" rigid="true"/></body>'
    ),
    "working memory": document(more='<size memory="100M"/>'),
    "old sizes": document(more='<size njmax="500" nconmax="100" nuserdata="10"/>'),
    "sensors": document(more='<sensor><jointpos joint="hinge"/><jointvel joint="hinge"/></sensor>'),
    "key": document(more='<keyframe><key qpos="0 0.1"/></keyframe>'),
}


@pytest.mark.parametrize("case", HONEST)
def test_what_is_honest_is_loaded(case, tmp_path):
    path = tmp_path / "main.xml"
    path.write_text(HONEST[case], encoding="utf-8")
    (tmp_path / "points.obj").write_text(points(3_000))
    assert load_model(path).poles == 1


@pytest.mark.slow
def test_large_pictures_and_meshes_are_loaded(tmp_path):
    for name in ("a.png", "b.png"):
        (tmp_path / name).write_bytes(picture(4096, 4096))
    (tmp_path / "points.obj").write_text(points(50_000))
    path = tmp_path / "main.xml"
    textures = (f'<texture name="{each}" type="2d" file="{each}.png"/>' for each in "ab")
    mesh = '<mesh name="m" file="points.obj" inertia="shell"/>'
    path.write_text(document("".join([*textures, mesh])), encoding="utf-8")
    assert load_model(path).model.ntex == 2


@pytest.mark.parametrize("name", model_names())
def test_our_own_models_are_not_tried_out(name, monkeypatch):
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(sys, "executable", os.devnull)
    assert load_model(name, {"gravity": 3}).model.opt.gravity[2] == -3


def test_a_document_is_tried_out_once(monkeypatch):
    text = document(more='<size nuserdata="3"/>')
    first = compile_document(read_whole(text, "it", models_folder()), "it")
    monkeypatch.setattr(sys, "executable", os.devnull)
    again = compile_document(read_whole(text, "it", models_folder()), "it")
    assert same_model(again, first)
    with pytest.raises(ModelError, match="other cannot be tried out"):
        compile_document(read_whole(text + " ", "other", models_folder()), "other")
