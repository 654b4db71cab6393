"""Imports point one way, and starting up stays light."""

import ast
import functools
import graphlib
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

import mjcartpole
from mjcartpole.commands import registry
from nightly import few

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = Path(mjcartpole.__file__).parent
LAYERS = [
    "garbage",
    "errors",
    "packages",
    "cores",
    "rewards",
    "rules",
    "task",
    "rule_changes",
    "disturbances",
    "integrator",
    "leftovers",
    "files",
    "versions",
    "physics",
    "media",
    "envs",
    "learning",
    "studies",
    "page",
]
TOP = {
    "signals",
    "output",
    "commands",
    "cli",
    "__main__",
    "__init__",
}
MUJOCO_HOMES = ("physics/", "media/")

SOURCES = sorted(PACKAGE.rglob("*.py"))


@functools.cache
def imports(path):
    """Every import of a file, wherever it stands."""
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return [node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)]


def imported_modules(path):
    """Every absolute module name that a file imports."""
    for node in imports(path):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        else:
            assert node.level == 0, f"{path}: relative import"
            if node.module == "mjcartpole":
                yield from (f"mjcartpole.{alias.name}" for alias in node.names)
            else:
                yield node.module or ""


def layer_of(path):
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imports_upwards(path):
    """The modules of ours that a file imports, and that are in no layer from its own down."""
    layer = layer_of(path)
    if layer in TOP:
        return []
    below = LAYERS[: LAYERS.index(layer) + 1]
    ours = (name for name in imported_modules(path) if name.startswith("mjcartpole."))
    return [name for name in ours if name.split(".")[1] not in below]


def test_imports_point_downwards():
    upwards = {path.relative_to(PACKAGE).as_posix(): imports_upwards(path) for path in SOURCES}
    assert {path: modules for path, modules in upwards.items() if modules} == {}


def name_of(path):
    """A file's name as a module; a package's is that of its __init__.py."""
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported_files(path, modules):
    """The modules that a file imports of this package, lazily or for types only, too."""
    for node in imports(path):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in modules)
        elif node.module in modules:
            names = (f"{node.module}.{alias.name}" for alias in node.names)
            yield from (name if name in modules else node.module for name in names)


def test_no_files_import_each_other_in_a_circle():
    modules = {name_of(path): path for path in SOURCES}
    graph = {name: set(imported_files(path, modules)) for name, path in modules.items()}
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        pytest.fail(f"files import each other: {' <- '.join(error.args[1])}")


def test_mujoco_stays_in_its_places():
    users = {
        path.relative_to(PACKAGE).as_posix()
        for path in SOURCES
        if "mujoco" in {module.split(".")[0] for module in imported_modules(path)}
    }
    assert users
    assert {user for user in users if not user.startswith(MUJOCO_HOMES)} == set()


def test_every_module_belongs_to_a_layer():
    assert {layer_of(path) for path in SOURCES} <= {*LAYERS, *TOP}


def test_the_picture_of_the_house_is_current():
    drawn = runpy.run_path(str(ROOT / "scripts" / "draw_house.py"))["draw"]()
    committed = (ROOT / "docs" / "images" / "house.svg").read_text(encoding="utf-8")
    assert drawn == committed, "run: python scripts/draw_house.py"


def loaded_after(code):
    """Names of the packages that a fresh interpreter has loaded after running code."""
    script = f"import sys\n{code}\nprint(*sorted({{m.split('.')[0] for m in sys.modules}}))"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    return set(done.stdout.splitlines()[-1].split())


def test_importing_the_package_is_light():
    heavy = {"mujoco", "numba", "dm_control", "imageio", "OpenGL", "glfw", "PIL", "tyro"}
    ours = loaded_after("import mjcartpole")
    assert not ours & heavy
    assert ours - loaded_after("import gymnasium") == {"mjcartpole"}


@pytest.mark.parametrize(
    "words",
    few(
        [[], *([registry.name_of(command)] for command in registry.COMMANDS)],
        ["train"],
    ),
    ids=str,
)
def test_help_imports_nothing_heavy(words):
    code = (
        "import mjcartpole.cli\n"
        f"try:\n    mjcartpole.cli.main({[*words, '--help']})\n"
        "except SystemExit as stop:\n    assert stop.code == 0"
    )
    heavy = {"mujoco", "numba", "dm_control", "imageio", "OpenGL", "glfw", "PIL", "scipy"}
    assert not loaded_after(code) & heavy


def test_public_names():
    assert sorted(mjcartpole.__all__) == [
        "CartPole",
        "CartPoleEnv",
        "CartPoleVectorEnv",
        "Disturbances",
        "ENV_ID",
        "Evaluation",
        "ManyResult",
        "Policy",
        "Simulation",
        "Task",
        "TrainConfig",
        "TrainResult",
        "evaluate",
        "load_model",
        "model_names",
        "plot",
        "register_task",
        "train",
        "train_many",
    ]
    for name in mjcartpole.__all__:
        assert getattr(mjcartpole, name) is not None
    assert set(mjcartpole.__all__) <= set(dir(mjcartpole))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = mjcartpole.nothing
