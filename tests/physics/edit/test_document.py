"""Text is edited in place: what is not edited stays, to the last character."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjcartpole.errors import ModelSyntaxError
from mjcartpole.physics.edit.document import Document, made_strict
from nightly import characters

TEXT = """<?xml version='1.0'?>
<!-- before: <joint name="not me"/> -->
<mujoco  model = 'ä > b'>
\t<option/><worldbody
  >
    <body name='one'><frame><joint name="j"   axis='0 1 0'
        damping="1"/></frame> <!-- stays --> </body>
  </worldbody>
</mujoco>
"""


def the(document, tag):
    (found,) = [element for element in document.elements if element.tag == tag]
    return found


def test_attributes_by_the_thousand_are_refused_before_they_take_time():
    many = " ".join(f'a{i}="1"' for i in range(100_000))
    with pytest.raises(ModelSyntaxError, match="more than 1000 attributes"):
        Document(f"<mujoco><worldbody {many}/></mujoco>")


def test_elements_are_found_with_their_attributes():
    document = Document(TEXT)
    assert [each.tag for each in document.elements] == [
        "mujoco",
        "option",
        "worldbody",
        "body",
        "frame",
        "joint",
    ]
    joint = the(document, "joint")
    assert joint.attributes == {"name": "j", "axis": "0 1 0", "damping": "1"}
    assert the(document, "body").find("joint") == [joint]


def test_nothing_changes_unless_asked():
    document = Document(TEXT)
    document.set(the(document, "joint"), "damping", "1")
    assert document.text == TEXT


@pytest.mark.parametrize(
    ("tag", "name", "value", "old", "new"),
    [
        ("joint", "axis", "1 0 0", "'0 1 0'", "'1 0 0'"),
        ("joint", "ref", "2", 'damping="1"', 'damping="1" ref="2"'),
        ("mujoco", "model", "it's", "'ä > b'", "'it&apos;s'"),
        ("option", "timestep", "1", "<option", '<option timestep="1"'),
        ("worldbody", "name", "<&", "<worldbody", '<worldbody name="&lt;&amp;"'),
        ("body", "name", "zwö", "'one'", "'zwö'"),
    ],
)
def test_only_the_attribute_changes(tag, name, value, old, new):
    document = Document(TEXT)
    document.set(the(document, tag), name, value)
    assert document.text == TEXT.replace(old, new)
    assert the(Document(document.text), tag).attributes[name] == value


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["joint", "body", "mujoco", "option"]),
            st.sampled_from(["name", "axis", "user"]),
            st.text(characters(control=False)),
        )
    )
)
def test_many_edits_keep_all_places(edits):
    document, expected = Document(TEXT), {}
    for tag, name, value in edits:
        document.set(the(document, tag), name, value)
        expected[tag, name] = value
    found = Document(document.text)
    for (tag, name), value in expected.items():
        assert the(found, tag).attributes[name].replace("\n", " ") == value
    assert "<!-- stays -->" in document.text


def test_a_section_is_put_on_a_line_of_its_own():
    document = Document("<mujoco>\r\n  <worldbody/>\r\n</mujoco>")
    option = document.insert(document.root, "option")
    document.set(option, "timestep", "0.01")
    expected = '<mujoco>\r\n  <option timestep="0.01"/>\r\n  <worldbody/>\r\n</mujoco>'
    assert document.text == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("<mujoco/>", '<mujoco><size njmax="1"/></mujoco>'),
        ("<mujoco></mujoco>", '<mujoco><size njmax="1"/></mujoco>'),
        ("<mujoco><a/></mujoco>", '<mujoco><size njmax="1"/><a/></mujoco>'),
        ('<mujoco model=">"  />', '<mujoco model=">"  ><size njmax="1"/></mujoco>'),
    ],
)
def test_a_section_finds_room_anywhere(text, expected):
    document = Document(text)
    document.set(document.insert(document.root, "size"), "njmax", "1")
    assert document.text == expected


LENIENT = """<!---- ä -- <joint name="not me"/> --><mujoco><!----> <a b="1"/> <!--> ü
--\r\n <c/> --><worldbody/>
</mujoco><!-- -- -->
"""


def test_comments_as_people_write_them_stay():
    document = Document(LENIENT)
    assert [each.tag for each in document.elements] == ["mujoco", "a", "worldbody"]
    document.set(the(document, "a"), "b", "2")
    document.set(document.insert(document.root, "size"), "njmax", "1")
    document.set(the(document, "worldbody"), "name", "w")
    assert document.text == LENIENT.replace('"1"', '"2"').replace(
        "<mujoco>", '<mujoco><size njmax="1"/>'
    ).replace("<worldbody", '<worldbody name="w"')


@given(st.lists(st.sampled_from(["<!--", "-->", "--", "-", ">", "<a/>", "ä", "\n", "\r", " "])))
def test_empty_comments_keep_every_byte_in_its_place(parts):
    text = "".join(parts)
    blank = made_strict(text)
    pairs = list(zip(text.encode(), blank.encode(), strict=True))
    assert all(new in {old, ord(" ")} for old, new in pairs)
    assert made_strict(blank) == blank

    assert [each for each in blank if each in "\r\n"] == [each for each in text if each in "\r\n"]


def test_a_tag_with_spaces_before_its_name_is_edited_where_it_stands():
    """MuJoCo takes it, and people have such files."""
    text = '<mujoco>\n <  option a="1"/>\n <\n body\n b="2"/></mujoco>'
    document = Document(text)
    option, body = document.root.children
    document.set(option, "a", "10")
    document.set(body, "c", "3")
    expected = text.replace('"1"', '"10"').replace('b="2"', 'b="2" c="3"')
    assert document.text == expected


@pytest.mark.parametrize(
    "text",
    [
        "",
        "<mujoco>",
        "<mujoco><a></mujoco>",
        "<mujoco a='1' a='2'/>",
        "<mujoco/>\udc80",
        "<!DOCTYPE m [<!ENTITY e '<a/>'>]><mujoco>&e;</mujoco>",
    ],
)
def test_what_is_no_xml_is_refused_in_one_line(text):
    with pytest.raises(ModelSyntaxError) as caught:
        Document(text)
    assert "\n" not in str(caught.value)
