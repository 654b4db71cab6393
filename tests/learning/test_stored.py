"""JSON that somebody else wrote is taken field by field, or refused in one short line."""

import json
from typing import Literal

import pytest

from mjcartpole.errors import RunError
from mjcartpole.learning.stored import checked, parse, read_document

FIELDS = {
    "name": str,
    "on": bool,
    "count": int,
    "rate": float,
    "share": float | None,
    "kind": Literal["a", "b"],
    "sizes": tuple[int, ...],
    "inner": {"x": float},
    "more?": str,
}
GOOD = {
    "name": "long pole", "on": True, "count": 3, "rate": 2, "share": None, "kind": "a",
    "sizes": [1, 2], "inner": {"x": 0.5},
}  # fmt: skip


@pytest.mark.parametrize("more", [{}, {"more": "x"}, {"share": 0.5}, {"name": "caf\udce9.xml"}])
def test_what_has_exactly_the_fields_is_taken(more):
    assert checked({**GOOD, **more}, FIELDS) == {**GOOD, **more}


@pytest.mark.parametrize(
    "bad",
    [
        {"name": 1}, {"name": None}, {"name": "two\nlines"}, {"name": "\x1b[2J"},
        {"name": "x" * 5000}, {"on": 1}, {"on": "true"}, {"count": True}, {"count": 1.0},
        {"rate": True}, {"rate": "1"}, {"share": "x"}, {"kind": "c"}, {"kind": ["a"]},
        {"sizes": 3}, {"sizes": [1, "2"]}, {"sizes": {}}, {"inner": []}, {"inner": {}},
        {"inner": {"x": 0.5, "y": 1}}, {"more": None}, {"colour": "red"}, {"colour" * 999: 1},
    ],
)  # fmt: skip
def test_a_field_of_another_kind_is_named(bad, tmp_path):
    path = tmp_path / "file.json"
    path.write_text(json.dumps({**GOOD, **bad}))
    with pytest.raises(RunError) as refused:
        read_document(path, FIELDS, dict, "is not what it should be")
    message = str(refused.value)
    assert message.startswith(f"'{path}' is not what it should be: ")
    assert next(iter(bad))[:3] in message or "inner" in bad
    assert "\n" not in message
    assert len(message) < 500 + len(str(path))


@pytest.mark.parametrize("name", [name for name in FIELDS if name != "more?"])
def test_a_missing_field_is_named(name):
    with pytest.raises(ValueError, match=f"{name} is missing"):
        checked({key: value for key, value in GOOD.items() if key != name}, FIELDS)


@pytest.mark.parametrize("value", [None, 3, "x", [], [1, 2]])
def test_what_has_no_fields_is_refused(value):
    with pytest.raises(ValueError, match="has no named values"):
        checked(value, FIELDS)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (b"", "Expecting value"),
        (b"\xff", "utf-8"),
        (b"[" * 100_000, "nested too deep"),
        (b'{"a":' * 100_000, "nested too deep"),
        (b"1" + b"0" * 400, "more than 39 digits"),
        (b"-" + b"9" * 10_000, "more than 39 digits"),
        (b"NaN", "not finite"),
        (b"[1, -Infinity]", "not finite"),
        (b"1e999", "not finite"),
        (b'{"a": 1, "a": 1}', "two values"),
        (b"[" + b"[]," * 2**22 + b"[]]", "more than 4,194,304 values"),
    ],
    ids=lambda value: str(value)[:20],
)
def test_what_is_too_much_or_no_json_is_refused(text, why):
    with pytest.raises(ValueError, match=why):
        parse(text)


def test_the_largest_numbers_that_a_run_stores_are_taken():
    assert parse(str(2**128 - 1).encode()) == 2**128 - 1
    assert parse(b"[1.7976931348623157e308, 5e-324]") == [1.7976931348623157e308, 5e-324]
