"""All that decides a training: `TrainConfig` and its presets.

One place for each number: the command line's flags and their help are derived from this class.
"""

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, get_args

from mjcartpole import task
from mjcartpole.envs.backend import Backend, check_backend
from mjcartpole.errors import ConfigError
from mjcartpole.integrator import Integrator
from mjcartpole.learning.discretizer import Discretizer, is_finite
from mjcartpole.learning.qlearning import Ties

if TYPE_CHECKING:
    from mjcartpole.physics.cartpole import CartPole

MAX_SEED: Final = 2**128 - 1
"""A generator's state has as many bits."""

MAX_EPISODES: Final = 1_000_000_000
"""More than anybody waits for; the log of so many takes 13 GB."""

_MOST: Final = {"episodes": MAX_EPISODES, "log_every": MAX_EPISODES, "seed": MAX_SEED}

_GRID: Final = ("bins", "low", "high")
_DIMENSIONS: Final = len(task.state_names())

# The article's ranges, as its code has them: the float32 bound of the angle, and 3.5 rad/s.
_ARTICLE_THETA = float(task.observation_bound()[2])
_ARTICLE: dict[str, Any] = {
    "episodes": 12_000,
    "bins": (1, 1, 25, 25),
    "low": (-2.4, -1.0, -_ARTICLE_THETA, -3.5),
    "high": (2.4, 1.0, _ARTICLE_THETA, 3.5),
    "gamma": 0.95,
    "alpha": 0.1,
    "alpha_final": 0.1,
    "epsilon": 0.1,
    "epsilon_final": 0.0,
    "q_init_low": 0.0,
    "q_init_high": 1.0,
    "ties": "first",
    "td_lambda": None,
    "learn_last_step": False,
    "log_every": 2_000,
}
# Finer for the long pole, which turns slowly; where the cart is counts, how fast it moves does not.
_TWO_POLES: dict[str, Any] = {
    "model": "twopoles",
    "episodes": 30_000,
    "bins": (3, 1, 8, 8, 8, 8),
    "low": (-2.0, -0.75, -0.1, -0.4, -0.2095, -1.5),
    "high": (2.0, 0.75, 0.1, 0.4, 0.2095, 1.5),
    "gamma": 0.998,
    "epsilon": 0.1,
    "decay": 1.0,
    "q_init_low": 100.0,
    "q_init_high": 100.0,
    "td_lambda": 0.95,
    "log_every": 3_000,
}
PRESETS: Final[dict[str, dict[str, Any]]] = {
    "tuned": {},
    "article": _ARTICLE,
    "article-terminal": {**_ARTICLE, "learn_last_step": True},
    "two-poles": _TWO_POLES,
}
"""What each preset changes in the defaults of `TrainConfig`, which are those of `tuned`."""


