"""Engines: the loop compiled by Numba, or the reference loop in Python."""

import logging
from typing import TYPE_CHECKING, Literal, get_args

from mjcartpole.envs.backend import Backend
from mjcartpole.errors import check_known
from mjcartpole.packages import is_installed, missing
from mjcartpole.task import CARTPOLE_V1, Task

if TYPE_CHECKING:
    from mjcartpole.physics.cartpole import CartPole

Engine = Literal["compiled", "python"]
"""`compiled`: the loop compiled by Numba; `python`: the same in Python. They give the same bits."""

_log = logging.getLogger("mjcartpole")
_said: set[str] = set()


def check_engine(engine: str) -> None:
    """Refuse an engine that does not exist (ConfigError)."""
    check_known("engine", engine, get_args(Engine))


def choose_engine(
    engine: str, backend: Backend, cartpole: "CartPole | None" = None, task: Task = CARTPOLE_V1
) -> Engine:
    """Return the engine that was asked for, or the reference loop where that one cannot run.

    Logs one line, once, where the reference loop takes over. The model is given where it is known
    and the backend is mujoco.

    Raises:
        ConfigError: There is no such engine.
    """
    check_engine(engine)
    if engine == "python":
        return "python"
    why_not = _why_not_compiled(backend, cartpole, task)
    if not why_not:
        return "compiled"
    if why_not not in _said:
        _said.add(why_not)
        _log.warning(
            "the compiled engine cannot run here (%s); the Python engine takes over: "
            "the same results, later",
            why_not,
        )
    return "python"


def _why_not_compiled(backend: Backend, cartpole: "CartPole | None", task: Task) -> str:
    if not is_installed("numba"):
        return missing("it", "numba")
    try:
        # Numba is heavy, and refuses to be imported beside a NumPy that is newer than it knows.
        from mjcartpole.learning import compiled  # noqa: PLC0415
    except (ImportError, OSError) as error:
        return f"Numba does not work: {error}"
    return compiled.unavailable(backend, cartpole, task)
