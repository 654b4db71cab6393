"""A greedy policy from a Q-table, and its file.

The file is JSON: a format, a version, a checksum, the grid and the table. It holds numbers alone,
so reading it runs no code. Floats are written so that they read back bit for bit.
"""

import hashlib
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError, PolicyFileError
from mjcartpole.files import write_whole
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.task import N_ACTIONS, in_words

FORMAT = "mjcartpole-policy"
VERSION = 1


@dataclass(frozen=True, eq=False, repr=False)
class Policy:
    """Takes the better action of the observation's row; action 0 between equals.

    Attributes:
        discretizer: From observations to rows.
        q_table: Action values, shape (*bins, 2), float64.
        actions: The better action of each row, shape (n_states,), int64.
    """

    discretizer: Discretizer
    q_table: npt.NDArray[np.float64]
    actions: npt.NDArray[np.int64] = field(init=False)

    def __post_init__(self) -> None:
        expected = (*self.discretizer.bins, N_ACTIONS)
        if self.q_table.shape != expected:
            raise ConfigError(
                f"a table for bins {self.discretizer.bins} has shape {expected}, "
                f"not {self.q_table.shape}"
            )
        if not np.isfinite(self.q_table).all():
            raise ConfigError("a table's values must be finite; this one has NaN or infinity in it")
        # The first maximum wins, as in numpy's argmax.
        actions = np.argmax(self.q_table.reshape(-1, N_ACTIONS), axis=1).astype(np.int64)
        object.__setattr__(self, "actions", actions)
        object.__setattr__(self, "_actions", actions.tolist())

    def __call__(self, observation: npt.NDArray[np.float32] | Sequence[float]) -> int:
        """Action for an observation, one value per dimension of the grid."""
        values = observation.tolist() if isinstance(observation, np.ndarray) else observation
        action: int = self._actions[self.discretizer(values)]  # type: ignore[attr-defined]
        return action

    def __repr__(self) -> str:
        return f"Policy(bins={self.discretizer.bins}, {self.discretizer.n_states:,} states)"

    @property
    def poles(self) -> int:
        """How many poles the observation has that the table is for."""
        return len(self.discretizer.bins) // 2 - 1

    def check_fits(self, poles: int, where: str) -> None:
        """Refuse to play where the observation is another one than that of the table.

        Args:
            poles: How many there are.
            where: What a person calls the place.

        Raises:
            ConfigError: See above.
        """
        if self.poles != poles:
            raise ConfigError(
                f"the policy is for {in_words(self.poles)}, and {where} has {in_words(poles)}; "
                "train one there"
            )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the policy to a file, whole or not at all.

        Raises:
            FileError: The file cannot be written.
        """
        write_whole(path, _to_text(self))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> "Policy":
        """Read a policy.

        Raises:
            PolicyFileError: The file is not there, is no policy, or was changed or damaged.
        """
        try:
            text = Path(path).read_bytes().decode("utf-8")
        except OSError as error:
            raise PolicyFileError(
                f"policy file '{path}' cannot be read: {error.strerror}"
            ) from error
        except UnicodeDecodeError as error:
            raise _no_policy(path, "it is not text") from error
        policy = _from_text(text, path)
        if _to_text(policy) != text:
            raise PolicyFileError(
                f"policy file '{path}' is damaged or was edited: its checksum does not match; "
                "restore it from a copy, or train again"
            )
        return policy


def _to_text(policy: Policy) -> str:
    content: dict[str, Any] = {
        "bins": list(policy.discretizer.bins),
        "low": list(policy.discretizer.low),
        "high": list(policy.discretizer.high),
        "q_table": policy.q_table.reshape(-1, N_ACTIONS).tolist(),
    }
    checksum = hashlib.sha256(json.dumps(content).encode()).hexdigest()
    head = {"format": FORMAT, "version": VERSION, "sha256": checksum}
    # One line per row of the table: a person can read it, a diff can show it.
    rows = ",\n".join(f"  {json.dumps(row)}" for row in content.pop("q_table"))
    lines = [f'"{key}": {json.dumps(value)},' for key, value in {**head, **content}.items()]
    return "{\n" + "\n".join(lines) + f'\n"q_table": [\n{rows}\n]\n}}\n'


def _from_text(text: str, path: str | os.PathLike[str]) -> Policy:
    try:
        document: dict[str, Any] = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise _no_policy(path, "it is not JSON, or is cut off") from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise _no_policy(path, f'it lacks \'"format": "{FORMAT}"\'')
    if document.get("version") != VERSION:
        raise PolicyFileError(
            f"policy file '{path}' has version {document.get('version')}; "
            f"this mjcartpole reads version {VERSION}"
        )
    try:
        discretizer = Discretizer(
            bins=tuple(document["bins"]),
            low=tuple(float(value) for value in document["low"]),
            high=tuple(float(value) for value in document["high"]),
        )
        table = np.array(document["q_table"], dtype=np.float64)
        return Policy(discretizer, table.reshape(*discretizer.bins, N_ACTIONS))
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise PolicyFileError(f"policy file '{path}' is damaged: {error}") from error


def _no_policy(path: str | os.PathLike[str], why: str) -> PolicyFileError:
    return PolicyFileError(
        f"'{path}' is not a policy of mjcartpole: {why}; "
        "a policy is the policy.json of a run folder"
    )
