"""How closely do MuJoCo and CartPole-v1 agree? Nine rungs and a witness.

Two questions are kept apart. `cartpole-v1`: is this model CartPole-v1? `itself`: does MuJoCo move
this model as the analytic pole with the model's own parameters moves?
"""

from mjcartpole.studies.parity.case import Against, Subject
from mjcartpole.studies.parity.ladder import RUNGS, run_ladder
from mjcartpole.studies.parity.result import Figure, Result

__all__ = ["RUNGS", "Against", "Figure", "Result", "Subject", "run_ladder"]
