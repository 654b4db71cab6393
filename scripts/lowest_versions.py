"""The lowest versions that pyproject.toml declares, each exactly, as constraints for pip.

`python scripts/lowest_versions.py` writes constraints/lowest.txt; a test says when it is out of
date.
"""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TARGET = ROOT / "constraints" / "lowest.txt"
HEAD = """\
# The lowest version of each declared dependency; what those need in turn is the newest that fits.
# Made by: python scripts/lowest_versions.py (`make constraints` runs it)
"""


def lowest(project: Path = ROOT / "pyproject.toml") -> str:
    """Return one line `name==version` for each requirement with a lower bound.

    Raises:
        ValueError: A requirement has none.
    """
    declared = tomllib.loads(project.read_text(encoding="utf-8"))["project"]
    extras = declared["optional-dependencies"].values()
    lines = {}
    for requirement in (*declared["dependencies"], *(one for extra in extras for one in extra)):
        found = re.match(r"([\w.-]+)(\[[\w,]+\])?>=([\w.]+)[^;]*(;.*)?$", requirement)
        if found is None:
            raise ValueError(f"{requirement!r} declares no lowest version, as in 'name>=1.2'")
        name, _, version, marker = found.groups()
        lines[name.lower()] = f"{name}=={version}{marker or ''}\n"
    return HEAD + "".join(lines[name] for name in sorted(lines))


if __name__ == "__main__":
    TARGET.write_text(lowest(), encoding="utf-8", newline="\n")
