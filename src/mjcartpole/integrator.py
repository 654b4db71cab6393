"""Who moves the state from one step to the next."""

from typing import Literal, get_args

from mjcartpole.errors import ConfigError

Integrator = Literal["gym", "mujoco"]
"""`gym`: explicit Euler, as CartPole-v1 does it; `mujoco`: the integrator that the file names."""


def check_integrator(integrator: str) -> None:
    """Refuse an integrator that does not exist.

    Raises:
        ConfigError: See above.
    """
    if integrator not in get_args(Integrator):
        raise ConfigError(
            f"integrator {integrator!r} is unknown; available: {', '.join(get_args(Integrator))}"
        )
