"""The schema is MuJoCo's own."""

from pathlib import Path

import pytest

from mjcartpole.physics.edit.document import Document
from mjcartpole.physics.edit.schema import attributes_of, did_you_mean, node_at, tags
from mjcartpole.physics.load import models_folder


def test_elements_and_attributes_are_those_of_mjcf():
    assert {"option", "body", "worldbody", "motor", "inertial", "replicate"} <= set(tags())
    assert "(world)body" not in tags()
    assert "damping" in attributes_of("joint")
    assert attributes_of("inertial")[:3] == ["axisangle", "diaginertia", "euler"]
    assert attributes_of("nothing") == []


def test_an_element_is_known_where_it_stands():
    in_body = node_at(["worldbody", "body", "frame", "body", "joint"]).attributes
    assert "damping" in in_body
    assert "polycoef" not in in_body
    assert "polycoef" in node_at(["equality", "joint"]).attributes
    assert node_at(["default", "default", "default", "geom"]).single
    assert node_at(["option", "joint"]) is None


@pytest.mark.parametrize("path", sorted(models_folder().glob("*.xml")), ids=lambda path: path.stem)
def test_every_shipped_model_is_within_the_schema(path: Path):
    def check(element, above):
        for child in element.children:
            where = [*above, child.tag]
            assert set(child.attributes) <= node_at(where).attributes, where
            check(child, where)

    check(Document(path.read_text(encoding="utf-8")).root, [])


def test_the_nearest_words_are_named():
    assert did_you_mean("dampng", ["damping", "armature"]) == "did you mean 'damping'?"
    assert did_you_mean("x", ["damping", "armature"]) == "available: armature, damping"
    assert did_you_mean("x", []) == "available: nothing"
