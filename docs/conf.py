"""How Sphinx builds the site: `make docs`, into build/site."""

import logging
import os
import posixpath
import re
import sys
from pathlib import Path

from sphinx.application import Sphinx

import mjcartpole

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "scripts"))
logging.getLogger("absl").setLevel(logging.WARNING)  # dm_control's reports of its import

import site_pages  # noqa: E402

site_pages.make()  # before the settings, which look for what it writes

project, author = "mjcartpole", "The mjcartpole authors"
version = release = mjcartpole.__version__
copyright = author
extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
]
exclude_patterns = ["generated/runs"]
html_theme, html_title = "furo", f"mjcartpole {release}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_extra_path = [path for path in ("generated/live.html",) if (ROOT / "docs" / path).is_file()]

myst_enable_extensions = ["deflist", "dollarmath", "html_image"]
myst_heading_anchors = 4
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_in_temp = True
nb_execution_timeout = 600
copybutton_exclude = ".linenos, .gp, .go"

suppress_warnings = ["misc.highlighting_failure"]  # quotes are cut, by "…"

default_role = "code"  # a name in a docstring is code
nitpicky = True
nitpick_ignore_regex = [("py:.*", r".*")]
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
autodoc_typehints_format = "short"
toc_object_entries_show_parents = "hide"
smartquotes_action = "qe"  # dashes stay: they begin flags
autodoc_member_order = "bysource"
python_maximum_signature_line_length = 80
napoleon_use_ivar = True

# Links to files that are no pages: to the sources, where it is known where those are.
SOURCE_URL = os.environ.get("MJCARTPOLE_SOURCE_URL", "")
PAGES_ABOVE = {
    f"{name}.md": f"generated/{name.lower()}.md"
    for name in ("CHANGELOG", "CONTRIBUTING", "SECURITY")
}
# And words for pages that are on the site only.
ON_SITE = {
    "Try it here": "live",
    "Gallery": "gallery",
    "Commands": "cli",
    "The public names": "api",
    "Modules": "modules",
}


def link_outwards(app: Sphinx, page: str, source: list[str]) -> None:
    """Turn links to what lies above docs/ into links to pages, to sources, or into words."""

    def turned(match: re.Match[str]) -> str:
        text, target, anchor = match.groups()
        path = posixpath.normpath(posixpath.join(folder, target))
        if not path.startswith("../"):
            return match[0]
        above = path.removeprefix("../")
        if above in PAGES_ABOVE:
            return f"[{text}]({posixpath.relpath(PAGES_ABOVE[above], folder or '.')}{anchor or ''})"
        return f"[{text}]({SOURCE_URL}/blob/main/{above})" if SOURCE_URL else text

    folder = posixpath.dirname(page)
    for words, name in ON_SITE.items():
        source[0] = source[0].replace(f"*{words}*", f"[{words}](/generated/{name}.md)")
    source[0] = re.sub(r"(?<!!)\[(?!!)([^\]]+)\]\((?!\w+:|#)([^)#]+)(#[^)]*)?\)", turned, source[0])


def read_markdown(
    app: Sphinx, what: str, name: str, of: object, _: object, lines: list[str]
) -> None:
    """Turn headings and tables of a docstring, as gymnasium's have them, into what Sphinx reads."""
    found = "\n".join(lines).replace("*bins", r"\*bins")  # a shape, no emphasis
    found = re.sub(r"^#+ (.*)$", r".. rubric:: \1\n", found, flags=re.MULTILINE)
    lines[:] = re.sub(r"(?:^\|.*\|\n?)+", _table, found, flags=re.MULTILINE).split("\n")


def _table(match: re.Match[str]) -> str:
    rows = [row.strip("|").split("|") for row in match[0].splitlines() if set(row) - set("|- ")]
    cells = ("\n     - ".join(cell.strip() for cell in row) for row in rows)
    body = "\n".join(f"   * - {row}" for row in cells)
    return f".. list-table::\n   :header-rows: 1\n\n{body}\n"


def setup(app: Sphinx) -> None:
    """Hang in what reads pages and docstrings."""
    app.connect("source-read", link_outwards)
    app.connect("autodoc-process-docstring", read_markdown)
