"""An environment's specification in plain values: JSON can hold it, and a copy makes it again."""

import dataclasses
import os
from collections.abc import Mapping
from typing import Any

from gymnasium import logger
from gymnasium.envs.registration import EnvSpec

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.envs.editable import Editable
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.load import is_its_document
from mjcartpole.rewards import named
from mjcartpole.task import Task


class PortableSpec:
    """Has gymnasium's specification of an environment, in plain values."""

    _model: Editable
    _spec: EnvSpec | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """Gymnasium's specification; it says in JSON what makes the same environment again."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = spec and portable(spec, self._model.base)


def portable(spec: EnvSpec, cartpole: CartPole) -> EnvSpec:
    """A specification, as gymnasium makes it, whose arguments are numbers, texts, lists and dicts.

    A model that is no name, path or text is there as the document that the environment made of it,
    edits included.
    """
    task = spec.kwargs.get("task")
    changes = task.changes if isinstance(task, Task) else {}
    # Gymnasium's own time limit has that.
    changes.pop("max_episode_steps", None)
    arguments = {name: _plain(value) for name, value in {**changes, **spec.kwargs}.items()}
    if not isinstance(arguments.get("model", ""), str):
        arguments["model"] = cartpole.xml
        arguments.pop("edits", None)
        if cartpole.has_own_timestep:
            arguments["own_timestep"] = True
        if not is_its_document(cartpole):
            logger.warn(
                f"env.spec has the document of {cartpole.name}, which compiles to another model: "
                "numbers of the model were changed after compiling, or written with fewer digits"
            )
    if all(arguments.get(name) is value for name, value in spec.kwargs.items()):
        return spec
    return dataclasses.replace(spec, kwargs=arguments)


def _plain(value: Any) -> Any:  # noqa: ANN401 - whatever it is
    value = value.given if isinstance(value, Disturbances) else value
    if isinstance(value, Task):
        return value.name
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, Mapping):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(map(_plain, value))
    return named(value)
