"""
Effects of time: a late camera and a lagging stage
==================================================

A delay looks like a play at one speed, and does not at two: its loop grows with the speed. Here the stage opens and
closes the gripper at 0.5 and at 2 mm/s.
"""

import matplotlib.pyplot as plt
import numpy as np

import fingervision as fv

simulation = {"input_mm": [-0.1, 1.1], "gap_mm": [3.2, 12.5]}
effects = {
    "backlash": {"play_mm": 0.02},
    "camera_latency": {"delay_s": 0.02},
    "drive_lag": {"delay_s": 0.02},
}

figure, panels = plt.subplots(1, 3, sharex=True, sharey=True, figsize=(8, 3), layout="constrained")
for axes, (name, values) in zip(panels, effects.items(), strict=True):
    for speed_mm_s in (0.5, 2.0):
        once = np.linspace(0.0, 1.0, 60)
        input_mm = np.concatenate([once, once[::-1], once])
        drive = {"input_mm": input_mm, "time_s": np.arange(input_mm.size) / 59.0 / speed_mm_s}
        plain, late = fv.simulate(simulation, drive), fv.simulate(simulation, drive, effects={name: values})
        axes.plot(input_mm, 1e3 * (late.gap_mm - plain.gap_mm), ".-", ms=3, lw=0.8, label=f"{speed_mm_s:g} mm/s")
    axes.set_title(name)
    axes.set_xlabel("input, mm")
panels[0].set_ylabel("measured - model, µm")
panels[0].legend()

# %%
# The catalogue says how each of them looks:

for name in effects:
    print(f"{name}: {fv.effects[name].residual}")
