"""Parameters of a method: a dataclass for people, the same as plain numbers for its functions."""

import collections
import dataclasses
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, get_args, get_origin

from mjcartpole.errors import ConfigError
from mjcartpole.learning.discretizer import is_finite
from mjcartpole.rules import whole_number
from mjcartpole.task import Task


@dataclass(frozen=True, kw_only=True)
class Parameters:
    """What a method can be told; the base of each method's own."""

    episode: ClassVar[str] = "episode"
    """What one of its episodes is called."""
    interpolated: ClassVar[bool] = False
    """Whether its table has nodes instead of bins, and values in between."""

    def check_parameters(self) -> None:
        """Refuse values that make no sense (ConfigError)."""

    def check_world(self, poles: int, task: Task) -> None:
        """Refuse a number of poles, or rules, that the method is not for (ConfigError)."""

    def _check_shares(self, *names: str) -> None:
        for name in names:
            value = getattr(self, name)
            if not (is_finite(value) and 0 <= value <= 1):
                raise ConfigError(f"{name} must be a number from 0 to 1, not {value!r}")

    def _check_whole(self, name: str, least: int, most: int = 2**31) -> None:
        whole_number(name, getattr(self, name), least, most)

    def _check_positive(self, name: str) -> None:
        value = getattr(self, name)
        if not (is_finite(value) and value > 0):
            raise ConfigError(f"{name} must be a number above 0, not {value!r}")

    def _check_one_of(self, name: str, available: tuple[str, ...]) -> None:
        value = getattr(self, name)
        if value not in available:
            listed = " or ".join(map(repr, available))
            raise ConfigError(f"{name} must be {listed}, not {value!r}")


def numbers_class(parameters: type[Parameters], module: str) -> Any:
    """Return the NamedTuple of a method's parameters, as its functions see them, and `tiles`.

    The module is the method's `__name__`: Numba keeps compiled code under `<module>.Numbers`.
    """
    names = [field.name for field in dataclasses.fields(parameters)]
    return collections.namedtuple("Numbers", [*names, "tiles"], module=module)


def numbers_of(parameters: Any, numbers: Any, tiles: Any = None) -> Any:
    """Return parameters, or what has their fields, as numbers: of a choice its place, -1 for None.

    `numbers` is what `numbers_class` made; `tiles` are those of a table, None if it is one grid.
    """
    kinds = {field.name: field.type for field in dataclasses.fields(parameters)}
    names = (name for name in numbers._fields if name != "tiles")
    return numbers(*(_number(getattr(parameters, name), kinds[name]) for name in names), tiles)


def _number(value: Any, kind: Any) -> float:
    if get_origin(kind) is Literal:
        return get_args(kind).index(value)
    if value is None:
        return -1.0
    return value if kind in {bool, int} else float(value)
