"""Load an MJCF, check that it is a cart-pole, and find its parts.

A cart-pole is one slide joint (the cart's), a hinge joint below it for each pole, and one actuator
that pushes along the slider. Names do not matter; structure does.
"""

import copy
import dataclasses
import difflib
import functools
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeAlias

import mujoco
import numpy as np

from mjcartpole import task
from mjcartpole.errors import ConfigError, ModelNotFoundError, ModelSyntaxError
from mjcartpole.physics.cache import remembered
from mjcartpole.physics.guard import compile_document, one_line
from mjcartpole.physics.includes import portable, read_text, read_whole
from mjcartpole.physics.library import all_digits
from mjcartpole.physics.sanity_checks import check_motion, check_numbers
from mjcartpole.physics.structure import (
    check_directions,
    check_independent,
    check_limits,
    count_from_upright,
    find_controls,
    find_joints,
    find_substeps,
    motor_of,
)

INTEGRATORS = {
    int(value): {"EULER": "Euler", "RK4": "RK4"}.get(
        name := key.removeprefix("mjINT_"), name.lower()
    )
    for key, value in mujoco.mjtIntegrator.__members__.items()
}
"""MuJoCo's integrators by its own numbers, spelled as MJCF spells them."""


@dataclass(frozen=True, repr=False)
class CartPole:
    """A compiled cart-pole and where its parts are.

    Attributes:
        name: What a person calls it: a model's name, a file's path.
        xml: The whole document as text; it compiles to the same model anywhere.
        model: The compiled model.
        slider: Index of the cart's joint in qpos and qvel.
        hinges: Index of each pole's joint in qpos and qvel, in the document's order.
        controls: The actuator's control for action 0 and for action 1.
        substeps: Physics steps per control step.
        upright: Each hinge's angle as the document counts it at which the model's angle is 0, rad.
            It is 0 but where a document has the pole hang, or lie, at its own angle 0.
    """

    name: str
    xml: str
    model: mujoco.MjModel
    slider: int
    hinges: tuple[int, ...]
    controls: tuple[float, float]
    substeps: int
    upright: tuple[float, ...]

    def __repr__(self) -> str:
        name = self.name if len(self.name) <= 200 else f"{self.name[:200]}…"
        return f"CartPole({name!r}, {task.in_words(self.poles)}, timestep {self.timestep:g} s)"

    @functools.cached_property
    def stored(self) -> tuple[str, dict[str, Path | str]]:
        """The document as a run stores it, and the files that lie beside it (see `portable`)."""
        return portable(self.xml)

    @property
    def poles(self) -> int:
        """How many poles it has."""
        return len(self.hinges)

    @property
    def joints(self) -> tuple[int, ...]:
        """Indices in qpos and qvel in the order of a state: the slider, then each hinge."""
        return (self.slider, *self.hinges)

    @property
    def motor(self) -> int:
        """Index of the actuator that the actions control."""
        return motor_of(self.model)

    @property
    def timestep(self) -> float:
        """Seconds of one physics step."""
        return float(self.model.opt.timestep)

    @property
    def has_own_timestep(self) -> bool:
        """Whether a control step is one physics step of another length than 0.02 s."""
        return self.substeps == 1 and self.timestep != task.CONTROL_STEP

    @property
    def control_step(self) -> float:
        """Seconds between two actions."""
        return self.timestep * self.substeps

    @property
    def integrator(self) -> str:
        """The integrator that the file names, as MJCF spells it (see `INTEGRATORS`)."""
        return str(INTEGRATORS[int(self.model.opt.integrator)])


_NAMES_FILE: Final = re.compile(r"file\w*\s*=")
"""In the text of a document that depends on other files: includes, meshes, attached models."""

ModelLike: TypeAlias = str | os.PathLike[str] | mujoco.MjSpec | CartPole
"""What `load_model` takes: a name, a path, an XML document, an MjSpec, or a loaded cart-pole."""


Edits: TypeAlias = Mapping[str, object] | Sequence[str] | None
"""Changes of a document: a mapping, or texts such as "pole.length=1.5"."""


@functools.cache
def models_folder() -> Path:
    """The folder of the models that come with the package.

    In a wheel it lies inside the package; in a checkout at the top, where people edit it.
    """
    package = Path(__file__).resolve().parents[1]
    installed = package / "models"
    return installed if installed.is_dir() else package.parents[1] / "models"


def model_names() -> list[str]:
    """Names of the models that come with the package, sorted."""
    return sorted(path.stem for path in models_folder().glob("*.xml"))