@dataclass(frozen=True, kw_only=True, repr=False)
class TrainConfig:
    """All that decides a training. Equal configs give equal tables, bit for bit."""

    backend: Backend = "mujoco"
    """Who does the physics: mujoco, or gymnasium's own CartPole-v1."""
    model: str = "cartpole"
    """A shipped model's name or an MJCF file; backend mujoco only."""
    set: tuple[str, ...] = ()
    """Edits of the model, such as pole.length=1.5 or joint:hinge.damping=0.1."""
    own_timestep: bool = False
    """Let a control step be one physics step of the model's file, instead of 0.02 s."""
    integrator: Integrator = "gym"
    """gym: explicit Euler, as CartPole-v1; mujoco: the integrator that the model's file names."""
    episodes: int = 1_500
    """Episodes to train."""
    seed: int = 0
    """Seeds the environment and the learner."""
    bins: tuple[int, ...] = (1, 3, 6, 8)
    """Bins for x, x_dot, theta and theta_dot, such as 1,3,6,8; 1 ignores a dimension. With several
    poles the last two hold for each, here and below, unless two more are given for each."""
    low: tuple[float, ...] = (-2.4, -0.75, -0.2095, -1.5)
    """Lower ends of the bins' ranges; what lies outside belongs to the edge bins."""
    high: tuple[float, ...] = (2.4, 0.75, 0.2095, 1.5)
    """Upper ends of the bins' ranges."""
    gamma: float = 0.98
    """Discount per step."""
    alpha: float = 0.1
    """Step size at the start."""
    alpha_final: float = 0.01
    """Step size once decayed."""
    epsilon: float = 1.0
    """Probability of a random action at the start."""
    epsilon_final: float = 0.01
    """Probability of a random action once decayed."""
    decay: float = 0.5
    """Share of the episodes over which alpha and epsilon fall, linearly."""
    q_init_low: float = 10.0
    """The table starts uniformly random between this …"""
    q_init_high: float = 10.0
    """… and this."""
    td_lambda: float | None = 0.9
    """Learn after each episode from lambda-returns with this lambda; None: after each step."""
    ties: Ties = "first"
    """Between equal values: the first action, or a random one."""
    learn_last_step: bool = True
    """Learn from the step that ends an episode (the article's code does not)."""
    log_every: int = 150
    """Episodes per row of the printed table."""

    def __post_init__(self) -> None:
        for name in (*_GRID, "set"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        check_backend(
            self.backend, self.model, self.integrator, self.set, own_timestep=self.own_timestep
        )
        self._check_counts()
        self._check_numbers()
        self._check_dimensions()
        if self.ties not in get_args(Ties):
            raise ConfigError(f"ties must be 'first' or 'random', not {self.ties!r}")
        _ = self.discretizer(self._most_poles)

    @classmethod
    def preset(cls, name: str, **changes: Any) -> "TrainConfig":  # noqa: ANN401
        """A preset's config with some fields changed.

        Args:
            name: `tuned`, `article`, `article-terminal` or `two-poles`.
            changes: Any field of the config.

        Raises:
            ConfigError: The preset or a field is unknown, or a value makes no sense.
        """
        if name not in PRESETS:
            raise ConfigError(f"preset '{name}' is unknown; available: {', '.join(PRESETS)}")
        known = cls.fields()
        unknown = sorted(set(changes) - set(known))
        if unknown:
            raise ConfigError(
                f"TrainConfig has no field {', '.join(unknown)}; available: {', '.join(known)}"
            )
        return cls(**{**PRESETS[name], **changes})

    def __repr__(self) -> str:
        """What differs from the defaults; it evaluates to an equal config."""
        fields = dataclasses.fields(self)
        values = ((field, getattr(self, field.name)) for field in fields)
        changed = [f"{field.name}={value!r}" for field, value in values if value != field.default]
        return f"TrainConfig({', '.join(changed)})"

    @classmethod
    def fields(cls) -> dict[str, Any]:
        """Each field's type, by name."""
        return {field.name: field.type for field in dataclasses.fields(cls)}

    def load_model(self) -> "CartPole":
        """The model that the config names; for backend gym the reference, which is drawn for it.

        Raises:
            ModelError: It cannot be used.
            ConfigError: An edit makes no sense.
        """
        from mjcartpole.physics.load import load_model  # noqa: PLC0415 - it imports MuJoCo

        return load_model(self.model, self.set, own_timestep=self.own_timestep)

    def discretizer(self, poles: int = 1) -> Discretizer:
        """The grid for a model with so many poles.

        >>> TrainConfig(bins=(1, 3, 6, 8)).discretizer(poles=2).bins
        (1, 3, 6, 8, 6, 8)

        Raises:
            ConfigError: The config was made for another number of poles.
        """
        wanted = len(task.state_names(poles))
        for name in _GRID:
            n = len(getattr(self, name))
            if n not in (_DIMENSIONS, wanted):
                also = f" or {wanted}" if wanted != _DIMENSIONS else ""
                raise ConfigError(
                    f"{name} has {n} values, and the model has {task.in_words(poles)}; "
                    f"give {_DIMENSIONS}{also} ({', '.join(task.state_names(poles))})"
                )
        bins, low, high = (_for_each_pole(getattr(self, name), poles) for name in _GRID)
        return Discretizer(bins, low, high)

    @property
    def _most_poles(self) -> int:
        return max(len(getattr(self, name)) for name in _GRID) // 2 - 1

    def _check_dimensions(self) -> None:
        for name in _GRID:
            values = getattr(self, name)
            if len(values) < _DIMENSIONS or len(values) % 2:
                raise ConfigError(
                    f"{name} needs {_DIMENSIONS} values ({', '.join(task.state_names())}), and two "
                    f"more for each further pole, not {values}"
                )

    def _check_counts(self) -> None:
        for name, least in (("episodes", 1), ("log_every", 1), ("seed", 0)):
            value = getattr(self, name)
            if type(value) is not int or value < least:
                raise ConfigError(f"{name} must be a whole number from {least} up, not {value!r}")
        for name, most in _MOST.items():
            if getattr(self, name) > most:
                raise ConfigError(f"{name} must be at most {most:,}; this one is larger")

    def _check_numbers(self) -> None:
        names = ["gamma", "alpha", "alpha_final", "epsilon", "epsilon_final", "decay"]
        for name in [*names, "td_lambda"] if self.td_lambda is not None else names:
            value = getattr(self, name)
            if not (is_finite(value) and 0 <= value <= 1):
                raise ConfigError(f"{name} must be a number from 0 to 1, not {value!r}")
        low, high = self.q_init_low, self.q_init_high
        if not (is_finite(low) and is_finite(high) and low <= high and is_finite(high - low)):
            raise ConfigError(
                "q_init_low and q_init_high must be finite, in order and not too far apart, "
                f"not {low!r} and {high!r}"
            )


def _for_each_pole(values: tuple[Any, ...], poles: int) -> tuple[Any, ...]:
    """Values of the cart and of one pole as values of the cart and of each pole."""
    return values if len(values) != _DIMENSIONS else values[:2] + values[2:] * poles
