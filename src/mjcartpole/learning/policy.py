"""A greedy policy from a Q-table, and its file.

The file is JSON: a format, a version, a checksum, the grid and the table. It holds numbers alone,
so reading it runs no code. Floats are written so that they read back bit for bit.
"""

import dataclasses
import hashlib
import json
import os
import reprlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError, PolicyFileError
from mjcartpole.files import brief, read_bytes, write_whole
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.stored import checked, parse
from mjcartpole.learning.tiles import Tiles, greedy, pair_at, tiles_of
from mjcartpole.task import N_ACTIONS, in_words, state_names

FORMAT = "mjcartpole-policy"
VERSION = 1
"""Of a file with one grid of bins."""

_MOST_BYTES: Final = 2**26
"""The largest table, with all digits, takes 56 MB."""

_FIELDS: Final = {
    "format": str,
    "version": int,
    "sha256": str,
    "bins": tuple[int, ...],
    "low": tuple[float, ...],
    "high": tuple[float, ...],
    "q_table": tuple[tuple[float, ...], ...],
}
_MORE_FIELDS: Final[dict[int, dict[str, type]]] = {
    VERSION: {},
    2: {"tilings": int, "mirror": bool},
    3: {"interpolated": bool, "mirror": bool},
    4: {"tilings": int, "interpolated": bool, "mirror": bool, "actions": int},
}
"""What a file of each version has besides: of several tilings, of nodes, with actions seen."""


