"""MuJoCo's C library: what is set in it."""

import subprocess
import sys

TIMED = """
import mujoco
from mjcartpole.physics.library import stop_timers
model = mujoco.MjModel.from_xml_string("<mujoco/>")
for stop in (lambda: None, stop_timers):
    stop()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=100)
    step = data.timer[mujoco.mjtTimer.mjTIMER_STEP]
    print(step.number, step.duration > 0)
"""


def test_steps_take_no_time_of_themselves_once_they_are_told_so():
    said = subprocess.check_output([sys.executable, "-c", TIMED], text=True)
    assert said.split() == ["100", "True", "100", "False"]
