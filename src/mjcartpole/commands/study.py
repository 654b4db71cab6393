"""`mjcartpole study`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Final

import tyro

from mjcartpole.commands.options import Command, Included, UsageError
from mjcartpole.commands.study_options import StudyOptions
from mjcartpole.errors import ConfigError

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
    how: Included[StudyOptions] = field(default_factory=StudyOptions)

    def run(self) -> int:
        """Run a study, or report on one."""
        from mjcartpole.commands import study_run

        if not self.words or str(self.words[0]) == _REPORT or len(self.words) > 1:
            raise UsageError("give one study: mjcartpole study FILE.toml")
        file = self.words[0]
        if self.how.resume and self.how.overwrite:
            raise ConfigError("--resume goes on with what is there, and --overwrite removes it")
        if self.how.scheduler and self.how.workers is not None:
            raise ConfigError("--workers is for this machine; a scheduler has its own")
        folder = self.how.run_dir or STUDIES / file.stem
        return study_run.run(file, folder, self.how)
