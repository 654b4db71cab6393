"""Pages of the site that are made, not written.

`docs/conf.py` calls `make` before the site is built; what it writes, into docs/generated, is in no
repository.
"""

import contextlib
import io
import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image

import mjcartpole
from mjcartpole.commands.parsing import parse
from mjcartpole.commands.registry import COMMANDS, name_of
from mjcartpole.envs.cartpole import CartPoleEnv
from mjcartpole.page.document import ASSETS
from mjcartpole.physics.load import find_model, model_names

ROOT = Path(__file__).resolve().parents[1]
TARGET = ROOT / "docs" / "generated"
ABOVE = ("CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md")
LIVE = "live.html"
LIVE_MODELS = ("cartpole", "long", "moon")
LEAN = 0.12  # rad: how the poles of the gallery stand
MODULES = (
    "task",
    "rewards",
    "envs.continuous",
    "envs.dm",
    "learning.controllers",
    "studies.transfer",
    "studies.film",
    "studies.statistics",
    "media.video",
    "physics.describe",
    "physics.equations",
    "physics.parameters",
    "errors",
)
WIDE = "9999"  # columns: a flag's help is one line


def make(target: Path = TARGET) -> None:
    """Write all of them anew."""
    os.environ["COLUMNS"] = WIDE
    target.mkdir(exist_ok=True)
    pages = {
        "cli": "\n".join(commands()),
        "gallery": "\n".join(gallery(target)),
        "api": "\n".join(public_names()),
        "modules": "\n".join(modules()),
        "live": "\n".join(live(target)),
    }
    pages |= {name.removesuffix(".md").lower(): above(name) for name in ABOVE}
    for name, text in pages.items():
        (target / f"{name}.md").write_text(text, encoding="utf-8")


def said_by(*words: str) -> str:
    """Return what a command of ours prints."""
    said = io.TextIOWrapper(io.BytesIO(), "utf-8", write_through=True)  # so that help has its boxes
    with contextlib.redirect_stdout(said), contextlib.suppress(SystemExit):
        parse(words).run()
    said.seek(0)
    return said.read()


def commands() -> Iterator[str]:
    """Yield the lines of the reference of commands, from what `--help` prints."""
    yield "# Commands\n\nWhat `--help` says of each. `mjcartpole --version` prints the version.\n"
    for name in map(name_of, COMMANDS):
        yield f"\n## {name}\n"
        yield from flags(said_by(name, "--help"))


def flags(said: str) -> Iterator[str]:
    """Yield a help text as Markdown: usage, description, and a definition for each flag."""
    usage, *lines = said.splitlines()
    yield f"```text\n{usage.removeprefix('usage: ')}\n```\n"
    entries: list[list[str]] = []
    for line in lines:
        text = line.strip("│ ")
        if line.startswith("╭"):
            entries.append([f"**{text.strip('╭╮─ ')}**"])
        elif line.startswith("│ ") and line[2] != " ":
            entries.append(re.split(r" {2,}", text, maxsplit=1))
        elif line.startswith("│"):
            entries[-1].append(text)
        elif text.strip("╰╯─"):
            yield f"{text}\n"
    for head, *said_of_it in entries:
        yield f"\n`{head}`\n: {escaped(' '.join(said_of_it))}" if said_of_it else f"\n{head}\n"


def escaped(text: str) -> str:
    """Return text in which Markdown has nothing to read."""
    return re.sub(r"([*_<>\[\]`$|])", r"\\\1", text)


def public_names() -> Iterator[str]:
    """Yield the lines of the reference of what `import mjcartpole` brings."""
    yield "# The public names\n\nWhat `import mjcartpole` brings; each imported when it is used.\n"
    for name in mjcartpole.__all__:
        value = getattr(mjcartpole, name)
        kind = "autoclass" if isinstance(value, type) else "autofunction"
        said = directive(kind, f"mjcartpole.{name}") if callable(value) else f"`{value!r}`\n"
        yield f"\n## {name}\n\n{said}"


