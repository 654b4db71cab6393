"""Small worlds whose values are known, for methods to learn."""

import numpy as np


class Walk:
    """A row of states between two ends; action 1 goes right, 0 left.

    Sutton and Barto, example 6.2. It begins in the middle and gives 1 at the right end, else 0, so
    that at random the value of each state is its place: i / (n + 1), counted from 1.
    """

    def __init__(self, n):
        self.n, self.start = n, n // 2

    def step(self, s, a, rng):
        s_next = s + 2 * a - 1
        inside = 0 <= s_next < self.n
        return float(s_next == self.n), s_next if inside else s, not inside

    def at_random(self):
        """Values of both actions where each is as likely as the other, shape (n, 2)."""
        return [[(s + 2 * a) / (self.n + 1) for a in (0, 1)] for s in range(self.n)]

    def values(self, right):
        """Values of the states where action 1 has these probabilities, shape (n,)."""
        moves = np.diag(right[:-1], 1) + np.diag(1 - right[1:], -1)
        return np.linalg.solve(np.eye(self.n) - moves, np.eye(self.n)[-1] * right[-1])


class Lure:
    """Left of state 0 lies state 1, in which all is noise around -0.1; right of it nothing.

    Sutton and Barto, example 6.7, with two actions in the noise.
    """

    start = 0

    def step(self, s, a, rng):
        if s == 1:
            return rng.normal(-0.1, 1.0), 1, True
        return 0.0, 1, a == 1


class Slippery:
    """A row of states with a wall on the left and a way out on the right; feet slip.

    One goes where one wants four of five times, else the other way. A step gives the place that it
    begins at.
    """

    start = 0

    def __init__(self, n):
        self.n = n
        self.rewards = np.repeat(np.arange(float(n)), 2).reshape(n, 2)
        self.leads = np.zeros((n, 2, n))
        """Probability of each next state; what is missing is that of the way out."""
        for s, a, aside in np.ndindex(n, 2, 2):
            s_next = max(s + 2 * (a ^ aside) - 1, 0)
            if s_next < n:
                self.leads[s, a, s_next] += 0.2 if aside else 0.8

    def step(self, s, a, rng):
        s_next = max(s + (2 * a - 1) * (1 if rng.random() < 0.8 else -1), 0)
        return float(s), min(s_next, self.n - 1), s_next == self.n


class Corridor:
    """Three places that look alike, at the middle one left is right; it costs 1 a step to its end.

    Sutton and Barto, example 13.1. Where action 1 has probability p, the start is worth
    (2 p - 4) / (p (1 - p)), at most -11.66 with p = 2 - sqrt(2) = 0.586.
    """

    start = place = 0

    def step(self, s, a, rng):
        right = (a == 1) != (self.place == 1)
        self.place = max(0, self.place + (1 if right else -1))
        if over := self.place == 3:
            self.place = 0
        return -1.0, 0, over

    def value(self, p):
        return (2 * p - 4) / (p * (1 - p))


def counted(played, n):
    """Return mean rewards, shape (n, 2), and shares of next states, (n, 2, n), of episodes."""
    leads, rewards, visits = np.zeros((n, 2, n)), np.zeros((n, 2)), np.zeros((n, 2))
    for s, a, r, s_next, terminated in (step for steps in played for step in steps):
        visits[s, a] += 1
        rewards[s, a] += r
        leads[s, a, s_next] += not terminated
    assert visits.min() > 0
    return rewards / visits, leads / visits[..., None]


def best_values(rewards, leads, gamma):
    """Return the values of both actions of who acts best, by iteration on matrices."""
    values = np.zeros_like(rewards)
    for _ in range(1_000):
        values = rewards + gamma * leads @ values.max(axis=1)
    return values
