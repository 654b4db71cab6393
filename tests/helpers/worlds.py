"""Small worlds whose values are known, for methods to learn."""


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


class Lure:
    """Left of state 0 lies state 1, in which all is noise around -0.1; right of it nothing.

    Sutton and Barto, example 6.7, with two actions in the noise.
    """

    start = 0

    def step(self, s, a, rng):
        if s == 1:
            return rng.normal(-0.1, 1.0), 1, True
        return 0.0, 1, a == 1
