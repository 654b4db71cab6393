"""Packages that not every installation has, and what to type where one is missing."""

import importlib.util
from typing import Final

from mjcartpole.errors import ConfigError, MjCartPoleError

EXTRAS: Final = {
    "distributed": "dask",
    "matplotlib": "plot",
    "scipy": "scipy",
    "tensorboardX": "tensorboard",
}
"""Packages that come with an extra of ours; all others come with us, unless pip was told not to."""

_NAMES: Final = {"PIL": "pillow"}
"""What pip calls a package, where Python calls it otherwise."""


def is_installed(package: str) -> bool:
    """Return whether a package is there; it is not imported."""
    return importlib.util.find_spec(package) is not None


def missing(what: str, package: str) -> str:
    """Return what to type for the lack of a package, by the name by which it is imported.

    >>> missing("a plot", "matplotlib")
    "a plot needs the package matplotlib: pip install 'mjcartpole[plot]'"
    """
    name = _NAMES.get(package, package)
    source = f"'mjcartpole[{EXTRAS[package]}]'" if package in EXTRAS else name
    return f"{what} needs the package {name}: pip install {source}"


def check_installed(what: str, package: str, error: type[MjCartPoleError] = ConfigError) -> None:
    """Raise an error, a `ConfigError` unless told otherwise, where something lacks a package."""
    if not is_installed(package):
        raise error(missing(what, package))
