"""Ranges: what an episode draws a number from."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final, NamedTuple

from mjcartpole.errors import ConfigError

LOG: Final = "log"
"""The word for a range whose logarithm is uniform."""


NOTHING: Final = "none"
"""The word for no range, where there were some."""


class Range(NamedTuple):
    """What one number of a model is drawn from.

    Attributes:
        name: What `--set` calls it.
        bounds: Two numbers to draw uniformly between, or several to choose from.
        kind: uniform, log or choice.
    """

    name: str
    bounds: tuple[float, ...]
    kind: str

    @property
    def text(self) -> str:
        """As a person writes it."""
        numbers = [repr(each).removesuffix(".0") for each in self.bounds]
        if self.kind == "choice":
            return f"{self.name}={','.join(numbers)}"
        return f"{self.name}={':'.join(numbers)}{':log' if self.kind == LOG else ''}"

    def at(self, share: float) -> float:
        """Return the number at a share of the range, from 0 up to 1: a uniform share draws it."""
        if self.kind == "choice":
            return self.bounds[min(int(share * len(self.bounds)), len(self.bounds) - 1)]
        low, high = self.bounds
        if self.kind == LOG:
            return min(max(low * math.pow(high / low, share), low), high)
        return low + (high - low) * share

    def narrowed(self, share: float, width: float) -> float:
        """Return a share of the range, drawn from all of it, within the middle part of a width.

        Of a choice it is the first part.
        """
        if self.kind != "choice":
            return 0.5 + width * (share - 0.5)
        n = len(self.bounds)
        return share * math.ceil(width * n) / n


def parse_ranges(ranges: object) -> tuple[Range, ...]:
    """Return ranges that are given as texts, or by name.

    >>> parse_ranges({"pole.length": (0.5, 1.5)})[0].text
    'pole.length=0.5:1.5'

    Texts are such as "pole.length=0.5:1.5"; a mapping has by name two numbers, two numbers and
    "log", more numbers to choose from, or what stands behind the "=".

    Raises:
        ConfigError: One makes no sense, or two are of the same name.
    """
    if isinstance(ranges, Mapping):
        found = tuple(_from_value(name, value) for name, value in ranges.items())
    else:
        texts = [ranges] if isinstance(ranges, str) or not isinstance(ranges, Iterable) else ranges
        found = () if list(texts) == [NOTHING] else tuple(_from_text(text) for text in texts)
    names = [each.name for each in found]
    for name in names:
        if names.count(name) > 1:
            raise ConfigError(f"{name!r} varies twice; give one range")
    return found


def _from_text(text: object) -> Range:
    if isinstance(text, Range):
        return text
    name, equals, value = text.partition("=") if isinstance(text, str) else ("", "", "")
    if not equals or not name.strip() or not value.strip():
        raise _none(text)
    return _from_value(name.strip(), value.strip())


def _from_value(name: object, value: Any) -> Range:  # noqa: ANN401 - to be checked
    if not isinstance(name, str):
        raise ConfigError(f"what varies is called by a text such as 'pole.length', not {name!r}")
    asked = f"{name}={value}"
    if isinstance(value, str):
        is_choice = ":" not in value
        parts: Sequence[Any] = value.split("," if is_choice else ":")
    elif isinstance(value, Iterable) and not isinstance(value, Mapping):
        parts = list(value)
        is_choice = LOG not in parts and len(parts) != 2
    else:
        parts, is_choice = [value], True
    is_log = not is_choice and len(parts) == 3 and parts[2] == LOG
    numbers = tuple(_number(asked, part) for part in (parts[:2] if is_log else parts))
    return _checked(Range(name, numbers, "choice" if is_choice else LOG if is_log else "uniform"))


def _number(asked: str, part: Any) -> float:  # noqa: ANN401 - to be checked
    try:
        if isinstance(part, bool):
            raise TypeError
        number = float(part)
    except (TypeError, ValueError, OverflowError):
        raise _none(asked) from None
    if not math.isfinite(number):
        raise ConfigError(f"vary {asked!r} is to be of finite numbers")
    return number + 0.0


def _checked(found: Range) -> Range:
    if not found.bounds or (found.kind != "choice" and len(found.bounds) != 2):
        raise _none(found.text)
    if found.kind != "choice":
        low, high = found.bounds
        if low > high:
            raise ConfigError(f"vary {found.text!r} runs backwards; give the lower end first")
        if not math.isfinite(high - low):
            raise ConfigError(f"vary {found.text!r} is too wide for a number")
        if found.kind == LOG and low <= 0:
            raise ConfigError(f"vary {found.text!r}: a logarithm needs numbers above 0")
    return found


def _none(asked: object) -> ConfigError:
    return ConfigError(
        f"vary {asked!r} is no range; give NAME=LOW:HIGH, NAME=LOW:HIGH:log or NAME=A,B,C such as "
        "pole.length=0.5:1.5"
    )
