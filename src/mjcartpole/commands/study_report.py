"""What a study says: written, and its sentences printed."""

from collections.abc import Sequence
from pathlib import Path

from mjcartpole.commands.printing import counted
from mjcartpole.files import write_whole
from mjcartpole.learning.folders import locked_folder
from mjcartpole.media import plots
from mjcartpole.page.report import report_html
from mjcartpole.studies.study.folder import REPORTS
from mjcartpole.studies.study.plan import in_words
from mjcartpole.studies.study.report import sections
from mjcartpole.studies.study.report_plot import ReportPlot
from mjcartpole.studies.study.report_text import latex, markdown
from mjcartpole.studies.study.results import Results, read_results
from mjcartpole.studies.study.settings import PRESET, USUAL_PRESET


def report(folder: Path, baseline: Sequence[str]) -> int:
    """Write a report of a study into its folder. Returns the exit code.

    Raises:
        RunError: The folder is no study, or is damaged.
        ConfigError: The base line is no level.
        FileError: The folder cannot be written.
    """
    results = read_results(folder)
    against = results.baseline(baseline)
    found = sections(results, against)
    in_markdown, in_latex, page, plot = (folder / name for name in REPORTS)
    name, head = folder.resolve().name, _head(results)
    figure = ReportPlot(results).figure() if plots.is_installed() else None
    with locked_folder(folder):
        write_whole(in_markdown, markdown(name, head, found, plot.name if figure else ""))
        write_whole(in_latex, latex(name, found))
        write_whole(page, report_html(name, head, found, plots.svg_of(figure) if figure else ""))
        if figure:
            plots.write_plot(figure, plot)
    print(*(section.sentence for section in found), sep="\n")
    print(f"\nreport {in_markdown}\npage   {page}\nlatex  {in_latex}")
    if figure:
        print(f"plot   {plot}")
    return 0


def _head(results: Results) -> str:
    usual = {PRESET: USUAL_PRESET, **results.study.base}
    differs = [factor.name for factor in results.study.factors]
    base = in_words({name: value for name, value in usual.items() if name not in differs})
    failed = f"; {results.failed:,} more failed, and are left out" if results.failed else ""
    left = results.left
    failed += f"; {left:,} more are not done yet" if left > 0 else ""
    return (
        f"{counted(len(results.seeds), 'run')}{f' of {base}' if base else ''}{failed}. Intervals "
        "are 95 % bootstrap intervals; IQM is the interquartile mean."
    )