def modules() -> Iterator[str]:
    """Yield the lines of the reference of modules that a program may want beside."""
    yield "# Modules\n\nWhat a program may want beside [the public names](api.md).\n"
    for name in MODULES:
        yield f"\n## {name}\n\n{directive('automodule', f'mjcartpole.{name}')}"


def directive(kind: str, name: str) -> str:
    """Return what has Sphinx read the docstrings of a thing and its members."""
    members = "   :members:\n" if kind in {"autoclass", "automodule"} else ""
    return f"```{{eval-rst}}\n.. {kind}:: {name}\n{members}```\n"


def gallery(target: Path) -> Iterator[str]:
    """Yield the lines of a page of all shipped models, and draw them beside it."""
    yield "# Gallery\n\nThe models that come along, each a commented file to copy and change."
    yield "[Pole variants](../variants.md): how well tables hold them. [Some move here](live.md).\n"
    names = sorted(model_names(), key=lambda name: (name != "cartpole", name))
    yield '<div class="gallery">\n'
    yield from (f"[![{name}]({name}.png)](#{name})" for name in names)
    yield "\n</div>\n"
    for name in names:
        draw(name, target / f"{name}.png")
        yield from shown(name)


def shown(name: str) -> Iterator[str]:
    """Yield what the gallery says of a model: its comment, what was understood, and the file."""
    text = find_model(name).read_text(encoding="utf-8")
    comment = text.split("-->", 1)[0].removeprefix("<!--").strip()
    title, *others = (" ".join(part.split()) for part in comment.split("\n\n"))
    yield f"\n## {name}\n\n![{name}]({name}.png)\n\n**{title.partition(': ')[2]}**\n"
    yield from (f"{escaped(part)}\n" for part in others)
    yield f"```text\n{said_by('model', 'show', name)}```\n"
    yield f"<details><summary>models/{name}.xml</summary>\n\n```xml\n{text}```\n\n</details>\n"


def draw(name: str, path: Path) -> None:
    """Write a picture of a model whose poles lean a little."""
    env = CartPoleEnv(model=name, render_mode="rgb_array", width=640, height=400)
    observation, _ = env.reset(seed=0)
    env.state = (0.0, 0.0, *(LEAN, 0.0) * (len(observation) // 2 - 1))
    Image.fromarray(np.asarray(env.render())).save(path)
    env.close()


def live(target: Path) -> Iterator[str]:
    """Yield the lines of a page with the table at work, and write what it embeds."""
    yield "# Try it here\n\nWhat [`mjcartpole page`](../page.md) writes: MuJoCo in this browser,"
    yield "and a table. Drag the pole, push the cart, change the model, or play against it.\n"
    if not (ASSETS / "page.js").is_file():
        print("site: the page is shown as a picture: what it is made of is not built (make page)")
        yield "![The page, as a picture](../images/page.png)"
        return
    if not is_current(target / LIVE):
        with contextlib.chdir(target):
            for model in LIVE_MODELS:
                said_by("train", "--model", model, "--no-video", "--run-dir", f"runs/{model}")
            said_by("page", *(f"runs/{model}" for model in LIVE_MODELS), "-o", LIVE, "--overwrite")
            shutil.rmtree("runs")
    yield f'<iframe class="live" src="../{LIVE}" title="The page, live"></iframe>\n'
    yield f'<a class="whole" href="../{LIVE}">Open it on a page of its own</a>'


def is_current(path: Path) -> bool:
    """Say whether a file is newer than all that it is made by."""
    sources = (one for folder in ("src", "models") for one in (ROOT / folder).rglob("*.*"))
    newest = max(one.stat().st_mtime for one in sources if one.suffix != ".pyc")
    return path.is_file() and path.stat().st_mtime > newest


def above(name: str) -> str:
    """Return a page that lies above docs/, with its links as seen from docs/generated."""
    text = (ROOT / name).read_text(encoding="utf-8")
    text = re.sub(r"\]\((?![a-z]+://|#)", "](../../", text)
    return text.replace("](../../docs/", "](../")


if __name__ == "__main__":
    make()
