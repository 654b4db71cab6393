"""Every error that mjcartpole raises on purpose.

    MjCartPoleError
    ├── ConfigError            a setting that makes no sense (also a ValueError)
    │   └── SettingError           an attribute that an env lacks, or that cannot be set (also an
    │                              AttributeError)
    ├── ModelError             an MJCF that cannot be used (also a ValueError)
    │   ├── ModelNotFoundError     no such name or file
    │   ├── ModelSyntaxError       MuJoCo does not accept the document
    │   └── NotACartPoleError      it compiles, but is no cart-pole
    ├── StepError              an env used in a way that its rules refuse
    │   ├── InvalidActionError     an action outside Discrete(2) (also an AssertionError)
    │   └── ResetNeededError       a step before the first reset (also an AssertionError)
    ├── SimulationError        the physics diverged
    ├── FileError              a file or folder that cannot be read or written
    │   ├── PolicyFileError        no policy, or a damaged one
    │   └── RunError               a run folder that is missing, incomplete, in use or in the way
    │       └── CheckpointError        a checkpoint that is damaged, or of another training
    └── RenderError            no picture or no video can be made

A message says what was asked, what was found, what is available and the next step, in one line.
"""

import difflib
from collections.abc import Iterable


class MjCartPoleError(Exception):
    """Base of all errors of this package."""


class ConfigError(MjCartPoleError, ValueError):
    """A setting makes no sense."""


class SettingError(ConfigError, AttributeError):
    """An attribute that an environment lacks, or that cannot be read or set."""


class ModelError(MjCartPoleError, ValueError):
    """An MJCF model cannot be used."""


class ModelNotFoundError(ModelError):
    """No model has this name, or no file this path."""


class ModelSyntaxError(ModelError):
    """MuJoCo does not accept the document."""


class NotACartPoleError(ModelError):
    """The model compiles but lacks a part of a cart-pole, or has one too many."""


class StepError(MjCartPoleError):
    """An environment was used in a way that its rules refuse."""


class InvalidActionError(StepError, AssertionError):
    """An action is outside the action space (CartPole-v1 raises AssertionError here)."""


class ResetNeededError(StepError, AssertionError):
    """`step` came before `reset` (CartPole-v1 raises AssertionError here)."""


class SimulationError(MjCartPoleError):
    """The simulation diverged: a position or velocity is NaN or beyond all bounds."""


class FileError(MjCartPoleError):
    """A file or folder cannot be read or written."""


class PolicyFileError(FileError):
    """A file is no policy of this package, or is damaged."""


class RunError(FileError):
    """A run folder is missing, incomplete, in use, or already there."""


class CheckpointError(RunError):
    """A checkpoint is damaged, or of another training than it should be."""


class RenderError(MjCartPoleError):
    """A picture or a video cannot be made."""


def check_known(
    kind: str, name: object, available: Iterable[object], error: type[MjCartPoleError] = ConfigError
) -> None:
    """Refuse a name that is none of those there are, of the kind of thing that it names.

    >>> check_known("engine", "fast", ("compiled", "python"))
    Traceback (most recent call last):
    mjcartpole.errors.ConfigError: engine 'fast' is unknown; available: compiled, python
    """
    names = list(available)
    if name in names:
        return
    hint = "".join(f"; did you mean {near!r}?" for near in nearest(name, names)[:1])
    raise error(f"{kind} {name!r} is unknown; available: {', '.join(map(str, names))}{hint}")


def nearest(name: object, available: Iterable[object]) -> list[str]:
    """Return the names that somebody may have meant, the likeliest first.

    >>> nearest("n-step", ("sarsa", "n-step-sarsa"))
    ['n-step-sarsa']
    >>> nearest("dealy", ("decay", "delay"))
    ['delay', 'decay']
    """
    names = [str(each) for each in available]
    meant = name if isinstance(name, str) else ""
    close = difflib.get_close_matches(meant, names, n=max(1, len(names)))
    # Two letters the wrong way round are one slip, which difflib counts as two.
    turned = {f"{meant[:i]}{meant[i : i + 2][::-1]}{meant[i + 2 :]}" for i in range(len(meant))}
    return sorted(close, key=lambda each: each not in turned)
