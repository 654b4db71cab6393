"""Loading: a model's name, path, document or MjSpec, with edits, becomes a cart-pole.

A cart-pole is one slide joint (the cart's), a hinge joint below it for each pole, and one actuator
that pushes along the slider. Names do not matter; structure does.
"""

import dataclasses
import functools
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final, TypeAlias

import mujoco
import numpy as np

from mjcartpole.errors import (
    ConfigError,
    ModelNotFoundError,
    ModelSyntaxError,
    NotACartPoleError,
    nearest,
)
from mjcartpole.physics.build import build, compile_text, find_parts
from mjcartpole.physics.cartpole import CartPole, own_copy
from mjcartpole.physics.edit.edits import edit_document, edits_of
from mjcartpole.physics.includes import read_text, read_whole
from mjcartpole.physics.library import all_digits, one_line
from mjcartpole.task import CONTROL_STEP

ModelLike: TypeAlias = str | os.PathLike[str] | mujoco.MjSpec | CartPole
"""What `load_model` takes: a name, a path, an XML document, an MjSpec, or a loaded cart-pole."""

Edits: TypeAlias = Mapping[str, object] | Sequence[str] | None
"""Changes of a document: a mapping, or texts such as "pole.length=1.5"."""


MOST_SUBSTEPS: Final = 1_000
"""Physics steps per control step."""


@functools.cache
def models_folder() -> Path:
    """Return the folder of the models that come with the package.

    In a wheel it lies inside the package; in a checkout at the top, where people edit it.
    """
    package = Path(__file__).resolve().parents[1]
    installed = package / "models"
    return installed if installed.is_dir() else package.parents[1] / "models"


def model_names() -> list[str]:
    """Return the names of the models that come with the package, sorted."""
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
    """Load as `load_model`, for those who only read: a compiled document is shared by all."""
    if isinstance(source, CartPole) and not (edits or own_timestep):
        return source
    found = _load(source)
    # An edit may be what makes a file's timestep fit.
    return paced(_edited(source, found, edits) if edits else found, own_timestep)


def _load(source: ModelLike) -> CartPole:
    """Return a model as it is written, whose control step is one physics step."""
    if isinstance(source, CartPole):
        return dataclasses.replace(source, substeps=1)
    if isinstance(source, mujoco.MjSpec):
        return find_parts(*_from_spec(source))
    if isinstance(source, str) and source.lstrip().startswith("<"):
        return build(source, "the XML document")
    path = find_model(source)
    name = path.stem if path.parent == models_folder() else str(source)
    return build(read_text(path), name, path)


def _edited(
    source: ModelLike, base: CartPole, edits: Mapping[str, object] | Sequence[str]
) -> CartPole:
    if isinstance(source, CartPole | mujoco.MjSpec) and not is_its_document(base):
        raise ConfigError(
            f"{base.name} cannot be edited: its document compiles to another model, since its "
            "numbers were changed after compiling or MuJoCo wrote it with fewer digits; edit the "
            "file, or the MjSpec, that it comes from and load that"
        )
    changes = edits_of(edits)
    document = edit_document(base.xml, changes, base.name)
    what = ", ".join(f"{key}={value}" for key, value in changes.items())
    return build(document, f"{base.name} with {what}")


def paced(cartpole: CartPole, own_timestep: bool) -> CartPole:
    """Return a cart-pole with as many physics steps as fill a control step of 0.02 s.

    Raises:
        NotACartPoleError: The timestep does not divide it, or there would be too many.
    """
    if own_timestep:
        return cartpole
    timestep, name = cartpole.timestep, cartpole.name
    substeps = round(CONTROL_STEP / timestep)
    if substeps > MOST_SUBSTEPS:
        raise NotACartPoleError(
            f"{name}: timestep {timestep:g} s makes {substeps:g} physics steps of one control step "
            f"of {CONTROL_STEP} s, and no more than {MOST_SUBSTEPS} are done; use 0.001 …"
        )
    if substeps < 1 or abs(substeps * timestep - CONTROL_STEP) > 1e-12:
        raise NotACartPoleError(
            f"{name}: timestep {timestep:g} s does not divide the control step of "
            f"{CONTROL_STEP} s; use 0.02, 0.01, 0.005, 0.002 …, or take the file's own as the "
            "control step (--own-timestep, own_timestep=True)"
        )
    return cartpole if substeps == 1 else dataclasses.replace(cartpole, substeps=substeps)


def is_its_document(cartpole: CartPole) -> bool:
    """Return whether the document compiles to the very model that runs."""
    return same_model(build(cartpole.xml, cartpole.name).model, cartpole.model)


def load_named(document: str, name: str, *, own_timestep: bool = True) -> CartPole:
    """Load a document that a person knows by a name.

    Raises:
        ModelError: It does not load, or is no cart-pole.
    """
    return own_copy(paced(build(document, name), own_timestep))


def load_stored(
    document: str,
    name: str,
    folder: Path,
    allow_assets: Sequence[Path] = (),
    *,
    own_timestep: bool = False,
) -> CartPole:
    """Load a document that a run stores, which may have been made by somebody else.

    What it names must lie in the run's folder or in those of `allow_assets`.

    Raises:
        ModelError: It does not load, is no cart-pole, or names a file elsewhere.
    """
    for allowed in allow_assets:
        if not allowed.is_dir():
            raise ConfigError(f"'{allowed}' is no folder; give one in which the model's files lie")
    inside = (folder, *allow_assets)
    return paced(find_parts(name, *compile_text(document, name, folder, inside)), own_timestep)


def find_model(source: str | os.PathLike[str]) -> Path:
    """Return the file that a model's name or path stands for.

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
    for there in (models_folder() / f"{source}.xml", path):
        if there.is_file():
            return there
    names = model_names()
    hint = "".join(f", did you mean '{near}'?" for near in nearest(str(source), names)[:1])
    raise ModelNotFoundError(
        f"no model is called '{source}'{hint}; available: {', '.join(names)} "
        "(or give the path of a file that ends in .xml)"
    )


def _from_spec(spec: mujoco.MjSpec) -> tuple[str, str, mujoco.MjModel]:
    """Return its name, the document and the compiled model."""
    try:
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise ModelSyntaxError(f"the MjSpec does not compile: {one_line(error)}") from error
    with all_digits():
        text = spec.to_xml()
    xml = read_whole(text, "the MjSpec", Path(spec.modelfiledir)).text
    return spec.modelname or "the MjSpec", xml, model


def same_model(a: mujoco.MjModel, b: mujoco.MjModel, but: tuple[str, ...] = ()) -> bool:
    """Return whether two compiled models are equal in every number, name and option.

    Where their files lie makes no difference, nor do values whose names begin with one of `but`.
    """
    return saved(a) == saved(b) or dict(_values_of(a, but)) == dict(_values_of(b, but))


def saved(model: mujoco.MjModel) -> bytes:
    """Return a compiled model as bytes."""
    buffer = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()


_NO_VALUES: Final = {"nbuffer", "signature"}
"""Of a compiled model: they go with the length of paths, and are lost in a pickle."""


def _values_of(
    part: object, but: tuple[str, ...], prefix: str = ""
) -> Iterator[tuple[str, object]]:
    for name in dir(part):
        if (prefix + name).startswith(but):
            continue
        value = getattr(part, name)
        if name.startswith("_") or callable(value) or "path" in name or name in _NO_VALUES:
            continue
        if isinstance(value, np.ndarray):
            yield prefix + name, (value.shape, value.tobytes())
        elif isinstance(value, int | float | bytes):
            yield prefix + name, value
        else:
            yield from _values_of(value, but, f"{prefix}{name}.")
