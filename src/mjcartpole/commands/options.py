"""What commands have in common: their base, and small groups of flags that they include.

Nothing here, or at the top of a command's file, imports MuJoCo or a video library: every `--help`
reads all of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Self, TypeVar

import tyro

from mjcartpole.errors import MjCartPoleError

RUNS = Path("runs")
VIDEOS = Path("videos")

T = TypeVar("T")
Included = Annotated[T, tyro.conf.arg(name=""), tyro.conf.OmitArgPrefixes]
"""A group of flags that become the command's own."""
OutputPath = Annotated[Path | None, tyro.conf.arg(aliases=["-o"])]
Policies = Annotated[
    tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN-OR-POLICY …")
]


class UsageError(MjCartPoleError):
    """The command line cannot be understood."""


@dataclass(frozen=True)
class Command:
    """A command: each field is a flag, each docstring its help.

    It is no `abc.ABC`: of those tyro asks a type checker, whose import costs a tenth of a `--help`.
    """

    @classmethod
    def default(cls, words: Sequence[str]) -> Self | None:
        """Return what is meant by flags that are left out; None: each has its own default.

        One flag among the words may decide the defaults of others.

        Raises:
            ConfigError: A word makes no sense.
        """
        return None

    @classmethod
    def explain(cls, words: Sequence[str]) -> str | None:
        """Return what is wrong with a command line that was not understood; None: tyro says it."""
        return None

    def run(self) -> int:
        """Do it, and return the exit code.

        Raises:
            MjCartPoleError: Something cannot be used; its message is all that is said of it.
            Interrupted: After Ctrl-C, SIGTERM or SIGHUP.
        """
        raise NotImplementedError
