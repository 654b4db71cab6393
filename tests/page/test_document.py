"""The HTML file: what it may run, and that nothing of a run becomes HTML."""

import base64
import hashlib
import html.parser
import json

import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.page.document import check_built, page_html

HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"


@pytest.fixture
def assets(tmp_path):
    (tmp_path / "page.js").write_text("console.log(1 < 2)")
    (tmp_path / "style.css").write_text("p { margin: 0 }")
    (tmp_path / "mujoco.wasm.gz").write_bytes(b"\x00asm")
    return tmp_path


class Reader(html.parser.HTMLParser):
    """The elements of a page, and what is in each that is read as it is."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.text = [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.text = []
        self.elements.append((tag, dict(attrs), self.text))

    def handle_endtag(self, tag):
        self.text = []

    def handle_data(self, data):
        self.text.append(data)

    def named(self, tag, **wanted):
        return [
            "".join(text) if tag in {"script", "style", "title"} else attributes
            for each, attributes, text in self.elements
            if each == tag and wanted.items() <= attributes.items()
        ]


def test_the_page_holds_the_data_as_they_were(assets):
    runs = [{"name": HOSTILE, "document": "<mujoco/>", "facts": [[HOSTILE, HOSTILE]]}]
    (data,) = Reader(page_html(runs, assets)).named("script", id="data")
    assert json.loads(data)["runs"] == runs


def test_nothing_of_a_run_is_an_element(assets):
    harmless = Reader(page_html([{"name": "mine"}], assets))
    hostile = Reader(page_html([{"name": HOSTILE, "document": HOSTILE}], assets))
    tags = [[tag for tag, _, _ in page.elements] for page in (harmless, hostile)]
    assert tags[0] == tags[1]
    assert hostile.named("title") == [f"{HOSTILE} · mjcartpole"]


def test_the_policy_lets_this_script_and_this_style_be_and_nothing_else(assets):
    page = Reader(page_html([{"name": "mine"}], assets))
    (meta,) = page.named("meta", **{"http-equiv": "Content-Security-Policy"})
    rules = dict(rule.split(" ", 1) for rule in meta["content"].split("; "))
    script = page.named("script")[-1]
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert script == "console.log(1 < 2)"
    assert rules["script-src"] == f"'sha256-{digest}' 'wasm-unsafe-eval'"
    assert rules["default-src"] == "'none'" and "connect-src" not in rules
    assert not any(source in meta["content"] for source in ("unsafe-inline", "http", "*"))


def test_the_webassembly_is_there(assets):
    (text,) = Reader(page_html([{"name": "mine"}], assets)).named("script", id="wasm")
    assert base64.b64decode(text) == b"\x00asm"


def test_what_was_not_built_is_told_in_one_line(tmp_path):
    with pytest.raises(ConfigError, match="`make page` builds them") as refused:
        check_built(tmp_path)
    assert "\n" not in str(refused.value)
