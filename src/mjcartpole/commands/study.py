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

    baseline: tuple[str, ...] = ()
    """report: levels that others are held against, such as alpha=0.1; those of the file, or the
    first of each factor, if left out."""

    def run(self) -> int:
        """Run a study, or report on one."""
        from mjcartpole.commands import study_report, study_run

        if self.words[:1] == (Path(_REPORT),):
            return study_report.report(self._folder(), self.baseline)
        if len(self.words) != 1:
            raise UsageError("give one study: mjcartpole study FILE.toml")
        if self.baseline:
            raise UsageError("--baseline is for `study report`; a file has baseline in [study]")
        if self.how.resume and self.how.overwrite:
            raise ConfigError("--resume goes on with what is there, and --overwrite removes it")
        if self.how.scheduler and self.how.workers is not None:
            raise ConfigError("--workers is for this machine; a scheduler has its own")
        file = self.words[0]
        return study_run.run(file, self.how.run_dir or STUDIES / file.stem, self.how)

    def _folder(self) -> Path:
        """Return the folder that is to be reported on."""
        if len(self.words) != 2 or self.how != StudyOptions():
            raise UsageError("give one folder, and nothing but --baseline: study report DIR")
        return self.words[1]
