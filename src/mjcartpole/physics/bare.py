"""A model without what is for the eye alone: it moves alike, bit for bit, in less time."""

import dataclasses
from typing import Final

import mujoco
import numpy as np

from mjcartpole.physics.build import NAMES_FILE
from mjcartpole.physics.cache import remembered
from mjcartpole.physics.cartpole import CartPole, own_copy
from mjcartpole.physics.load import same_model, saved
from mjcartpole.physics.simulation import nothing_can_touch

_SEEN: Final = (
    *("geom_", "body_geom", "cam_", "light_", "mat_", "vis.", "stat.center", "stat.extent"),
    *("stat.meansize", "dof_length", "name", "ngeom", "ncam", "nlight", "nmat", "nnames"),
)
"""How those values of a compiled model begin that come of what is seen, and that no motion needs
where nothing touches and nothing sleeps."""


def bare(cartpole: CartPole) -> CartPole:
    """Return a cart-pole without geoms, cameras and lights, and without what finds no force.

    MuJoCo would place all of them in each step, and look for springs and dampers: a quarter of its
    time. Where another number of the model were to change, nothing is left out. The compiled model
    is shared by all, so nobody may change it.
    """
    if mujoco.get_mjcb_passive() is not None:
        return cartpole  # Somebody's own function may look at all there is.
    key = cartpole.xml, saved(cartpole.model)
    found = remembered(key, lambda: _bare(cartpole) or own_copy(cartpole))
    return dataclasses.replace(cartpole, model=found.model)


def _bare(cartpole: CartPole) -> CartPole | None:
    model = cartpole.model
    sleeps = model.opt.enableflags & int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    if sleeps or not nothing_can_touch(model) or model.geom_fluid.any():
        return None
    if NAMES_FILE.search(cartpole.xml):
        return None  # To read files once more may take long.
    try:
        found = _compiled_without(cartpole.xml)
    except (ValueError, mujoco.FatalError):
        return None
    if not same_model(found, model, but=_SEEN):
        return None
    if _has_no_passive_force(found):
        disable = mujoco.mjtDisableBit
        found.opt.disableflags |= int(disable.mjDSBL_SPRING | disable.mjDSBL_DAMPER)
    return dataclasses.replace(cartpole, model=found)


def _compiled_without(xml: str) -> mujoco.MjModel:
    spec = mujoco.MjSpec.from_string(xml)
    spec.compiler.discardvisual = True
    for each in (*spec.cameras, *spec.lights):
        spec.delete(each)
    return spec.compile()


def _has_no_passive_force(model: mujoco.MjModel) -> bool:
    """Return whether a model has no springs, dampers, fluid, lift against gravity or plugins."""
    kinds = ("stiffness", "damping", "gravcomp")
    forces = [getattr(model, name) for name in dir(model) if any(kind in name for kind in kinds)]
    others = model.opt.density, model.opt.viscosity, model.nplugin
    return not (any(others) or any(map(np.any, forces)))
