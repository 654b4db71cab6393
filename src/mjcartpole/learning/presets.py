"""Presets: trainings with a name, each by what it changes in the defaults of `TrainConfig`."""

import math
from typing import Any, Final

from mjcartpole.task import CARTPOLE_V1, SWING_UP


def _grid(bins: tuple[int, ...], high: tuple[float, ...]) -> dict[str, Any]:
    """Return a grid about 0, which all of these are."""
    return {"bins": bins, "low": tuple(-value for value in high), "high": high}


# The article's ranges, as its code has them: the float32 bound of the angle, and 3.5 rad/s.
_ARTICLE_THETA: Final = float(CARTPOLE_V1.observation_bound()[2])
_ARTICLE: dict[str, Any] = {
    "episodes": 12_000,
    **_grid((1, 1, 25, 25), (2.4, 1.0, _ARTICLE_THETA, 3.5)),
    "gamma": 0.95,
    "alpha": 0.1,
    "alpha_final": 0.1,
    "epsilon": 0.1,
    "epsilon_final": 0.0,
    "q_init_low": 0.0,
    "q_init_high": 1.0,
    "ties": "first",
    "decay": 0.5,
    "td_lambda": None,
    "learn_last_step": False,
    "mirror": False,
    "log_every": 2_000,
}
# A cart that is to stay on the track has to be seen there, and its speed as well.
_ENDLESS: dict[str, Any] = {
    "episodes": 3_000,
    **_grid((4, 4, 6, 4), (2.4, 1.5, 0.2095, 1.0)),
    "tilings": 8,
    "gamma": 0.995,
    "td_lambda": 0.9,
    "alpha": 0.3,
    "alpha_final": 0.01,
    "q_init_low": 100.0,
    "q_init_high": 100.0,
    "log_every": 300,
}
# Braked, a pole lags behind every push.
_DAMPED: dict[str, Any] = {
    **_ENDLESS,
    "set": ("hinge.damping=0.5",),
    "episodes": 2_000,
    "td_lambda": 0.95,
    "log_every": 200,
}
# Finer for the long pole, which turns slowly.
_TWO_POLES: dict[str, Any] = {
    "model": "twopoles",
    "episodes": 15_000,
    **_grid((4, 4, 5, 5, 5, 5), (2.0, 0.75, 0.1, 0.4, 0.2095, 1.5)),
    "tilings": 8,
    "gamma": 0.998,
    "alpha": 0.3,
    "alpha_final": 0.01,
    "epsilon": 0.1,
    "decay": 1.0,
    "q_init_low": 100.0,
    "q_init_high": 100.0,
    "td_lambda": 0.95,
    "log_every": 1_500,
}
# At 0.02 s one push throws the short pole too far; as many seconds as 500 steps of these.
_WIELAND: dict[str, Any] = {
    **_TWO_POLES,
    "model": "wieland",
    "own_timestep": True,
    "max_episode_steps": 1_000,
    "episodes": 6_000,
    **_grid(_TWO_POLES["bins"], (2.0, 0.75, 0.1, 0.4, 0.2095, 3.0)),
    "log_every": 600,
}
# Values drawn at random leave no ties: what acts while learning is the greedy policy itself.
_QUICK: dict[str, Any] = {
    "method": "model",
    "episodes": 60,
    **_grid((1, 3, 4, 8), (2.4, 0.75, 0.2095, 1.5)),
    "epsilon": 0.0,
    "epsilon_final": 0.0,
    "q_init_low": 49.0,
    "q_init_high": 50.0,
    "plan_after": "failure",
    "log_every": 6,
}
# From a high first value down: what was never tried looks better than what was, all the way up.
_SWING_UP: dict[str, Any] = {
    "task": SWING_UP.name,
    "episodes": 10_000,
    **_grid((5, 7, 32, 21), (2.4, 3.0, math.pi, 9.0)),
    "gamma": 0.99,
    "alpha": 0.2,
    "alpha_final": 0.02,
    "epsilon": 0.1,
    "q_init_low": 100.0,
    "q_init_high": 100.0,
    "log_every": 1_000,
}
# Nodes on the limits, or edges would count as if nobody ever fell there.
_PLANNED: dict[str, Any] = {
    "method": "planning",
    "episodes": 100,
    **_grid((13, 13, 17, 17), (2.4, 2.5, 0.2095, 2.5)),
    "log_every": 10,
}

PRESETS: Final[dict[str, dict[str, Any]]] = {
    "tuned": {},
    "article": _ARTICLE,
    "article-terminal": {**_ARTICLE, "learn_last_step": True},
    "two-poles": _TWO_POLES,
    "wieland": _WIELAND,
    "damped": _DAMPED,
    "endless": _ENDLESS,
    "quick": _QUICK,
    "planned": _PLANNED,
    "swing-up": _SWING_UP,
}
"""What each preset changes in the defaults of `TrainConfig`, which are those of `tuned`."""
