"""`mjcartpole page`."""

import dataclasses
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mjcartpole.commands.options import (
    Command,
    Included,
    OutputPath,
    Policies,
    UsageError,
)
from mjcartpole.files import check_free, check_writable, write_whole
from mjcartpole.studies.eval_target import EvalTarget

if TYPE_CHECKING:
    from mjcartpole.page.run_data import Told
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

    def run(self) -> int:
        """Play an episode of each, and write the page; all is checked before anything is played."""
        from mjcartpole.commands.policies import set_up, shown
        from mjcartpole.page.document import check_built, page_html

        if not self.sources:
            raise UsageError("page needs a RUN-OR-POLICY, or several; see mjcartpole page --help")
        check_built()
        sources = [shown(source) for source in self.sources]
        setups = [set_up(source, self.target) for source in sources]
        path = self.output or Path(f"{setups[0].name}.html")
        self._check(path)
        runs = [_data(*pair) for pair in zip(sources, setups, strict=True)]
        text = page_html(runs)
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


def _data(source: Path, setup: "PolicySetup") -> dict[str, Any]:
    """Return the page's data of a run or a policy; gymnasium's is played on the reference model."""
    from mjcartpole.page.run_data import run_data

    backend, told = setup.backend, _told(source)
    if backend == "gym":
        setup = dataclasses.replace(setup, backend="mujoco", model="cartpole", integrator="gym")
    return run_data(setup, told, backend)


def _told(source: Path) -> "Told":
    """Return what is told of a run; of a policy's file there is nothing."""
    from mjcartpole.commands.films import own_film
    from mjcartpole.files import is_file
    from mjcartpole.learning import runs
    from mjcartpole.learning.documents import read_summary
    from mjcartpole.learning.stored import read_document
    from mjcartpole.page.run_data import Told

    if is_file(source):
        return Told()
    run, summary = runs.load_run(source), read_summary(source)
    film = own_film(source, summary)
    config = {"preset": run.preset, **run.config.values()}
    versions = read_document(source / runs.VERSIONS, None, dict, "cannot be read")
    return Told(_facts(summary), config, versions, (), film if film and is_file(film) else None)


def _facts(summary: dict[str, Any]) -> dict[str, Any]:
    """Return what a run came to, in a person's words."""
    facts = {"Episodes": summary["episodes"], "Steps of training": summary["steps"]}
    if played := summary.get("evaluation"):
        facts["Greedy episodes"] = played["episodes"]
        facts["Mean greedy return"], facts["Least"] = played["mean"], played["minimum"]
        facts |= {f"Ended by: {how}": count for how, count in played["endings"].items() if count}
    if solved := summary.get("solved"):
        facts["Solved after"] = f"{solved['episodes']} episodes"
    return facts
