"""Schedules: numbers that change as training goes on."""


def linear(start: float, end: float, episodes: float, episode: int) -> float:
    """Return the value of a straight line from `start` to `end`, constant afterwards.

    Args:
        start: Value of episode 0.
        end: Value from episode `episodes` on.
        episodes: Length of the slope; 0 means `end` from the beginning.
        episode: Counted from 0.
    """
    if episode >= episodes:
        return end
    return start + (end - start) * (episode / episodes)
