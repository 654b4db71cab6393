"""Unmodelled effects: everything in a model that acts on its motion beyond the equations.

Where nothing is left out, MuJoCo and `equations` with the model's parameters must agree.
"""

from collections.abc import Iterator, Sequence
from typing import Final

import mujoco
import numpy as np

from mjcartpole.errors import ModelError
from mjcartpole.physics import equations
from mjcartpole.physics.bodies import moving_bodies
from mjcartpole.physics.cartpole import CartPole, with_options
from mjcartpole.physics.deviations import deviations
from mjcartpole.physics.engine_check import unexplained_forces
from mjcartpole.physics.equations import Parameters
from mjcartpole.physics.file_steps import file_step, method_of
from mjcartpole.physics.free_region import FreeRegion, free_region, wide_box
from mjcartpole.physics.parameters import (
    can_push,
    is_on,
    joint_label,
    label,
    read_parameters,
    several_poles,
)
from mjcartpole.physics.simulation import Simulation
from mjcartpole.task import CARTPOLE_V1, Task

Effect = tuple[str, str]
"""The kind of force by which it acts (MuJoCo's `qfrc_…`), and a phrase that names it."""

_ENOUGH_ITERATIONS: Final = 10
"""Of Newton's method, for two joints that grip or slide."""

_SEEN_AT_ONCE: Final = {"qfrc_gravcomp", "qfrc_fluid"}
"""Kinds that act in every state or in none."""

_STEPS: Final = 64

_SAME_STEP: Final = 1e-9
"""Of the values of a step, relative: more than rounding, less than another integrator's."""


def beyond_equations(cartpole: CartPole, *, task: Task = CARTPOLE_V1) -> list[str]:
    """Name everything in a model that acts on its motion and is not in the equations.

    What a flag of the file switches off, or what cannot act (a tendon without stiffness, the
    reference angle of a spring without stiffness), is not listed, nor what is met only outside
    the limits that end an episode, as a joint's range and geoms that collide may be. Whether
    anything acts is seen in the engine's own forces; the names are those of the usual effects.
    """
    if cartpole.poles > 1:
        return [several_poles(cartpole)]
    region = free_region(cartpole, task=task)
    named = [*region.blocked, *_turning_slider(cartpole)]
    effects = [*_joints(cartpole), *_actuator(cartpole), *_ties(cartpole), *_surroundings(cartpole)]
    named += [phrase for _, phrase in effects]
    if region.blocked or (named and not effects):
        return named
    try:
        p = read_parameters(cartpole)
    except ModelError as error:
        return [*named, str(error)]
    known = {kind for kind, _ in effects}
    unknown = unexplained_forces(cartpole, p, region)
    idle = {phrase for kind, phrase in effects if kind in _SEEN_AT_ONCE - set(unknown)}
    named = [phrase for phrase in named if phrase not in idle]
    # Passive forces are the sum of several kinds, of which each is looked at.
    if {"qfrc_passive"} < set(unknown):
        known.add("qfrc_passive")
    return named + [phrase for kind, phrase in unknown.items() if kind not in known]


def beyond_step(
    cartpole: CartPole,
    method: str = "Euler",
    beyond: Sequence[str] | None = None,
    *,
    task: Task = CARTPOLE_V1,
) -> list[str]:
    """Say why one step of the file's own integrator is not that of one of `file_steps.METHODS`.

    One phrase each; none where the steps are the same, as those of two methods are where little
    turns or brakes. `beyond` is what `beyond_equations` names, where it has been asked already.
    """
    named = f"integrator {method_of(cartpole)} instead of {method}"
    beyond = beyond_equations(cartpole, task=task) if beyond is None else beyond
    if beyond:
        return [] if cartpole.integrator in {"Euler", "implicitfast", method} else [named]
    # A joint that slides steps alike; only one that grips shows it.
    if cartpole.integrator == "discrete" and cartpole.model.dof_frictionloss.any():
        return ["friction that the integrator discrete solves in its own way"]
    return [] if _steps_as(cartpole, method, free_region(cartpole, task=task)) else [named]


