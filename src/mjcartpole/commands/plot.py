"""`mjcartpole plot`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import tyro

from mjcartpole.commands.options import Command, OutputPath, UsageError
from mjcartpole.commands.printing import counted
from mjcartpole.errors import ConfigError, RenderError
from mjcartpole.files import check_free, check_writable, csv_text, free_path, write_whole
from mjcartpole.packages import check_installed

PLOTS: Final = Path("plots")
"""Where plots go, unless told otherwise."""
DATA: Final = ".csv"
_SHOWN: Final = ("dims", "over", "at")
FLAGS: Final = {
    "curve": ("window", "average"),
    "table": _SHOWN,
    "basin": ("dims", "at", "points"),
    "phase": ("dims", "at", "episodes"),
    "endings": ("episodes",),
}
"""Which flags each kind of plot takes."""


@dataclass(frozen=True)
class Plot(Command):
    """Draw runs: how they learned, what the table says, how long it lasts, how episodes end."""

    kind: Annotated[Literal["curve", "table", "basin", "phase", "endings"], tyro.conf.Positional]
    """curve: return by episode. table: action, advantage and visits. basin: from which
    starts it lasts. phase: episodes in the phase plane. endings: how episodes ended."""
    sources: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN …")] = ()
    """Run folders, several for curve and endings: those that differ by --seed alone, and many
    --seeds in one folder, are one line with a band. Others take one, or a policy file; of many
    --seeds the median."""
    output: OutputPath = None
    """A .png, .svg or .pdf; plots/<run>-<kind>.png if left out, with a number where that is there
    already."""
    data: Path | None = None
    """Write exactly what is drawn into this .csv as well."""
    overwrite: bool = False
    """Replace what is there."""
    window: int | None = None
    """curve: episodes of the running mean; a fortieth of the longest run if left out."""
    average: Literal["mean", "iqm"] | None = None
    """curve: what seeds are drawn as, beside its 95 % interval: mean, or interquartile mean."""
    dims: tuple[str, ...] = ()
    """table, basin, phase: the horizontal and the vertical dimension; theta,theta_dot
    if left out."""
    over: str | None = None
    """table: the dimension that differs from slice to slice, or none; x_dot if left out."""
    at: tuple[str, ...] = ()
    """table, basin, phase: where others are held, such as x=1 x_dot=0.5; 0 if left out."""
    points: int | None = None
    """basin: starts along each dimension; 61 if left out."""
    episodes: int | None = None
    """phase, endings: greedy episodes; 3 and 100 if left out."""

    def run(self) -> int:
        """Draw; all is checked before anything is read or played."""
        from mjcartpole.commands.policies import shown
        from mjcartpole.media.plots import write_plot
        from mjcartpole.physics.simulation import silence_mujoco
        from mjcartpole.studies.run_plots import OF_ONE, numbers

        silence_mujoco()
        check_installed("a plot", "matplotlib", RenderError)
        options, path = self._options(), self._checked_path()
        one = self.kind in OF_ONE
        plot = numbers(
            self.kind, [shown(each) if one else each for each in self.sources], **options
        )
        write_plot(plot.figure(), path)
        if self.data is not None:
            write_whole(self.data, csv_text(list(plot.rows())))
        print(f"plot   {path}" + (f"\ndata   {self.data}" if self.data else ""))
        return 0

    def _options(self) -> dict[str, Any]:
        """Return what was asked for of this kind of plot; refuse what is for others."""
        asked = {name: value for name in _ALL if (value := getattr(self, name)) not in {None, ()}}
        for name in asked:
            if name not in FLAGS[self.kind]:
                kinds = " and ".join(kind for kind, flags in FLAGS.items() if name in flags)
                raise UsageError(f"--{name} is for plot {kinds}, not for plot {self.kind}")
        if not self.sources:
            raise UsageError(f"plot {self.kind} needs a RUN; see mjcartpole plot --help")
        held = dict(map(_held, self.at))
        if len(held) < len(self.at):
            raise UsageError("--at holds a dimension at one value; give each once")
        return asked | ({"at": held} if held else {})

    def _checked_path(self) -> Path:
        """Return where the plot goes, if it and its data may be written."""
        from mjcartpole.media.plots import check_suffix

        path = self.output or self._usual_path()
        check_suffix(path)
        if self.data is not None and self.data.suffix.lower() != DATA:
            raise UsageError(f"the data of a plot is a {DATA}, not '{self.data}'")
        if not self.overwrite:
            check_free([path, *([self.data] if self.data else [])])
        for file in (path, self.data or path):
            check_writable(file.parent)
        return path

    def _usual_path(self) -> Path:
        from mjcartpole.learning.naming import shortened
        from mjcartpole.learning.runs import POLICY

        first, *others = self.sources
        named = first.resolve().parent if first.name == POLICY else first.resolve()
        more = f"-and-{counted(len(others), 'other')}".replace(" ", "-") if others else ""
        path = PLOTS / f"{shortened(named.name, 200)}{more}-{self.kind}.png"
        return path if self.overwrite else free_path(path)


_ALL: Final = tuple(dict.fromkeys(name for flags in FLAGS.values() for name in flags))


def _held(words: str) -> tuple[str, float]:
    """Return name and value of a dimension that is held."""
    name, _, value = words.partition("=")
    try:
        return name, float(value)
    except ValueError:
        raise ConfigError(f"--at {words!r} makes no sense; give NAME=VALUE, such as x=1") from None
