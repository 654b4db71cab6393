"""Sanity checks: numbers that no simulation survives are refused before anything is simulated."""

import functools
import itertools
from collections.abc import Iterator
from operator import attrgetter
from typing import Final

import mujoco
import numpy as np

from mjcartpole.errors import ModelError
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.library import one_line

MOST_MEMORY: Final = 2**29
"""Bytes that a model may ask for, for contacts and constraints."""

LARGEST_MODEL: Final = 2**28
"""Bytes of a compiled model, of which there are several copies in a process."""

MOST_OBJECTS: Final = 5_000
"""Bodies, joints, geoms, sites and all else that may have a name."""

_MAY_BE_INFINITE: Final = {"jnt_range", "tendon_range"}
"""People write -inf and inf for a joint that turns freely; no limit is reached then."""

MOST_ITERATIONS: Final = 10_000
"""Of a solver, per step."""

MOST_FACETS: Final = 512
"""Of a sphere or a plane, in each direction; 28 is MuJoCo's default."""

_ASIDE: Final = 0.05
"""Every coordinate and velocity of a state that is not at rest, SI units."""


def check_numbers(name: str, model: mujoco.MjModel) -> None:
    """Refuse numbers that no simulation survives, before anything is computed with them.

    Raises:
        ModelError: A number is NaN or infinite, or asks for endless work or memory.
    """
    for amount, most, words in _amounts(model):
        if amount > most:
            raise ModelError(f"{name} {words}")
    if not model.opt.timestep > 0:
        raise ModelError(f"{name} has a timestep of {model.opt.timestep:g} s; use 0.02")
    fields = _float_fields()
    if np.isfinite(np.concatenate(attrgetter(*fields)(model), axis=None)).all():
        return
    for field in fields:
        values = attrgetter(field)(model)
        bad = np.isnan(values) if field in _MAY_BE_INFINITE else ~np.isfinite(values)
        if bad.any():
            part, _, named = field.rpartition(".")
            raise ModelError(
                f"{name} has a number that is NaN or infinite ({named} of MuJoCo's "
                f"{part or 'model'}); look for nan, inf and numbers far too large"
            )


def _amounts(model: mujoco.MjModel) -> Iterator[tuple[int, int, str]]:
    """Yield what a model has or asks for, the most that is taken, and what is wrong with more."""
    sizes = "memory, njmax and nconmax of <size>"
    for has, most, what, where in (
        (model.narena, MOST_MEMORY, "bytes of working memory", sizes),
        (model.nbuffer, LARGEST_MODEL, "bytes once compiled", "textures, meshes, height fields"),
        # A map has twice as many places.
        (model.nnames_map // 2, MOST_OBJECTS, "bodies, geoms and other parts", "counts"),
    ):
        yield has, most, f"has {has:,} {what}; no more than {most:,} are taken: look at {where}"
    for field in ("iterations", "ls_iterations", "noslip_iterations", "ccd_iterations"):
        asked, most = getattr(model.opt, field), MOST_ITERATIONS
        yield asked, most, f"asks for {asked} {field} in each step; no more than {most} are done"
    for field in ("numslices", "numstacks", "numquads"):
        asked, most = getattr(model.vis.quality, field), MOST_FACETS
        drawn = f"has its pictures drawn with {asked} {field}; no more than {most} are drawn"
        yield asked, most, f"{drawn}: look at <visual><quality>"


def check_motion(cartpole: CartPole, data: mujoco.MjData) -> None:
    """Refuse a model whose first step already ends in nonsense; overwrites `data`.

    Raises:
        ModelError: MuJoCo gives up, or an acceleration is no number.
    """
    name, model = cartpole.name, cartpole.model
    for control, start in itertools.product(cartpole.controls, (0.0, _ASIDE)):
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:], data.ctrl[0] = start, start, control
        try:
            mujoco.mj_forward(model, data)
        except mujoco.FatalError as error:
            raise ModelError(f"MuJoCo gives up on {name}: {one_line(error)}") from error
        if not np.isfinite(data.qacc).all():
            raise ModelError(
                f"{name} moves off with an acceleration that is NaN or infinite "
                f"(control {control:g}); look for tiny masses, huge forces, damping and distances"
            )


@functools.cache
def _float_fields() -> tuple[str, ...]:
    """Return where a model has numbers, such as "opt.gravity", whatever this MuJoCo has there."""
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    owners = {"": model, "opt.": model.opt, "stat.": model.stat}
    names = [part + name for part, owner in owners.items() for name in dir(owner)]
    return tuple(name for name in names if np.asarray(attrgetter(name)(model)).dtype.kind == "f")