def _steps_as(cartpole: CartPole, method: str, region: FreeRegion) -> bool:
    p, rng = read_parameters(cartpole), np.random.default_rng(0)
    low, high = region.box(wide_box(region.task))
    states = rng.uniform(low, high, (_STEPS, 4))
    states = states[region.holds_for_a_step(states, p)]
    actions = rng.integers(2, size=len(states))
    simulation = Simulation(with_options(cartpole), "mujoco")
    simulation.model.opt.tolerance = 0.0
    found = simulation.steps(states, np.array(cartpole.controls)[actions])
    expected = file_step(p, states, np.array(p.forces)[actions], method)
    scale = np.maximum(1.0, np.abs(expected).max(axis=0, initial=0.0))
    return bool((np.abs(found - expected) <= _SAME_STEP * scale).all())


def overridden_masses(cartpole: CartPole) -> list[str]:
    """Return masses that the document gives to geoms and that an explicit `<inertial>` overrides.

    They change nothing in the motion, whatever the person who wrote them expected. One phrase
    each; none if the document cannot be read alone.
    """
    try:
        spec = mujoco.MjSpec.from_string(cartpole.xml)
    except ValueError:
        return []
    if spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE:
        return []
    return [
        f"mass {geom.mass:g} of geom '{geom.name}', which the <inertial> of body '{body.name}' "
        "overrides"
        for body in spec.bodies
        if body.explicitinertial
        for geom in body.geoms
        if geom.mass > 0
    ]


def differs_from(
    cartpole: CartPole, reference: Parameters = equations.CARTPOLE_V1, *, task: Task = CARTPOLE_V1
) -> list[str]:
    """Name all by which a model moves differently from a reference, one phrase each."""
    beyond = beyond_equations(cartpole, task=task)
    steps = beyond_step(cartpole, beyond=beyond, task=task)
    if cartpole.poles > 1:
        return beyond + steps
    try:
        found = [deviation.phrase for deviation in deviations(cartpole, reference)]
    except ModelError as error:
        found = [str(error)]
    region = free_region(cartpole, task=task)
    met = [] if region.covers_task or region.blocked else region.bounds
    return [*found, *met, *beyond, *steps]


def idle_numbers(cartpole: CartPole, *, task: Task = CARTPOLE_V1) -> list[str]:
    """Name numbers in a model of one pole that no episode feels, whatever was meant by them."""
    model, bit, region = cartpole.model, mujoco.mjtDisableBit, free_region(cartpole, task=task)
    found = list(region.bounds) if region.covers_task else []
    for joint in cartpole.joints:
        for what, values, flag in (
            ("damping", model.dof_damping, bit.mjDSBL_DAMPER),
            ("stiffness", model.jnt_stiffness, bit.mjDSBL_SPRING),
            ("friction loss", model.dof_frictionloss, bit.mjDSBL_FRICTIONLOSS),
        ):
            if values[joint] and not is_on(model, flag):
                name = joint_label(model, joint)
                found.append(f"{what} of {name}, switched off by an option flag")
    if cartpole.integrator != "Euler" and not beyond_step(cartpole, task=task):
        found.append(f"integrator {cartpole.integrator}, whose steps are Euler's here")
    if not is_on(model, bit.mjDSBL_GRAVITY) and model.opt.gravity.any():
        found.append("gravity, switched off by an option flag")
    return found + overridden_masses(cartpole)


def _turning_slider(cartpole: CartPole) -> Iterator[str]:
    model, joint = cartpole.model, cartpole.hinges[0]
    if model.jnt_bodyid[cartpole.slider] == model.jnt_bodyid[joint] and joint < cartpole.slider:
        slider, hinge = (joint_label(model, each) for each in (cartpole.slider, joint))
        yield f"slide axis of {slider} turns with the pole: {hinge} comes first in the same body"


def _inexact_solver(model: mujoco.MjModel) -> str:
    """Say why MuJoCo's solver does not find the equations' dry friction; empty if it does."""
    solver = mujoco.mjtSolver(int(model.opt.solver))
    if solver != mujoco.mjtSolver.mjSOL_NEWTON:
        return f"the solver {solver.name.removeprefix('mjSOL_')}"
    if model.opt.noslip_iterations:
        return f"{model.opt.noslip_iterations} noslip iterations"
    for name in ("iterations", "ls_iterations"):
        if getattr(model.opt, name) < _ENOUGH_ITERATIONS:
            return f"a solver that ends after {getattr(model.opt, name)} {name}"
    return ""


