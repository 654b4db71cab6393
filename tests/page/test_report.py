"""A study's report as one HTML file: everything in it, nothing outside of it, nothing unescaped."""

import re
from html.parser import HTMLParser

import pytest

from mjcartpole.page.report import report_html
from mjcartpole.studies.study.report import Section, Table

EVIL = "<script>alert('&amp;')</script>"
SECTIONS = [
    Section("m", f"Best is {EVIL}.", (Table(EVIL, ("a", EVIL), ((EVIL, "1"), ("b", "2")), EVIL),)),
    Section("n", "Nothing.", (Table("t", ("a",), ()),)),
]


class Seen(HTMLParser):
    """What a browser finds: elements with their attributes, and the words of each kind."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.words, self.open = [], {}, []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in ("meta", "img"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and data.strip():
            self.words.setdefault(self.open[-1], []).append(data)


@pytest.fixture(scope="module")
def seen():
    return Seen(report_html(EVIL, EVIL, SECTIONS, "<svg/>"))


def test_all_words_are_words(seen):
    assert seen.words["h1"] == [EVIL] and seen.words["h2"] == ["m", "n"]
    assert seen.words["th"] == ["a", EVIL, EVIL, "b", "a"] and seen.words["td"] == ["1", "2"]
    assert seen.words["p"] == [EVIL, f"Best is {EVIL}.", EVIL, "Nothing."]
    assert seen.words["h3"] == [EVIL, "t"] and seen.words["title"] == [f"{EVIL} · mjcartpole"]
    assert seen.open == [] and "script" not in [tag for tag, _ in seen.elements]


def test_nothing_is_loaded_from_anywhere(seen):
    (image,) = [attributes for tag, attributes in seen.elements if tag == "img"]
    assert image["src"] == "data:image/svg+xml;base64,PHN2Zy8+"
    assert not {"href", "link"} & {name for tag, its in seen.elements for name in (tag, *its)}
    (policy,) = [its["content"] for _, its in seen.elements if "http-equiv" in its]
    assert policy.startswith("default-src 'none'; style-src 'sha256-")
    assert not re.search("url\\(|@import", seen.words["style"][0])


def test_without_a_plot_there_is_no_picture():
    assert "<img" not in report_html("a", "", SECTIONS)
