"""`mjcartpole study`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import tyro

from mjcartpole.commands.options import Command, UsageError
from mjcartpole.errors import ConfigError
from mjcartpole.learning.engine import Engine

STUDIES: Final = Path("studies")
"""Where studies go, unless told otherwise."""
_REPORT: Final = "report"


@dataclass(frozen=True)
class Study(Command):
    """Train every point of a study's file with many seeds, or report on what was found."""

    words: Annotated[
        tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="FILE.toml|report DIR")
    ] = ()
    """The file that says what is to be trained and measured; or the word report, and a folder."""
    run_dir: Path | None = None
    """Folder for the study; studies/<the file's name> if left out."""
    resume: bool = False
    """Go on with the study in that folder: only what the file asks and is not there is done."""
    overwrite: bool = False
    """Replace the study in that folder."""
    dry_run: bool = False
    """Say how many points, runs and steps it is, and how long it may take; nothing is kept."""
    workers: int | None = None
    """How many runs at once; as many as there are cores if left out."""
    engine: Engine = "compiled"
    """Who runs the loop; both give the same bits."""

    def run(self) -> int:
        """Run a study, or report on one."""
        from mjcartpole.commands import study_run

        if not self.words or str(self.words[0]) == _REPORT or len(self.words) > 1:
            raise UsageError("give one study: mjcartpole study FILE.toml")
        file = self.words[0]
        if self.resume and self.overwrite:
            raise ConfigError("--resume goes on with what is there, and --overwrite removes it")
        folder = self.run_dir or STUDIES / file.stem
        return study_run.run(file, folder, self)
