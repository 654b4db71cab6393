"""Numbers that change as training goes on."""

from dataclasses import dataclass


@dataclass(frozen=True)
class LinearSchedule:
    """A straight line from `start` to `end`, constant afterwards.

    Attributes:
        start: Value of episode 0.
        end: Value from episode `episodes` on.
        episodes: Length of the slope; 0 means `end` from the beginning.
    """

    start: float
    end: float
    episodes: float

    def __call__(self, episode: int) -> float:
        """Value in an episode, counted from 0."""
        return linear(self.start, self.end, self.episodes, episode)


def linear(start: float, end: float, episodes: float, episode: int) -> float:
    """Value of a `LinearSchedule` in an episode; Numba compiles it as it is."""
    if episode >= episodes:
        return end
    return start + (end - start) * (episode / episodes)
