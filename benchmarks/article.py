"""The article's own training loop, on gymnasium as it is today, for the clock alone."""

import gymnasium
import numpy as np


def train_like_the_article(episodes: int) -> int:
    """Train as the article's code does; returns the number of steps."""
    env = gymnasium.make("CartPole-v1")
    bins = [25, 25]
    ranges = np.array([env.observation_space.high[2], 3.5])  # type: ignore[attr-defined]
    width = ranges * 2 / bins
    rng = np.random.default_rng(0)
    table = rng.uniform(low=0, high=1, size=([*bins, 2]))
    epsilon, decay, steps = 0.1, 0.1 / (episodes // 2 - 1), 0

    def discrete(state: np.ndarray) -> tuple[int, ...]:
        cell = (np.array([state[2], state[3]]) + ranges) / width
        # Where the article's index would run over the end of the table, the last bin is taken.
        return tuple(np.clip(cell.astype(int), 0, 24))

    env.reset(seed=0)
    for episode in range(episodes):
        state = discrete(env.reset()[0])
        done = False
        while not done:
            action = np.argmax(table[state]) if rng.random() > epsilon else rng.integers(0, 2)
            observation, reward, terminated, truncated, _ = env.step(action)
            done, following = terminated or truncated, discrete(observation)
            if not done:
                future = np.max(table[following])
                cell: tuple[int, ...] = (*state, int(action))
                table[cell] = 0.9 * table[cell] + 0.1 * (float(reward) + 0.95 * future)
            state = following
            steps += 1
        if 1 <= episode <= episodes // 2:
            epsilon -= decay
    return steps
