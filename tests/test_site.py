"""The site is built from the docs without a warning, and every link in it leads somewhere."""

import re
import subprocess
import sys
from html import unescape
from pathlib import Path
from urllib.parse import unquote

import pytest

import mjcartpole
from mjcartpole.commands.registry import COMMANDS, name_of
from mjcartpole.page.document import ASSETS
from mjcartpole.physics.load import model_names

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    for name in ("sphinx", "furo", "myst_nb", "sphinx_copybutton"):
        pytest.importorskip(name, reason="comes with the extra `docs`")
    folder = tmp_path_factory.mktemp("site")
    made = re.search(r"^STRICT = (.*) --doctree-dir", (ROOT / "Makefile").read_text(), re.M)[1]
    command = [sys.executable, "-m", "sphinx", *made.split(), "-d", folder / "trees", "-b", "html"]
    done = subprocess.run(
        [*command, ROOT / "docs", folder / "html"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return folder / "html"


def text(path):
    return path.read_text(encoding="utf-8")


@pytest.mark.slow
def test_every_link_leads_to_something_that_is_there(site):
    pages = [page for page in site.rglob("*.html") if page.name != "live.html"]
    assert len(pages) > 20
    named = {page: set(re.findall(r'\bid="([^"]+)"', text(page))) for page in pages}
    lost = []
    for page in pages:
        for link in re.findall(r'\b(?:href|src)="([^"]+)"', text(page)):
            path, _, anchor = unquote(unescape(link)).partition("#")
            if re.match(r"[a-z]+:|//", path):
                continue
            target = (page.parent / path.partition("?")[0]).resolve() if path else page
            known = named.get(target, {anchor})
            if not target.exists() or (anchor and anchor not in known):
                lost.append((page.name, link))
    assert lost == []


@pytest.mark.slow
def test_commands_public_names_and_models_are_all_told_of(site):
    made = site / "generated"
    for page, names in {
        "cli": map(name_of, COMMANDS),
        "gallery": model_names(),
        "api": (name.lower().replace("_", "-") for name in mjcartpole.__all__),
    }.items():
        sections = set(re.findall(r'<section id="([^"]+)"', text(made / f"{page}.html")))
        assert sorted(set(names) - sections) == []
    flags = text(made / "cli.html")
    assert "--max-episode-steps" in flags and "╭" not in flags
    assert ("<iframe" in text(made / "live.html")) == (ASSETS / "page.js").is_file()
