"""Models for vectors of environments, and how they are run."""

import numpy as np

from mjcartpole.physics.load import load_model

ENV_ID = "mjcartpole/CartPole-v1"


REFERENCE = load_model("cartpole").xml


def changed_text(*changes):
    """The reference document with words replaced."""
    text = REFERENCE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


def edited(*changes):
    """The model of such a document."""
    return load_model(changed_text(*changes))


TOUCHING = (
    ('contype="0" conaffinity="0"', 'contype="1" conaffinity="1"'),
    # Cart and rail do not overlap, the cart and its stops do at 2.33 m.
    ('pos="0 0.11 -0.14" size="2.68 0.05 0.04"', 'pos="0 0.11 -0.34" size="2.68 0.05 0.04"'),
    ("2.63 0.11 -0.03", "2.56 0.11 -0.03"),
)


RUBBING = ('damping="0" frictionloss="0"', 'damping="0.1" frictionloss="0.05"')


LIMITED = ('type="slide"', 'type="slide" range="-0.02 0.03"')


MODELS = {
    "reference": load_model("cartpole"),
    "half steps": edited(('timestep="0.02"', 'timestep="0.01"')),
    "rubbing, quarter steps": edited(RUBBING, ('timestep="0.02"', 'timestep="0.005"')),
    "limited, half steps": edited(LIMITED, ('timestep="0.02"', 'timestep="0.01"')),
    "touching": edited(*TOUCHING, ('timestep="0.02"', 'timestep="0.005"')),
    "all at once": edited(*TOUCHING, RUBBING, LIMITED, ('timestep="0.02"', 'timestep="0.01"')),
    "RK4": edited(('integrator="Euler"', 'integrator="RK4"')),
    "implicit": edited(RUBBING, ('integrator="Euler"', 'integrator="implicitfast"')),
    "sleeping": edited(
        ('integrator="Euler"/>', 'integrator="Euler"><flag sleep="enable"/></option>')
    ),
}


def run(envs, steps, seed=0):
    """What a vector returns under actions that depend on the seed alone."""
    generator = np.random.default_rng(seed)
    results = [(envs.reset(seed=seed)[0],)]
    for _ in range(steps):
        results.append(envs.step(generator.integers(0, 2, envs.num_envs))[:4])
    return results
