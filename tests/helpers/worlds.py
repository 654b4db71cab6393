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


class Cliff:
    """A grid from whose lower left corner one goes to the lower right one; between them is a cliff.

    Sutton and Barto, example 6.6: a move costs 1, a fall 100 and leads back to the start. A move
    is two choices here: along the cliff (0) or across (1), then back (0) or forth (1). A cell has
    three states: before the first, and before the second of either kind.
    """

    start = 0

    def __init__(self, length, width):
        self.length, self.width = length, width
        self.n = 3 * length * width

    def step(self, s, a, rng):
        cell, chosen = divmod(s, 3)
        if chosen == 0:
            return 0.0, s + 1 + a, False
        y, x = divmod(cell, self.length)
        x += (2 * a - 1) * (chosen == 1)
        y += (2 * a - 1) * (chosen == 2)
        x, y = min(max(x, 0), self.length - 1), min(max(y, 0), self.width - 1)
        if y == 0 and 0 < x < self.length - 1:
            return -100.0, self.start, False
        return -1.0, 3 * (self.length * y + x), (x, y) == (self.length - 1, 0)

    def way(self, table):
        """Return how far from the cliff a greedy walk is in each column, at most."""
        s, far, over = self.start, [0] * self.length, False
        for _ in range(2 * self.n):
            if over:
                return far
            _, s, over = self.step(s, int(table[s][1] > table[s][0]), None)
            y, x = divmod(s // 3, self.length)
            far[x] = max(far[x], y)
        return None

    def values(self, epsilon):
        """Return the values of who acts best but for a share of random actions, shape (n, 2)."""
        steps = [[self.step(s, a, None) for a in (0, 1)] for s in range(self.n)]
        rewards, leads, over = (
            np.array([[e[i] for e in pair] for pair in steps]) for i in range(3)
        )
        q = np.zeros((self.n, 2))
        for _ in range(5_000):
            state = (1 - epsilon) * q.max(axis=1) + epsilon * q.mean(axis=1)
            q = rewards + np.where(over, 0.0, state[leads])
        return q


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
