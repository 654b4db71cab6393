"""A study's report as one HTML file, which opens offline and loads nothing."""

import html
from collections.abc import Sequence
from typing import Final

from mjcartpole.page.document import digest, shell
from mjcartpole.page.run_data import in_base64
from mjcartpole.studies.study.report import Section, Table

_STYLE: Final = """
body { max-width: 60rem; margin: 2rem auto; padding: 0 1rem; font: 1rem/1.5 system-ui, sans-serif; }
img { max-width: 100%; background: #fcfcfd; }
.table { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.9rem; font-variant-numeric: tabular-nums; }
th, td { padding: 0.2rem 0.8rem; border-bottom: 1px solid #8888; text-align: right; }
th:first-child { text-align: left; }
"""

_POLICY: Final = (
    "default-src 'none'; style-src '{style}'; img-src data:; base-uri 'none'; form-action 'none'"
)


def report_html(name: str, head: str, sections: Sequence[Section], svg: str = "") -> str:
    """Return a report as a page; of all that it shows nothing is taken for HTML.

    It has the study's name, what is said of all of it, a measure each, and a plot if there is one.
    """
    parts = [_element("h1", name), _element("p", head)]
    if svg:
        alt = "Averages and performance profiles by level, as the tables below have them"
        parts.append(f'<img alt="{alt}" src="data:image/svg+xml;base64,{in_base64(svg.encode())}">')
    for section in sections:
        parts += [_element("h2", section.measure), _element("p", section.sentence)]
        parts += map(_table, section.tables)
    return shell(name, _STYLE, _POLICY.format(style=digest(_STYLE.encode())), "\n".join(parts))


def _table(table: Table) -> str:
    lines = [
        "".join(
            _element("th" if header or not place else "td", cell) for place, cell in enumerate(row)
        )
        for header, row in [(True, table.columns), *((False, row) for row in table.rows)]
    ]
    rows = "\n".join(f"<tr>{line}</tr>" for line in lines)
    note = _element("p", table.note) if table.note else ""
    return (
        f'{_element("h3", table.title)}\n<div class="table"><table>\n{rows}\n</table></div>{note}'
    )


def _element(tag: str, text: str) -> str:
    return f"<{tag}>{html.escape(text)}</{tag}>"