@dataclass(frozen=True, eq=False, repr=False)
class Policy:
    """Takes the better action of the observation's state; action 0 between equals.

    Attributes:
        discretizer: From observations to states.
        q_table: Action values, float64, shape (*bins, 2); of several tilings (tilings, *bins, 2).
        tiles: How those are summed, or interpolated between nodes; None for one grid of bins.
        choices: What `greedy` looks at: of one grid of bins the better action of each row, shape
            (n_states,), int64; else the flat table.
    """

    discretizer: Discretizer
    q_table: npt.NDArray[np.float64]
    tiles: Tiles | None = field(init=False)
    choices: npt.NDArray[Any] = field(init=False)

    def __post_init__(self) -> None:
        expected = (*self.discretizer.shape, N_ACTIONS)
        if self.q_table.shape != expected:
            raise ConfigError(
                f"a table for bins {self.discretizer.bins} has shape {expected}, "
                f"not {self.q_table.shape}"
            )
        if not np.isfinite(self.q_table).all():
            raise ConfigError(
                "a table's values must be finite; this one has NaN or infinity in it (if they grew "
                "while it was learned, take a smaller step size, discount or first value)"
            )
        object.__setattr__(self, "tiles", tiles_of(self.discretizer))
        choices = self.q_table.reshape(-1)
        if self.tiles is None:
            # The first maximum wins, as in numpy's argmax.
            choices = np.argmax(self.q_table.reshape(-1, N_ACTIONS), axis=1).astype(np.int64)
        object.__setattr__(self, "choices", choices)
        object.__setattr__(self, "_choices", choices.tolist())

    @classmethod
    def learned(cls, discretizer: Discretizer, values: npt.NDArray[np.float64]) -> "Policy":
        """Return the policy of a learner's greedy values, shape (n_rows, 2), which are copied.

        A mirrored grid of bins is written out; of several tilings the fold stays, for they are no
        mirror images of each other.
        """
        if discretizer.mirror and tiles_of(discretizer) is None:
            values = discretizer.unfolded(values)
            discretizer = dataclasses.replace(discretizer, mirror=False)
        return cls(discretizer, values.reshape(*discretizer.shape, N_ACTIONS).copy())

    def __call__(self, observation: npt.NDArray[np.float32] | Sequence[float]) -> int:
        """Action for an observation, one value per dimension of the grid."""
        values = observation.tolist() if isinstance(observation, np.ndarray) else observation
        choices: Any = self._choices  # type: ignore[attr-defined]
        return greedy(self.tiles, choices, self.discretizer(values), self.discretizer.grid.folding)

    def values(self, observation: npt.NDArray[np.float32]) -> tuple[float, float]:
        """Return the values of both actions for an observation."""
        s, mirrored = self.discretizer.folded(observation.tolist())
        left, right = pair_at(self.tiles, self.q_table.reshape(-1), s)
        return (float(right), float(left)) if mirrored else (float(left), float(right))

    def __repr__(self) -> str:
        grid = self.discretizer
        tilings = f"tilings={grid.tilings}, " if grid.tilings > 1 else ""
        kind, n = ("nodes", grid.n_rows) if grid.interpolated else ("states", grid.n_states)
        return f"Policy({tilings}bins={grid.bins}, {n:,} {kind})"

    def _repr_html_(self) -> str:
        from mjcartpole.learning.slices import choose_axes, slices  # noqa: PLC0415 - notebooks only
        from mjcartpole.media.notebook import with_picture, with_plot  # noqa: PLC0415

        grid, table = self.discretizer, self.q_table
        if (n := len(grid.bins) - grid.actions) % 2 or n < 4:
            return with_picture(repr(self), None)
        shown: tuple[Any, ...] = ("action", "advantage")
        return with_plot(
            repr(self), lambda: slices("", grid, table, choose_axes(grid), shown=shown)
        )

    @property
    def poles(self) -> int:
        """How many poles the observation has that the table is for."""
        return (len(self.discretizer.bins) - self.actions) // 2 - 1

    @property
    def actions(self) -> int:
        """How many actions before the table looks at."""
        return self.discretizer.actions

    def check_fits(self, poles: int, where: str, actions: int | None = None) -> None:
        """Refuse to play where the observation is another one than that of the table.

        Args:
            poles: How many there are.
            where: What a person calls the place.
            actions: How many actions before are seen there; None for as many as it looks at.

        Raises:
            ConfigError: See above.
        """
        n = len(self.discretizer.bins) - self.actions
        if actions is not None and actions != self.actions:
            raise ConfigError(
                f"the policy looks at {self.actions} actions before, and {where} shows {actions}; "
                f"play it with observe_actions={self.actions}"
            )
        if n != len(state_names(poles)):
            whole = n % 2 == 0 and self.poles > 0
            what = in_words(self.poles) if whole else f"observations of {n} values"
            raise ConfigError(
                f"the policy is for {what}, and {where} has {in_words(poles)}; train one there"
            )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the policy to a file, whole or not at all.

        Raises:
            FileError: The file cannot be written.
        """
        write_whole(path, _to_text(self))

    @classmethod
    def load(cls, path: str | os.PathLike[str], *, follow: bool = True) -> "Policy":
        """Read a policy.

        Args:
            path: Its file.
            follow: Take a link for the file that it leads to.

        Raises:
            PolicyFileError: The file is not there, is no policy, or was changed or damaged.
        """
        content = read_bytes(path, _MOST_BYTES, follow=follow, refusal=PolicyFileError)
        policy = _from_json(content, path)
        if _to_text(policy).encode() != content:
            raise PolicyFileError(
                f"policy file '{path}' is damaged or was edited: its checksum does not match; "
                "restore it from a copy, or train again"
            )
        return policy


def _to_text(policy: Policy) -> str:
    grid = policy.discretizer
    version = 3 if grid.interpolated else VERSION if grid.tilings == 1 else 2
    version = 4 if grid.actions else version
    content: dict[str, Any] = {
        "bins": list(grid.bins),
        "low": list(grid.low),
        "high": list(grid.high),
        **{name: getattr(grid, name) for name in _MORE_FIELDS[version]},
        "q_table": policy.q_table.reshape(-1, N_ACTIONS).tolist(),
    }
    checksum = hashlib.sha256(json.dumps(content).encode()).hexdigest()
    head = {"format": FORMAT, "version": version, "sha256": checksum}
    # One line per row of the table: a person can read it, a diff can show it.
    rows = ",\n".join(f"  {json.dumps(row)}" for row in content.pop("q_table"))
    lines = [f'"{key}": {json.dumps(value)},' for key, value in {**head, **content}.items()]
    return "{\n" + "\n".join(lines) + f'\n"q_table": [\n{rows}\n]\n}}\n'


def _from_json(content: bytes, path: str | os.PathLike[str]) -> Policy:
    try:
        document = parse(content)
    except ValueError as error:
        raise _no_policy(path, f"it is not JSON, or is cut off ({brief(error)})") from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise _no_policy(path, f'it lacks \'"format": "{FORMAT}"\'')
    if (version := document.get("version")) not in list(_MORE_FIELDS):
        *others, last = map(str, _MORE_FIELDS)
        raise PolicyFileError(
            f"policy file '{path}' has version {reprlib.repr(version)}; "
            f"this mjcartpole reads versions {', '.join(others)} and {last}"
        )
    try:
        checked(document, _FIELDS | _MORE_FIELDS[version])
        discretizer = Discretizer(
            bins=tuple(document["bins"]),
            low=tuple(float(value) for value in document["low"]),
            high=tuple(float(value) for value in document["high"]),
            **{name: document[name] for name in _MORE_FIELDS[version]},
        )
        table = np.array(document["q_table"], dtype=np.float64)
        return Policy(discretizer, table.reshape(*discretizer.shape, N_ACTIONS))
    except (ValueError, OverflowError) as error:
        raise PolicyFileError(f"policy file '{path}' is damaged: {brief(error)}") from error


def _no_policy(path: str | os.PathLike[str], why: str) -> PolicyFileError:
    return PolicyFileError(
        f"'{path}' is not a policy of mjcartpole: {why}; "
        "a policy is the policy.json of a run folder"
    )
