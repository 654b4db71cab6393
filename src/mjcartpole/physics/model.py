"""Load an MJCF, check that it is a cart-pole, and find its parts.

A cart-pole is one slide joint (the cart's), one hinge joint below it (the pole's), and one
actuator that pushes along the slider. Names do not matter; structure does.
"""

import copy
import dataclasses
import difflib
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias
from xml.etree import ElementTree

import mujoco
import numpy as np

from mjcartpole import task
from mjcartpole.errors import ModelNotFoundError, ModelSyntaxError, NotACartPoleError

INTEGRATORS = ("Euler", "RK4", "implicit", "implicitfast")
"""As MJCF spells them, in the order of MuJoCo's mjtIntegrator."""


@dataclass(frozen=True)
class CartPole:
    """A compiled cart-pole and where its parts are.

    Attributes:
        name: What a person calls it: a model's name, a file's path.
        xml: The whole document as text; it compiles to the same model anywhere.
        model: The compiled model.
        slider: Index of the cart's joint in qpos and qvel.
        hinge: Index of the pole's joint in qpos and qvel.
        controls: The actuator's control for action 0 and for action 1.
        substeps: Physics steps per control step of 0.02 s.
    """

    name: str
    xml: str
    model: mujoco.MjModel
    slider: int
    hinge: int
    controls: tuple[float, float]
    substeps: int

    @property
    def timestep(self) -> float:
        """Seconds of one physics step."""
        return float(self.model.opt.timestep)

    @property
    def integrator(self) -> str:
        """The integrator that the file names, as MJCF spells it (see `INTEGRATORS`)."""
        return INTEGRATORS[int(self.model.opt.integrator)]


ModelLike: TypeAlias = str | os.PathLike[str] | mujoco.MjSpec | CartPole
"""What `load_model` takes: a name, a path, an XML document, an MjSpec, or a loaded cart-pole."""


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


def load_model(source: ModelLike = "cartpole", *, own_timestep: bool = False) -> CartPole:
    """Load a cart-pole.

    Args:
        source: The name of a shipped model (`"cartpole"`), the path of an MJCF file, an MJCF
            document as text (it starts with `<`), or an `mujoco.MjSpec`. A loaded cart-pole is
            returned as it is.
        own_timestep: Let a control step be one physics step of the file, however long, instead of
            as many as fill CartPole-v1's 0.02 s.

    Raises:
        ModelNotFoundError: There is no such name or file.
        ModelSyntaxError: MuJoCo does not accept the document.
        NotACartPoleError: It compiles, but is no cart-pole.
    """
    if isinstance(source, CartPole):
        return source
    if isinstance(source, mujoco.MjSpec):
        return _find_parts(*_from_spec(source), own_timestep)
    if isinstance(source, str) and source.lstrip().startswith("<"):
        name = "the XML document"
        return _find_parts(name, source, _compile(source, name), own_timestep)
    path = find_model(source)
    name = path.stem if path.parent == models_folder() else str(source)
    return _find_parts(name, *_from_file(path), own_timestep)


def with_options(
    cartpole: CartPole, *, timestep: float | None = None, integrator: str | None = None
) -> CartPole:
    """The same cart-pole with another timestep or integrator, one physics step per control step.

    For studies of integrators; the document stays as it was. Options are no geometry: changing
    them in a compiled model leaves no derived value stale.

    Args:
        cartpole: The cart-pole.
        timestep: Seconds.
        integrator: As MJCF spells it: Euler, RK4, implicit or implicitfast.
    """
    model = copy.copy(cartpole.model)
    if timestep is not None:
        model.opt.timestep = timestep
    if integrator is not None:
        model.opt.integrator = INTEGRATORS.index(integrator)
    return dataclasses.replace(cartpole, model=model, substeps=1)


def find_model(source: str | os.PathLike[str]) -> Path:
    """The file that a model's name or path stands for.

    Raises:
        ModelNotFoundError: There is no such name or file.
    """
    path = Path(source)
    if path.suffix == ".xml" or len(path.parts) > 1:
        if path.is_file():
            return path
        found = "is a folder" if path.is_dir() else "is not there"
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