def _joints(cartpole: CartPole) -> Iterator[Effect]:
    """Yield springs, damping that is not viscous, and dry friction that is not solved exactly."""
    model, bit = cartpole.model, mujoco.mjtDisableBit
    solver = _inexact_solver(model)
    constrained = is_on(model, bit.mjDSBL_CONSTRAINT, bit.mjDSBL_FRICTIONLOSS)
    for joint in cartpole.joints:
        name = joint_label(model, joint)
        if model.dof_frictionloss[joint] and constrained and solver:
            yield "qfrc_constraint", f"friction loss in {name} by {solver}"
        spring = model.jnt_stiffness[joint] or model.jnt_stiffnesspoly[joint].any()
        if spring and is_on(model, bit.mjDSBL_SPRING):
            yield "qfrc_spring", f"spring (stiffness) in {name}"
        if model.dof_dampingpoly[joint].any() and is_on(model, bit.mjDSBL_DAMPER):
            yield "qfrc_damper", f"damping of {name} is not proportional to the velocity"


def _actuator(cartpole: CartPole) -> Iterator[Effect]:
    """Yield what makes the motor more than a force, or a brake proportional to the velocity."""
    model, motor = cartpole.model, cartpole.motor
    if not can_push(cartpole):
        return
    name = label(model, mujoco.mjtObj.mjOBJ_ACTUATOR, motor)
    affine = model.actuator_biastype[motor] == mujoco.mjtBias.mjBIAS_AFFINE
    if affine and model.actuator_biasprm[motor, 1]:
        yield "qfrc_actuator", f"spring (a servo's feedback of the position) of {name}"
    if affine and model.actuator_biasprm[motor, 2]:
        if model.actuator_forcelimited[motor] or model.jnt_actfrclimited[cartpole.slider]:
            yield "qfrc_actuator", f"a force range that may clip the velocity feedback of {name}"
        if model.actuator_biasprm[motor, 2] > 0:
            yield "qfrc_actuator", f"velocity feedback of {name} that speeds the cart up"
    if model.actuator_delay[motor] > 0:
        yield "qfrc_actuator", f"delay of {name}"
    if model.actuator_dampingpoly[motor].any():
        yield "qfrc_damper", f"damping of {name} is not proportional to the velocity"


def _ties(cartpole: CartPole) -> Iterator[Effect]:
    """Yield equality constraints, tendons, deformable things and plugins."""
    model, bit = cartpole.model, mujoco.mjtDisableBit
    if is_on(model, bit.mjDSBL_EQUALITY, bit.mjDSBL_CONSTRAINT):
        for index in np.flatnonzero(model.eq_active0).tolist():
            name = label(model, mujoco.mjtObj.mjOBJ_EQUALITY, index, "")
            yield "qfrc_constraint", f"equality constraint {name}"
    acting = ("stiffness", "stiffnesspoly", "damping", "dampingpoly", "frictionloss", "armature")
    for tendon in range(model.ntendon):
        values = [getattr(model, f"tendon_{name}")[tendon] for name in (*acting, "limited")]
        if any(np.any(value) for value in values):
            yield "qfrc_spring", label(model, mujoco.mjtObj.mjOBJ_TENDON, tendon)
    for flex in range(model.nflex):
        yield "qfrc_passive", label(model, mujoco.mjtObj.mjOBJ_FLEX, flex)
    for plugin in sorted({*model.body_plugin.tolist(), *model.actuator_plugin.tolist()} - {-1}):
        yield "qfrc_passive", label(model, mujoco.mjtObj.mjOBJ_PLUGIN, plugin)


def _surroundings(cartpole: CartPole) -> Iterator[Effect]:
    """Yield bodies without weight, air or water, and sleep."""
    model = cartpole.model
    weighs = model.opt.gravity.any() and is_on(model, mujoco.mjtDisableBit.mjDSBL_GRAVITY)
    for body in moving_bodies(cartpole):
        if model.body_gravcomp[body] and weighs:
            name = label(model, mujoco.mjtObj.mjOBJ_BODY, body)
            yield "qfrc_gravcomp", f"gravity compensation of {name}"
    for name in ("density", "viscosity"):
        if getattr(model.opt, name):
            wind = " and wind" if model.opt.wind.any() else ""
            yield (
                "qfrc_fluid",
                f"a fluid around it (option {name} {getattr(model.opt, name):g}{wind})",
            )
    sleepless = {mujoco.mjtSleepPolicy.mjSLEEP_AUTO_NEVER, mujoco.mjtSleepPolicy.mjSLEEP_NEVER}
    may_sleep = model.opt.enableflags & int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    if may_sleep and not set(model.tree_sleep_policy.tolist()) <= set(map(int, sleepless)):
        yield "", "sleeping of what is at rest (option flag)"
