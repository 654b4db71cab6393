"""`mjcartpole page`."""

import dataclasses
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from mjcartpole.commands.options import Command, Included, OutputPath, Policies, UsageError
from mjcartpole.files import check_free, check_writable, write_whole
from mjcartpole.studies.eval_target import EvalTarget

_MOST: Final = 6_000_000
"""Bytes of a page with films."""

if TYPE_CHECKING:
    from mjcartpole.studies.policy_setup import PolicySetup


@dataclass(frozen=True)
class Page(Command):
    """Write one HTML file that opens offline: MuJoCo with a run's model and table, to play with."""

    sources: Policies = ()
    """Run folders or policy files; of several, the page has a switch and a table. Of many --seeds
    in one folder, the median seed is taken."""
    target: Included[EvalTarget] = field(default_factory=EvalTarget)
    output: OutputPath = None
    """The file, .html; <name>.html if left out."""
    overwrite: bool = False
    """Replace what is there."""
    plots: bool = True
    """Draw the learning curve, the table, the basin and the endings, which takes some seconds."""

    def run(self) -> int:
        """Play an episode of each, and write the page; all is checked before anything is played."""
        from mjcartpole.commands.policies import set_up_all, shown
        from mjcartpole.media.plots import MISSING_LIBRARY, is_installed
        from mjcartpole.page.document import check_built, page_html
        from mjcartpole.page.run_data import check_shown

        if not self.sources:
            raise UsageError("page needs a RUN-OR-POLICY, or several; see mjcartpole page --help")
        if asked := self.target.additions:
            flag = next(iter(asked)).replace("_", "-")
            raise UsageError(
                f"a page plays without disturbances; leave out --{flag}, or film them: "
                "mjcartpole render"
            )
        check_built()
        plots = self.plots and is_installed()
        if self.plots and not plots:
            print(f"mjcartpole: no plots: {MISSING_LIBRARY}", file=sys.stderr)
        sources = [shown(source) for source in self.sources]
        setups = set_up_all(sources, self.target)
        for setup in setups:
            check_shown(setup)
        path = self.output or Path(f"{setups[0].name}.html")
        self._check(path)
        pairs = zip(sources, setups, strict=True)
        runs = [_data(source, setup, plots) for source, setup in pairs]
        text = page_html(runs)
        if len(text) > _MOST and any(run["film"] for run in runs):
            print("page: the films are left out, with which it would be larger than 6 MB")
            text = page_html([{**run, "film": None} for run in runs])
        write_whole(path, text)
        megabytes = len(text.encode()) / 1e6
        print(f"page  {path}  ({megabytes:.2f} MB; it opens offline, by a double click)")
        return 0

    def _check(self, path: Path) -> None:
        if path.suffix.lower() not in {".html", ".htm"}:
            raise UsageError(f"a page is an .html, not '{path}'")
        if not self.overwrite:
            check_free([path])
        check_writable(path.parent)


def _data(source: Path, setup: "PolicySetup", plots: bool) -> dict[str, Any]:
    """Return the page's data of a run or a policy; gymnasium's is played on the reference model."""
    from mjcartpole.commands.own_films import own_film
    from mjcartpole.files import is_file
    from mjcartpole.learning.documents import read_summary
    from mjcartpole.page.run_data import run_data
    from mjcartpole.page.told import Told, told_of

    told, backend = Told(), setup.backend
    if not is_file(source):
        film = own_film(source, read_summary(source))
        told = told_of(source, film if film and is_file(film) else None, plots=plots)
    if backend == "gym":
        setup = dataclasses.replace(setup, backend="mujoco", model="cartpole", integrator="gym")
    return run_data(setup, told, backend)
