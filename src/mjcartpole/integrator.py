"""Who moves the state from one step to the next."""

from typing import Literal, get_args

from mjcartpole.errors import check_known

Integrator = Literal["gym", "mujoco"]
"""`gym`: explicit Euler, as CartPole-v1 does it; `mujoco`: the integrator that the file names."""


def check_integrator(integrator: str) -> None:
    """Refuse an integrator that does not exist (ConfigError)."""
    check_known("integrator", integrator, get_args(Integrator))
