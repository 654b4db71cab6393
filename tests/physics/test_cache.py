"""Each document is compiled once, and its content decides."""

import os
import pickle

import mujoco
import pytest

from mjcartpole.physics import build, cache
from mjcartpole.physics.load import load_model, load_shared

REFERENCE = load_model("cartpole").xml


@pytest.fixture
def compiled(monkeypatch):
    """What is compiled while a test runs."""
    monkeypatch.setattr(cache, "_kept", {})
    seen, compile_it = [], build.compile_text

    def watch(text, *rest):
        seen.append(text)
        return compile_it(text, *rest)

    monkeypatch.setattr(build, "compile_text", watch)
    return seen


def test_a_document_is_compiled_once_whatever_it_is_called(tmp_path, compiled):
    path = tmp_path / "mine.xml"
    path.write_text(REFERENCE, encoding="utf-8")
    names = {load_model(source).name for source in ("cartpole", REFERENCE, path, str(path))}
    assert names == {"cartpole", "the XML document", str(path)}
    assert len(compiled) == 1


def test_a_changed_file_is_seen_by_its_content(tmp_path):
    path = tmp_path / "mine.xml"
    for gravity in ("-9.8", "-1.6"):
        path.write_text(REFERENCE.replace("-9.8", gravity), encoding="utf-8")
        os.utime(path, (0, 0))
        assert load_model(path).model.opt.gravity[2] == float(gravity)


@pytest.mark.parametrize("spaced", ["file=", "file\n = "])
def test_an_included_file_is_content_too(tmp_path, spaced):
    path, part = tmp_path / "mine.xml", tmp_path / "part.xml"
    include = f'<include {spaced}"part.xml"/></mujoco>'
    path.write_text(REFERENCE.replace("</mujoco>", include), encoding="utf-8")
    for gravity in (-3.0, -2.0):
        part.write_text(f'<mujoco><option gravity="0 0 {gravity}"/></mujoco>', encoding="utf-8")
        assert load_model(path).model.opt.gravity[2] == gravity


def test_nobody_shares_what_may_be_changed():
    first = load_model("cartpole")
    first.model.opt.gravity[2] = 1.0
    assert load_model("cartpole").model.opt.gravity[2] == -9.8
    assert load_shared("cartpole").model is load_shared("cartpole").model
    assert pickle.loads(pickle.dumps(first)).model.opt.gravity[2] == 1.0


def test_memory_is_bounded(compiled):
    for number in range(cache.MOST + 5):
        load_model(REFERENCE.replace("9.8", f"9.{number}"))
    assert len(cache._kept) == cache.MOST
    before = len(compiled)
    picture = '<asset><texture name="t" type="2d" builtin="flat" width="1024" height="1024"/>'
    large = REFERENCE.replace("<asset>", picture, 1)
    for _ in range(2):
        assert load_model(large).model.ntex == 1
    assert len(compiled) == before + 2


def test_what_is_asked_for_again_and_again_is_kept(compiled):
    base = load_shared(REFERENCE)
    for number in range(2 * cache.MOST):
        load_shared(REFERENCE.replace("9.8", f"9.{number}1"))
        assert load_shared(REFERENCE).model is base.model


def test_what_fails_fails_each_time_by_its_own_name(tmp_path):
    for name in ("a.xml", "b.xml"):
        path = tmp_path / name
        path.write_text(REFERENCE.replace('type="slide"', 'type="ball"'), encoding="utf-8")
        with pytest.raises(ValueError, match=name):
            load_model(path)


def test_a_spec_is_written_with_all_digits():
    spec = mujoco.MjSpec.from_string(REFERENCE)
    assert "0.0083333333333333" in load_model(spec).xml
    # MuJoCo's own number of digits is as it was.
    assert 'diaginertia="0.00833333 0.00833333' in spec.to_xml()
