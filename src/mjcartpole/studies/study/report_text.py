"""A report as Markdown and as LaTeX."""

import re
from collections.abc import Sequence
from typing import Final

from mjcartpole.studies.study.report import Section, Table

_LATEX: Final = {
    "\\": r"\textbackslash{}",
    **{sign: f"\\{sign}" for sign in "&%$#_{}"},
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
}


def markdown(name: str, head: str, sections: Sequence[Section], plot: str = "") -> str:
    """Return a report as Markdown: a study's name, what is said of all of it, a measure each.

    The plot is the name of its file beside it; empty if there is none.
    """
    parts = [f"# {_plain(name)}", _plain(head)]
    parts += [f"![]({plot})"] if plot else []
    for section in sections:
        parts += [f"## {section.measure}", _plain(section.sentence)]
        parts += [part for table in section.tables for part in _markdown_table(table)]
    return "\n\n".join(parts) + "\n"


def _markdown_table(table: Table) -> list[str]:
    lines = [table.columns, ["---"] * len(table.columns), *table.rows]
    text = "\n".join("| " + " | ".join(map(_plain, line)) + " |" for line in lines)
    return [f"### {_plain(table.title)}", text, *([table.note] if table.note else [])]


def _plain(text: str) -> str:
    return re.sub(r"([|\\`*<>\[\]])", r"\\\1", text)


def latex(name: str, sections: Sequence[Section]) -> str:
    """Return a report's tables as LaTeX, for the packages booktabs and the like."""
    tables = [
        _latex_table(f"{name}, {section.measure}: {table.title}", table)
        for section in sections
        for table in section.tables
    ]
    return "% needs \\usepackage{booktabs}\n" + "\n".join(tables)


def _latex_table(caption: str, table: Table) -> str:
    lines = [_latex_row(row) for row in table.rows]
    note = f" {_escaped(table.note)}" if table.note else ""
    return "\n".join(
        [
            r"\begin{table}",
            r"\centering",
            rf"\caption{{{_escaped(caption)}.{note}}}",
            rf"\begin{{tabular}}{{l{'r' * (len(table.columns) - 1)}}}",
            r"\toprule",
            _latex_row(table.columns),
            r"\midrule",
            *lines,
            r"\bottomrule",
            r"\end{tabular}",
            r"\end{table}",
            "",
        ]
    )


def _latex_row(cells: Sequence[str]) -> str:
    return " & ".join(map(_escaped, cells)) + r" \\"


def _escaped(text: str) -> str:
    return "".join(_LATEX.get(sign, sign) for sign in text)