def _from_file(path: Path) -> tuple[str, mujoco.MjModel]:
    """The document, whole, and the compiled model."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ModelNotFoundError(f"model file '{path}' cannot be read: {error}") from error
    model = _compile(text, str(path), path)
    return self_contained(text, path.parent), model


def _from_spec(spec: mujoco.MjSpec) -> tuple[str, str, mujoco.MjModel]:
    """Its name, the document and the compiled model."""
    try:
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise ModelSyntaxError(f"the MjSpec does not compile: {_one_line(error)}") from error
    # MuJoCo writes numbers with six digits: this text is for reading, `model` is what runs.
    return spec.modelname or "the MjSpec", spec.to_xml(), model


def _compile(text: str, name: str, path: Path | None = None) -> mujoco.MjModel:
    """Compile a document; a path lets it refer to other files beside it."""
    try:
        if path is None:
            return mujoco.MjModel.from_xml_string(text)
        return mujoco.MjModel.from_xml_path(str(path))
    except (ValueError, mujoco.FatalError) as error:
        raise ModelSyntaxError(f"{name} is not a valid MJCF: {_one_line(error)}") from error


def _one_line(error: Exception) -> str:
    message = " ".join(str(error).split())
    return message.removeprefix("XML Error: ").removeprefix("Error: ")


def same_model(a: mujoco.MjModel, b: mujoco.MjModel) -> bool:
    """Whether two compiled models are equal in every number, name and option."""
    return _bytes_of(a) == _bytes_of(b)


def _bytes_of(model: mujoco.MjModel) -> bytes:
    buffer = np.empty(mujoco.mj_sizeModel(model), dtype=np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()


def self_contained(text: str, folder: Path) -> str:
    """The document with the content of its `<include>` files in their place.

    A document without includes is returned as it is, to the last character.

    Raises:
        ModelSyntaxError: MuJoCo is lenient, but with includes the files must be well-formed XML.
    """
    if "<include" not in text:
        return text
    parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
    try:
        root = ElementTree.fromstring(text, parser)
        _expand_includes(root, folder)
    except (ElementTree.ParseError, OSError) as error:
        raise ModelSyntaxError(f"the includes cannot be put together: {error}") from error
    return ElementTree.tostring(root, encoding="unicode")


def _expand_includes(parent: ElementTree.Element, folder: Path) -> None:
    for index, child in reversed(list(enumerate(parent))):
        if child.tag == "include":
            included = ElementTree.parse(folder / child.get("file", "")).getroot()
            _expand_includes(included, folder)
            parent[index : index + 1] = list(included)
        else:
            _expand_includes(child, folder)


def _find_parts(name: str, xml: str, model: mujoco.MjModel, own_timestep: bool) -> CartPole:
    slider = _only_joint(name, model, mujoco.mjtJoint.mjJNT_SLIDE, "slide", "the cart's")
    hinge = _only_joint(name, model, mujoco.mjtJoint.mjJNT_HINGE, "hinge", "the pole's")
    if model.njnt != 2:
        raise _no_cart_pole(name, model, "a joint that is neither the cart's nor the pole's")
    if not _is_below(model, model.jnt_bodyid[hinge], model.jnt_bodyid[slider]):
        raise _no_cart_pole(name, model, "a hinge whose body is not inside the cart's body")
    return CartPole(
        name=name,
        xml=xml,
        model=model,
        slider=slider,
        hinge=hinge,
        controls=_controls(name, model, slider),
        substeps=1 if own_timestep else _substeps(name, model),
    )


def _only_joint(
    name: str, model: mujoco.MjModel, kind: mujoco.mjtJoint, word: str, whose: str
) -> int:
    """Index of the only joint of a kind; slide and hinge joints have one coordinate each."""
    found = [index for index in range(model.njnt) if model.jnt_type[index] == kind]
    if len(found) != 1:
        amount = f"{len(found)} {word} joints" if found else f"no {word} joint"
        raise _no_cart_pole(name, model, f"{amount} where one ({whose}) is needed")
    return found[0]


def _is_below(model: mujoco.MjModel, body: int, ancestor: int) -> bool:
    while body not in (0, ancestor):
        body = model.body_parentid[body]
    return bool(body == ancestor)


def _controls(name: str, model: mujoco.MjModel, slider: int) -> tuple[float, float]:
    """Controls of the two actions: the ends of the actuator's range, or -1 and 1 without one."""
    if model.nu != 1 or model.na != 0:
        amount = f"{model.nu} actuators" if model.nu else "no actuator"
        stateful = " with activation states" if model.na else ""
        raise _no_cart_pole(name, model, f"{amount}{stateful} where one plain motor is needed")
    joint_transmissions = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    pushes_joint = int(model.actuator_trntype[0]) in joint_transmissions
    if not pushes_joint or model.actuator_trnid[0, 0] != slider:
        raise _no_cart_pole(name, model, "an actuator that does not push along the slide joint")
    if not model.actuator_ctrllimited[0]:
        return -1.0, 1.0
    low, high = model.actuator_ctrlrange[0]
    return float(low), float(high)


def _substeps(name: str, model: mujoco.MjModel) -> int:
    timestep = float(model.opt.timestep)
    substeps = round(task.CONTROL_STEP / timestep)
    if substeps < 1 or abs(substeps * timestep - task.CONTROL_STEP) > 1e-12:
        raise NotACartPoleError(
            f"{name}: timestep {timestep:g} s does not divide the control step of "
            f"{task.CONTROL_STEP} s; use 0.02, 0.01, 0.005, 0.002 …"
        )
    return substeps


def _no_cart_pole(name: str, model: mujoco.MjModel, found: str) -> NotACartPoleError:
    kinds = [mujoco.mjtJoint(int(kind)).name for kind in model.jnt_type]
    joints = [
        f"{model.joint(index).name or 'unnamed'} ({kind.removeprefix('mjJNT_').lower()})"
        for index, kind in enumerate(kinds)
    ]
    actuators = [model.actuator(index).name or "unnamed" for index in range(model.nu)]
    return NotACartPoleError(
        f"{name} is not a cart-pole: it has {found} "
        f"[joints: {', '.join(joints) or 'none'}; actuators: {', '.join(actuators) or 'none'}]; "
        "needed are a slide joint for the cart, one hinge joint inside it, and one motor on the "
        "slide joint"
    )
