"""The rungs, in order."""

from collections.abc import Callable, Iterator, Sequence

from mjcartpole.errors import ConfigError
from mjcartpole.studies.parity.case import Subject
from mjcartpole.studies.parity.convergence import convergence
from mjcartpole.studies.parity.dynamics import accelerations, step_gym, step_mujoco
from mjcartpole.studies.parity.engine_check import dm_control
from mjcartpole.studies.parity.interface import interface
from mjcartpole.studies.parity.learning import learning
from mjcartpole.studies.parity.result import Result
from mjcartpole.studies.parity.rules import boundaries
from mjcartpole.studies.parity.trajectories import closed_loop, horizon

RUNGS: dict[int, Callable[[Subject], Result]] = {
    1: interface,
    2: accelerations,
    3: step_gym,
    4: step_mujoco,
    5: boundaries,
    6: horizon,
    7: closed_loop,
    8: learning,
    9: convergence,
    10: dm_control,
}


def check_rungs(rungs: Sequence[int]) -> None:
    """Refuse rungs that the ladder does not have (ConfigError)."""
    unknown = sorted(set(rungs) - set(RUNGS))
    if unknown or not rungs:
        raise ConfigError(
            f"the ladder has no rung {', '.join(map(str, unknown)) or '(none given)'}; "
            f"available: {', '.join(map(str, RUNGS))}"
        )


def run_ladder(subject: Subject, rungs: Sequence[int] = tuple(RUNGS)) -> Iterator[Result]:
    """Climb: yield one result per rung, as it is found; each is the same alone as among others.

    Raises:
        ConfigError: There is no such rung.
    """
    check_rungs(rungs)
    for number in sorted(set(rungs)):
        yield RUNGS[number](subject)
