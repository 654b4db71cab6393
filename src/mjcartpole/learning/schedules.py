"""Schedules: numbers that change as training goes on."""


def linear(start: float, end: float, episodes: float, episode: int) -> float:
    """Return the value of a straight line from `start` in episode 0 to `end`, constant afterwards.

    The slope is so many episodes long; 0 means `end` from the beginning.
    """
    if episode >= episodes:
        return end
    return start + (end - start) * (episode / episodes)