def load_model(
    source: ModelLike = "cartpole", edits: Edits = None, *, own_timestep: bool = False
) -> CartPole:
    """Load a cart-pole.

    >>> load_model("cartpole", {"pole.length": 1.5}).name
    'cartpole with pole.length=1.5'

    Args:
        source: The name of a shipped model (`"cartpole"`), the path of an MJCF file, an MJCF
            document as text (it starts with `<`), or an `mujoco.MjSpec`. A loaded cart-pole is
            returned as it is, but for `edits` and `own_timestep`.
        edits: Changes of the document, made before it is compiled (see `edit_document`): a
            mapping, or texts such as "pole.length=1.5".
        own_timestep: Let a control step be one physics step of the file, however long, instead of
            as many as fill CartPole-v1's 0.02 s.

    Raises:
        ModelNotFoundError: There is no such name or file.
        ModelSyntaxError: MuJoCo does not accept the document.
        NotACartPoleError: It compiles, but is no cart-pole.
        ConfigError: An edit makes no sense, or the document is not all that the model is.
    """
    shared = load_shared(source, edits, own_timestep=own_timestep)
    return shared if isinstance(source, CartPole) and not edits else own_copy(shared)


def load_shared(
    source: ModelLike = "cartpole", edits: Edits = None, *, own_timestep: bool = False
) -> CartPole:
    """As `load_model`, for those who only read: a document's compiled model is shared by all."""
    if edits:
        return _load_edited(source, edits, own_timestep)
    if isinstance(source, CartPole):
        return dataclasses.replace(source, substeps=1) if own_timestep else source
    if isinstance(source, mujoco.MjSpec):
        return _find_parts(*_from_spec(source), own_timestep)
    if isinstance(source, str) and source.lstrip().startswith("<"):
        return _load_text(source, "the XML document", own_timestep)
    path = find_model(source)
    name = path.stem if path.parent == models_folder() else str(source)
    return _load_text(read_text(path), name, own_timestep, path)


def own_copy(cartpole: CartPole) -> CartPole:
    """The same cart-pole with a compiled model of its own, which may be changed."""
    return dataclasses.replace(cartpole, model=copy.copy(cartpole.model))


def _load_edited(
    source: ModelLike, edits: Mapping[str, object] | Sequence[str], own_timestep: bool
) -> CartPole:
    from mjcartpole.physics.edit.edits import edit_document, edits_of  # noqa: PLC0415 - it needs CartPole

    # An edit may be what makes a file's timestep fit.
    base = load_shared(source, own_timestep=True)
    if isinstance(source, CartPole | mujoco.MjSpec):
        _check_document(base)
    changes = edits_of(edits)
    document = edit_document(base.xml, changes, base.name)
    what = ", ".join(f"{key}={value}" for key, value in changes.items())
    return _load_text(document, f"{base.name} with {what}", own_timestep)


def _check_document(cartpole: CartPole) -> None:
    """Edits are made in a document, so it must be all that the compiled model is."""
    if not is_its_document(cartpole):
        raise ConfigError(
            f"{cartpole.name} cannot be edited: its document compiles to another model, since its "
            "numbers were changed after compiling or MuJoCo wrote it with fewer digits; edit the "
            "file, or the MjSpec, that it comes from and load that"
        )


def is_its_document(cartpole: CartPole) -> bool:
    """Whether the document compiles to the very model that runs."""
    again = _load_text(cartpole.xml, cartpole.name, own_timestep=True)
    return same_model(again.model, cartpole.model)


def load_named(document: str, name: str, *, own_timestep: bool = True) -> CartPole:
    """Load a document that a person knows by a name.

    Raises:
        ModelError: It does not load, or is no cart-pole.
    """
    return own_copy(_load_text(document, name, own_timestep))


def _load_text(text: str, name: str, own_timestep: bool, path: Path | None = None) -> CartPole:
    """Load a document as it was written, of a file or of none; shared if it names no other file."""
    folder, called = (path.parent, str(path)) if path else (Path(), name)

    def load() -> CartPole:
        return _find_parts(name, *_compile(text, called, folder), own_timestep)

    if _NAMES_FILE.search(text):
        return load()
    return dataclasses.replace(remembered((text, own_timestep), load), name=name)


def load_stored(
    document: str,
    name: str,
    folder: Path,
    allow_assets: Sequence[Path] = (),
    *,
    own_timestep: bool = False,
) -> CartPole:
    """Load a document that a run stores, which may have been made by somebody else.

    Args:
        document: The document.
        name: What a person calls it.
        folder: The run's folder; what the document names must lie in there.
        allow_assets: Other folders in which it may lie.
        own_timestep: See `load_model`.

    Raises:
        ModelError: It does not load, is no cart-pole, or names a file elsewhere.
    """
    for allowed in allow_assets:
        if not allowed.is_dir():
            raise ConfigError(f"'{allowed}' is no folder; give one in which the model's files lie")
    inside = (folder, *allow_assets)
    return _find_parts(name, *_compile(document, name, folder, inside), own_timestep)


