"""A camera that sees where the emulated stage truly is, and not where its controller says that it is."""

from typing import Any

import numpy as np

from fingervision.tables.read import read_simulation_table
from fingervision.testbed.cameras import simulated
from fingervision.testbed.simulation.gripper import Motion, SimulatedGripper
from tests.testbed.stages.emulators import Emulator

KEYS = simulated.KEYS
SIMULATED = True


def build(section: Any, context: Any) -> simulated.SimulatedCamera:
    """Build the simulated camera before a gripper on the stage of the test bed."""
    bed = (context.folder / "bed.toml").read_text(encoding="utf-8")
    device = next(each for each in Emulator.plugged if each.port in bed)
    true_mm, now_s = np.vectorize(device.plant.was_at, otypes=[float]), context.clock.now_s
    began_s = now_s()
    motion = Motion(true_mm, now_s, lambda: len(device.heard), list, lambda: began_s)
    context.gripper = SimulatedGripper(read_simulation_table(context.folder / "gripper.csv"), motion, context.hidden)
    return simulated.build(section, context)
