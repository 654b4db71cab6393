"""The picture of the house: layers, their modules, and who imports whom, read from the sources.

`python scripts/draw_house.py` writes docs/images/house.svg; a test says when it is out of date.
"""

import ast
import itertools
import textwrap
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "mjcartpole"
PICTURE = ROOT / "docs" / "images" / "house.svg"

WIDTH, LINE, GAP, MARGIN = 680, 18, 16, 20  # pixels: a box, a line of text, between, around
TITLE, COLUMNS = 110, 68  # pixels from a box's edge to its text, and characters in a line of that
LANES = ("#2f7fd0", "#d9822b", "#2f9e6e", "#c2518f", "#8a6fd1", "#b08a1e", "#3aa3ad", "#cf5a4a")
BASE, TOP = "below all", "above all"
STYLE = """<style>
  text { font: 13px Menlo, Consolas, "DejaVu Sans Mono", monospace; fill: #1f2733 }
  .title { font-weight: bold } .out { stroke: #9aa7b8 } path { fill: none; stroke-width: 1.6 }
  .paper { fill: #ffffff } .box { fill: #eef2f8; stroke: #9aa7b8 }
  @media (prefers-color-scheme: dark) {
    text { fill: #e4e9f0 } .paper { fill: #12161c } .box { fill: #1e2631; stroke: #5b6878 }
  }
</style>"""


def units(package: Path) -> dict[str, list[Path]]:
    """Return the files of each thing directly in the package: a folder, or a module alone."""
    found: dict[str, list[Path]] = {}
    for path in sorted(package.rglob("*.py")):
        name = path.relative_to(package).parts[0].removesuffix(".py")
        if not name.startswith("__"):
            found.setdefault(name, []).append(path)
    return found


def imports(path: Path) -> Iterator[str]:
    """Yield the names of the things directly in the package that a file imports, lazily or not."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom):
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        parts = (name.split(".") for name in names)
        yield from (part[1] for part in parts if part[0] == "mjcartpole" and part[1:])


def layers(found: dict[str, list[Path]]) -> tuple[dict[str, list[str]], dict[str, set[str]]]:
    """Return the units of each layer, the lowest first, and the layers that each imports.

    Single modules that import no folder are one layer, and those that no folder imports another.
    """
    uses = {name: {one for file in files for one in imports(file)} for name, files in found.items()}
    graph = {name: sorted((uses[name] & set(found)) - {name}) for name in found}
    order = list(TopologicalSorter(graph).static_order())
    alone = {name for name in order if len(found[name]) == 1}
    home = {name: name for name in order}
    for name in order:
        if name in alone and all(home[other] == BASE for other in graph[name]):
            home[name] = BASE
    for name in reversed(order):
        users = [home[other] for other in order if name in graph[other]]
        if name in alone and home[name] != BASE and set(users) <= {TOP}:
            home[name] = TOP
    members: dict[str, list[str]] = {}
    for name in sorted(order, key=lambda name: (home[name] != BASE, home[name] == TOP)):
        members.setdefault(home[name], []).append(name)
    return members, {
        layer: {home[other] for name in names for other in graph[name]} - {layer}
        for layer, names in members.items()
    }


def lines_of(files: list[Path], top: Path) -> Iterator[str]:
    """Yield modules as lines of text; each folder below the top one begins a line."""
    for folder in sorted({path.parent for path in files}):
        label = "" if folder == top else f"{folder.name}/  "
        stems = sorted(path.stem for path in files if path.parent == folder)
        text = label + "  ".join(stem for stem in stems if stem != "__init__")
        yield from textwrap.wrap(text, COLUMNS, subsequent_indent=" " * len(label))


def box(title: str, text: list[str], y: int) -> Iterator[str]:
    """Yield a box with its title and its lines."""
    size = f'width="{WIDTH}" height="{height_of(text)}"'
    yield f'<rect class="box" x="{MARGIN}" y="{y}" {size}/>'
    yield f'<text class="title" x="{MARGIN + 12}" y="{y + 22}">{title}</text>'
    x = MARGIN + (TITLE if title else 12)
    for number, line in enumerate(text):
        yield f'<text x="{x}" y="{y + 22 + number * LINE}">{line}</text>'


def height_of(text: list[str]) -> int:
    """Return a box's height in pixels."""
    return max(len(text), 2) * LINE + 14


def lanes(
    middles: dict[str, int], arrows: dict[str, set[str]], targets: list[str]
) -> Iterator[str]:
    """Yield a line out of each box, and a coloured one into each: dots say whose imports it has."""
    edge = MARGIN + WIDTH
    places = {target: edge + 24 * number for number, target in enumerate(targets, 1)}
    for layer, y in middles.items():
        if arrows[layer]:
            end = max(places[target] for target in arrows[layer])
            yield f'<path class="out" d="M{edge} {y - 7}H{end}"/>'
    for (target, x), colour in zip(places.items(), itertools.cycle(LANES), strict=False):
        users = [y - 7 for layer, y in middles.items() if target in arrows[layer]]
        line = f"M{x} {users[0]}V{middles[target] + 7}H{edge + 2}m6 -4l-6 4l6 4"
        yield f'<path d="{line}" stroke="{colour}"/>'
        yield from (f'<circle cx="{x}" cy="{y}" r="4" fill="{colour}"/>' for y in users)


def draw(package: Path = PACKAGE) -> str:
    """Return the picture as SVG, the highest layer first."""
    found = units(package)
    members, arrows = layers(found)
    shapes, middles, y = [STYLE, '<rect class="paper" width="100%" height="100%"/>'], {}, MARGIN
    for layer in reversed(members):
        files = [path for name in members[layer] for path in found[name]]
        text = list(lines_of(files, package if layer in {BASE, TOP} else package / layer))
        shapes += box(f"{layer}/" if layer in found else "", text, y)
        middles[layer] = y + height_of(text) // 2
        y += height_of(text) + GAP
    targets = [layer for layer in middles if any(layer in to for to in arrows.values())]
    shapes += lanes(middles, arrows, targets)
    size = f'width="{WIDTH + 24 * len(targets) + 3 * MARGIN}" height="{y - GAP + MARGIN}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" xml:space="preserve" {size}>'
    return "\n".join([head, *shapes, "</svg>\n"])


if __name__ == "__main__":
    PICTURE.write_text(draw(), encoding="utf-8", newline="\n")
