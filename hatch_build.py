"""Wheels and source archives bring along what web/ is built to, where Node.js can build it.

An editable install needs none of it: `make page` builds it there.
"""

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

WEB = "web"
BUILT = Path("src", "mjcartpole", "page", "assets", "page.js")


class PageAssets(BuildHookInterface[Any]):
    """Builds the page's script, style and WebAssembly, once."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build them, unless they are there or nothing can; without them, `page` says so."""
        root = Path(self.root)
        if version == "editable" or (root / BUILT).is_file():
            return
        npm = shutil.which("npm")
        if npm is None or not (root / WEB).is_dir():
            self._miss("npm is not here")
            return
        for command in (["ci", "--silent"], ["run", "--silent", "build"]):
            if subprocess.run([npm, *command], cwd=root / WEB, check=False).returncode != 0:
                self._miss(f"npm {command[0]} failed")
                return

    def _miss(self, why: str) -> None:
        print(f"mjcartpole: built without `mjcartpole page`: {why}", file=sys.stderr)
