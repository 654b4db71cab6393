"""`mjcartpole doctor`."""

import json
from dataclasses import dataclass

from mjcartpole.commands.options import Command


@dataclass(frozen=True)
class Doctor(Command):
    """Say what was found here: versions, OpenGL, encoders, and what to install."""

    json: bool = False
    """Print JSON."""

    def run(self) -> int:
        """Print the report."""
        from mjcartpole.media.doctor import examine

        report = examine()
        print(json.dumps(report.as_dict(), indent=2) if self.json else report.text())
        return 0
