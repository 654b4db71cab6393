"""What README and docs show is what happens: each page is read from top to bottom, and run.

Every command and every Python block is run, in the order in which a reader meets them, in a folder
that has what a page presupposes: a checkout that is set up and, but for the README, the run that
README's `make train` leaves. `FAST` names what the fast tests run; the slow ones run all.
"""

import ast
import functools
import importlib
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import mjcartpole
from mjcartpole import cli
from mjcartpole.commands import parsing
from mjcartpole.media.gl import can_use
from mjcartpole.page.document import ASSETS
from nightly import few
from on_pages import NOT_HERE, PICTURES, SCALED

ROOT = Path(__file__).resolve().parents[1]
PAGES = ("README.md", *sorted(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md")))
COMMAND = re.compile(r"(?:\.venv/bin/)?(?:mjcartpole|make|python3?|pip|ruff) \S")
PATIENCE = 900
NAVIGATION = "```{toctree}"
"""A list of pages for the site."""

FAST = {
    "README.md": {"make train", "import gymnasium"},
    "docs/performance.md": {"mjcartpole --help"},
    "docs/plots.md": {"mjcartpole plot table runs/tuned-mujoco-seed0"},
    "docs/tasks.md": {"import math"},
    "docs/variants.md": {
        "mjcartpole evaluate runs/tuned-mujoco-seed0 --set hinge.damping=0.6",
        "mjcartpole model edit cartpole --set pole.length=1.5 -o mine.xml",
        "import gymnasium",
    },
    "docs/videos.md": {"mjcartpole render runs/tuned-mujoco-seed0"},
}
"""What short reads run: commands, and Python blocks by their first line."""

SHORT = {"make train": "make train ARGS=--no-video"}
"""What a short read leaves out of a command; the last line of what it prints goes with it."""

EXITS = {"mjcartpole parity --model my.xml": 1}
"""Commands that find what the page says is wrong."""

ENDLESS = {
    "mjcartpole watch heavy.xml": "videos/heavy.mp4",
    "mjcartpole watch mine.xml": "videos/mine.mp4",
    "mjcartpole train --episodes 2000000 --checkpoint-every 2 --run-dir runs/long": "runs/long/checkpoint.bin",  # noqa: E501
    "mjcartpole train --resume runs/long": "goes on after",
}
"""What a reader ends by Ctrl-C, and the file or the words that come first."""

PRINTED = {
    "tuned on mujoco: 1,000 episodes, seed 0": "make train",
    "greedy evaluation on mujoco, runs/tuned-mujoco-seed0/model.xml with hinge.damping=0.6: "
    "100 episodes, seed 1000000": (
        "mjcartpole evaluate runs/tuned-mujoco-seed0 --set hinge.damping=0.6"
    ),
}
"""Blocks that show what a command prints, by their first line; it comes before them."""

PLAIN = {
    "models/                 MJCF files, hand-written and commented; they ship inside the wheel",
    "garbage ← errors ← packages ← cores ← rewards ← rules ← task ← rule_changes ← disturbances"
    " ← integrator ← leftovers ← files ← versions ← physics ← media ← envs ← learning ← studies"
    " ← page ← commands ← cli",
    "Q(s, a) ← Q(s, a) + α (G − Q(s, a))",  # noqa: RUF001 - a formula
    "[study]",
    "dask scheduler",
    "from dask_jobqueue import SLURMCluster",
    "export ATEN_CPU_CAPABILITY=default MKL_ENABLE_INSTRUCTIONS=SSE4_2 ONEDNN_MAX_CPU_ISA=SSE41"
    " OPENBLAS_CORETYPE=Nehalem",
    "G_t = r_t + γ ((1 − λ) max Q(s_t+1, ·) + λ G_t+1)",  # noqa: RUF001 - a formula
}
"""First lines of blocks that are neither commands nor Python nor printed."""


@dataclass(frozen=True)
class Block:
    """A piece of a page in another type: `kind` is "command", "python" or "plain"."""

    kind: str
    text: str

    @property
    def name(self) -> str:
        """What the tables here call it."""
        return self.text.splitlines()[0]


def read(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def blocks(page: str) -> Iterator[Block]:
    """All blocks of a page, and the commands that stand in its sentences, in reading order."""
    fenced, indented = r"^```.*\n(?s:.*?)^```$", r"(?:^ {4}.*\n(?:\n(?= {4}))*)+"
    for piece in re.split(f"({fenced}|{indented})", read(page), flags=re.MULTILINE):
        if piece.startswith("```"):
            head, text = piece.split("\n", 1)
            if head != NAVIGATION:
                yield Block(head.strip("`") or "plain", text.removesuffix("```"))
        elif piece.startswith("    "):
            yield from _indented(textwrap.dedent(piece).strip("\n"))
        else:
            spans = (" ".join(span.split()) for span in re.findall(r"`([^`]+)`", piece))
            yield from (Block("command", span) for span in spans if COMMAND.match(span))


def _indented(text: str) -> Iterator[Block]:
    if not COMMAND.match(text):
        yield Block("plain", text)
        return
    for line in filter(None, text.splitlines()):
        yield Block("command", re.sub(r"\s+#.*", "", line))


def machine_free(printed: str) -> str:
    """What was printed, but for what draws on this machine."""
    return re.sub(r"drawn by \w+", "drawn", printed).strip()


@dataclass(frozen=True)
class Reader:
    """Somebody who types what a page says.

    Attributes:
        folder: Where; a checkout.
    """

    folder: Path

    @property
    def environment(self) -> dict[str, str]:
        """The programs that the page means come first."""
        programs = self.folder / ".venv" / "bin"
        # A make inside another says more than the reader's own does.
        kept = {name: value for name, value in os.environ.items() if "MAKE" not in name}
        return {**kept, "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}

    def runs(self, command: str) -> subprocess.CompletedProcess[str]:
        """Run a command to its end."""
        return subprocess.run(
            ["bash", "-c", command],
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )

    def ends(self, command: str, awaited: str) -> int:
        """Run a command until there is a file, or a word, then end it by Ctrl-C."""
        printed = self.folder / "printed.txt"
        with printed.open("w") as stdout:
            process = subprocess.Popen(
                shlex.split(command),
                cwd=self.folder,
                env=self.environment,
                stdout=stdout,
                stderr=subprocess.STDOUT,
            )
        until = time.monotonic() + PATIENCE
        while not (self.folder / awaited).exists() and awaited not in printed.read_text("utf-8"):
            assert process.poll() is None, printed.read_text("utf-8")
            assert time.monotonic() < until, f"{command}: no {awaited}"
            time.sleep(0.1)
        process.send_signal(signal.SIGINT)
        return process.wait(PATIENCE)

    def follows(self, page: str, *, only: set[str] | None = None) -> set[str]:
        """Do what the page says, or what of it is named, once each; return the names of that."""
        printed: dict[str, str] = {}
        left_out = {*NOT_HERE, *lacking()}
        for block in blocks(page):
            chosen = block.name not in left_out if only is None else block.name in only
            if block.kind == "plain":
                self.sees(block, printed, everything=only is None)
            elif chosen and block.name not in printed:
                command = block.text if only is None else SHORT.get(block.name, block.text)
                printed[block.name] = self.does(block, command)
        return set(printed)

    @staticmethod
    def sees(block: Block, printed: dict[str, str], *, everything: bool) -> None:
        """Compare a block with what its command has printed, if it shows that of one."""
        command = PRINTED.get(block.name)
        if everything and command:
            assert command in printed, f"{command} comes too late"
        if command in printed:
            shown, meant = machine_free(printed[command]), machine_free(block.text)
            if command in SHORT and not everything:
                meant = meant.rsplit("\n", 1)[0]
            assert meant == shown, f"{command} prints otherwise:\n{shown}"

    def does(self, block: Block, command: str) -> str:
        """Run a block, by this command if it is one; return what it prints."""
        if block.name in ENDLESS:
            assert self.ends(block.text, ENDLESS[block.name]) == cli.INTERRUPTED
            return ""
        for pattern, shorter in SCALED.items():
            command = re.sub(pattern, shorter, command)
        if block.kind == "python":
            (self.folder / "block.py").write_text(command, encoding="utf-8")
            command = "python block.py"
        done = self.runs(command)
        assert done.returncode == EXITS.get(block.name, 0), f"{command}\n{done.stdout}{done.stderr}"
        for shown, made in PICTURES.get(block.name, {}).items():
            assert_alike(self.folder / made, ROOT / shown)
        return done.stdout


def lacking() -> set[str]:
    """Blocks that need what not every machine has."""
    everything = [block for page in PAGES for block in blocks(page)]
    needs = {"path/to/dm_control": bool(find_spec("dm_control")), '"egl"': can_use("egl")}
    needs["mjcartpole page"] = (ASSETS / "page.js").is_file()
    missing = [words for words, there in needs.items() if not there]
    return {block.name for block in everything if any(word in block.text for word in missing)}


def assert_alike(made: Path, shown: Path) -> None:
    """Two pictures show the same; letters may be a little off, by another version of Pillow."""
    ours, theirs = (np.asarray(Image.open(path).convert("RGB"), float) for path in (made, shown))
    assert ours.shape == theirs.shape
    assert np.abs(ours - theirs).mean() < 1


def make_program(path: Path, line: str) -> None:
    path.write_text(f"#!/bin/sh\nexec {line}\n", encoding="utf-8")
    path.chmod(0o755)


@pytest.fixture(scope="module")
def checkout(tmp_path_factory):
    """A checkout as `make` leaves it after its first time: with an environment that is set up."""
    folder = tmp_path_factory.mktemp("checkout") / "mjcartpole"
    source = Path(mjcartpole.__file__).parents[1]
    ignored = shutil.ignore_patterns(
        ".git",
        ".venv",
        ".*_cache",
        ".hypothesis",
        "build",
        "generated",
        "__pycache__",
        "runs",
        "transfer",
        "src",
        "node_modules",
    )
    shutil.copytree(ROOT, folder, ignore=ignored)
    # The loop is compiled once for all pages.
    (folder / "src").symlink_to(source)
    programs = folder / ".venv" / "bin"
    programs.mkdir(parents=True)
    python = f"env PYTHONPATH='{source}' '{sys.executable}'"
    make_program(programs / "python", f'{python} "$@"')
    modules = {name: name for name in ("mjcartpole", "ruff", "mypy")}
    for name, module in (modules | {"codespell": "codespell_lib"}).items():
        make_program(programs / name, f'{python} -m {module} "$@"')
    for stamp in ("installed", "installed-dev"):
        (programs.parent / stamp).touch()
    # What pages call `path/to/…` are packages that are installed here.
    (folder / "path").mkdir()
    (folder / "path" / "to").symlink_to(Path(find_spec("gymnasium").origin).parents[1])
    return folder


@pytest.fixture(scope="module")
def reads(checkout, tmp_path_factory):
    """Make the reader of a page, in a checkout of its own."""

    @functools.cache
    def after_make_train():
        first = Reader(copy_of(checkout))
        done = first.runs("mjcartpole train")
        assert done.returncode == 0, done.stderr
        return first.folder

    def copy_of(folder):
        copy = tmp_path_factory.mktemp("reader") / "mjcartpole"
        return shutil.copytree(folder, copy, symlinks=True)

    return lambda page: Reader(copy_of(checkout if page == "README.md" else after_make_train()))


@pytest.mark.long
@pytest.mark.parametrize("page", few(FAST, "README.md"))
def test_a_page_in_short(page, reads):
    assert reads(page).follows(page, only=FAST[page]) == FAST[page]


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_a_page_from_top_to_bottom(page, reads):
    asked = {block.name for block in blocks(page) if block.kind != "plain"}
    assert asked - reads(page).follows(page) <= {*NOT_HERE, *lacking()}


def test_nothing_on_a_page_is_of_an_unknown_kind():
    found = [block for page in PAGES for block in blocks(page)]
    assert {block.kind for block in found} == {"plain", "python", "command"}
    assert {block.name for block in found if block.kind == "plain"} == PLAIN | set(PRINTED)


def test_every_name_in_the_tables_is_on_a_page():
    found = {page: {block.name for block in blocks(page)} for page in PAGES}
    everywhere = set().union(*found.values())
    texts = [block.text for page in PAGES for block in blocks(page)]
    assert len(everywhere) > 60
    assert [name for page, names in FAST.items() for name in names - found[page]] == []
    for table in (NOT_HERE, SHORT, EXITS, ENDLESS, PRINTED, set(PRINTED.values()), PICTURES):
        assert set(table) - everywhere == set()
    for pattern in SCALED:
        assert any(re.search(pattern, text) for text in texts), pattern


@pytest.mark.long
def test_every_command_is_understood():
    lines = {block.text for page in PAGES for block in blocks(page) if block.kind == "command"}
    ours = [line for line in lines if line.startswith(("mjcartpole ", ".venv/bin/mjcartpole "))]
    assert len(ours) > 40
    for line in ours:
        if line != "mjcartpole --help":
            parsing.parse(shlex.split(line)[1:])


def test_what_python_blocks_import_is_there():
    found = [block.text for page in PAGES for block in blocks(page) if block.kind == "python"]
    nodes = [node for text in found for node in ast.walk(ast.parse(text))]
    ours = [node for node in nodes if "mjcartpole" in (getattr(node, "module", "") or "")]
    assert len(ours) > 7
    for node in ours:
        module = importlib.import_module(node.module)
        assert [each.name for each in node.names if not hasattr(module, each.name)] == []


@pytest.mark.parametrize("page", PAGES)
def test_what_a_page_links_to_is_there(page):
    targets = re.findall(r"(?<=\]\()[^)#]+(?=\))|(?<=src=\")[^\"]+", read(page))
    beside = (ROOT / page).parent
    assert [link for link in targets if "://" not in link and not (beside / link).exists()] == []


def test_the_site_leads_to_every_page():
    trees = re.findall(rf"{NAVIGATION}\n(.*?)```", read("docs/index.md"), re.DOTALL)
    lines = [line for tree in trees for line in tree.split("\n")]
    listed = [line for line in lines if line and not line.startswith(":")]
    pages = {Path(page).stem for page in PAGES[1:]} - {"index"}
    pages |= {f"notebooks/{path.stem}" for path in (ROOT / "docs").glob("notebooks/*.ipynb")}
    assert sorted(pages - set(listed)) == []
    assert len(listed) == len(set(listed))


@pytest.mark.parametrize("page", PAGES)
def test_every_file_of_ours_that_a_page_names_is_there(page):
    package, named = Path(mjcartpole.__file__).parent, re.findall(r"`([\w/.]+\.py)`", read(page))
    ours = {path.name for folder in (package, ROOT) for path in folder.rglob("*.py")}
    for name in named:
        places = [ROOT / name, package / name] if "/" in name else []
        assert any(place.is_file() for place in places) if places else name in ours, name


def test_the_tree_of_files_is_the_one_there_is():
    tree = next(block.text for block in blocks("docs/architecture.md"))
    text = tree[tree.index("src/mjcartpole/") : tree.index("tests/ ")]
    named = re.findall(r"[\w/]+\.py\b", text)
    files = (path.name for path in Path(mjcartpole.__file__).parent.rglob("*.py"))
    assert sorted(named) == sorted(name for name in files if not name.startswith("__"))