def with_options(
    cartpole: CartPole, *, timestep: float | None = None, integrator: str | None = None
) -> CartPole:
    """The same cart-pole with another timestep or integrator, one physics step per control step.

    For studies of integrators; the document stays as it was. Options are no geometry: changing
    them in a compiled model leaves no derived value stale.

    Args:
        cartpole: The cart-pole.
        timestep: Seconds.
        integrator: As MJCF spells it (see `INTEGRATORS`).
    """
    model = copy.copy(cartpole.model)
    if timestep is not None:
        model.opt.timestep = timestep
    if integrator is not None:
        model.opt.integrator = next(n for n, name in INTEGRATORS.items() if name == integrator)
    return dataclasses.replace(cartpole, model=model, substeps=1)


def find_model(source: str | os.PathLike[str]) -> Path:
    """The file that a model's name or path stands for.

    Raises:
        ModelNotFoundError: There is no such name or file.
    """
    if not isinstance(source, str | os.PathLike):
        raise ModelNotFoundError(
            f"a model is a name, path, document, MjSpec or loaded cart-pole, not {source!r}"
        )
    path = Path(source)
    if path.suffix == ".xml" or len(path.parts) > 1:
        if path.is_file():
            return path
        other = "is a folder" if path.is_dir() else "is a device or a pipe, not a file"
        found = other if path.exists() else "is not there"
        raise ModelNotFoundError(
            f"model file '{source}' {found}; give the path of an MJCF file, "
            f"or one of the names {', '.join(model_names())}"
        )
    shipped = models_folder() / f"{source}.xml"
    if shipped.is_file():
        return shipped
    if path.is_file():
        return path
    names = model_names()
    close = difflib.get_close_matches(str(source), names, n=1)
    hint = f", did you mean '{close[0]}'?" if close else ""
    raise ModelNotFoundError(
        f"no model is called '{source}'{hint}; available: {', '.join(names)} "
        "(or give the path of a file that ends in .xml)"
    )


def _from_spec(spec: mujoco.MjSpec) -> tuple[str, str, mujoco.MjModel]:
    """Its name, the document and the compiled model."""
    try:
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise ModelSyntaxError(f"the MjSpec does not compile: {one_line(str(error))}") from error
    with all_digits():
        text = spec.to_xml()
    xml = read_whole(text, "the MjSpec", Path(spec.modelfiledir)).text
    return spec.modelname or "the MjSpec", xml, model


def _compile(
    text: str, name: str, folder: Path, inside: Sequence[Path] | None = None
) -> tuple[str, mujoco.MjModel]:
    """The document, whole, and the compiled model."""
    document = read_whole(text, name, folder, inside)
    return document.text, compile_document(document, name)


def same_model(a: mujoco.MjModel, b: mujoco.MjModel) -> bool:
    """Whether two compiled models are equal in every number, name and option.

    Where their files lie makes no difference.
    """
    return dict(_values_of(a)) == dict(_values_of(b))


_NO_VALUES: Final = {"nbuffer", "signature"}
"""Of a compiled model: they go with the length of paths, and are lost in a pickle."""


def _values_of(part: object, prefix: str = "") -> Iterator[tuple[str, object]]:
    for name in dir(part):
        value = getattr(part, name)
        if name.startswith("_") or callable(value) or "path" in name or name in _NO_VALUES:
            continue
        if isinstance(value, np.ndarray):
            yield prefix + name, (value.shape, value.tobytes())
        elif isinstance(value, int | float | bytes):
            yield prefix + name, value
        else:
            yield from _values_of(value, f"{prefix}{name}.")


def _find_parts(name: str, xml: str, model: mujoco.MjModel, own_timestep: bool) -> CartPole:
    check_numbers(name, model)
    slider, hinges = find_joints(name, model)
    controls = find_controls(name, model, slider)
    substeps = 1 if own_timestep else find_substeps(name, model)
    cartpole = CartPole(name, xml, model, slider, hinges, controls, substeps, (0.0,) * len(hinges))
    # From the cart outwards: which way a pole on a pole stands depends on the one below it.
    upright = tuple(_count_from_upright(name, cartpole, pole) for pole in range(cartpole.poles))
    cartpole = dataclasses.replace(cartpole, upright=upright)
    check_limits(name, cartpole)
    check_independent(name, cartpole)
    check_motion(name, cartpole)
    return cartpole


def _count_from_upright(name: str, cartpole: CartPole, pole: int) -> float:
    """Have a pole's angle count from upright, if it does not; returns the angle that became 0."""
    upright = check_directions(name, cartpole, pole).upright
    if abs(upright) <= task.THETA_LIMIT:
        return 0.0
    return count_from_upright(name, cartpole, pole, upright)
