"""Wheels and source archives bring along what web/ is built to, where Node.js can build it.

An editable install needs none of it: `make page` builds it there. And what an index shows of the
project leads back to where it was built from, where that is said: MJCARTPOLE_SOURCE_URL.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

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


class Readme(MetadataHookInterface):
    """Gives README and addresses to an index, which has neither pictures nor other pages."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Set both; without an address there are none, and links stay as they are."""
        text = Path(self.root, "README.md").read_text(encoding="utf-8")
        if source := os.environ.get("MJCARTPOLE_SOURCE_URL"):
            tag = f"v{metadata['version']}"
            text = absolute(text, source, tag)
            metadata["urls"] = {
                "Source": source,
                "Documentation": f"{source}/blob/{tag}/docs/index.md",
                "Changelog": f"{source}/blob/{tag}/CHANGELOG.md",
                "Issues": f"{source}/issues",
            }
        metadata["readme"] = {"content-type": "text/markdown", "text": text}


def absolute(text: str, source: str, tag: str) -> str:
    """Return Markdown whose relative links and pictures are those of a tag in a repository."""
    text = re.sub(r"(?<=src=\")(?!\w+:)", f"{source}/raw/{tag}/", text)
    return re.sub(r"(?<=\]\()(?!\w+:|#)", f"{source}/blob/{tag}/", text)
