"""
Effects of the drive: a play
============================

The stage of this gripper has a play of 20 µm, which its simulation lacks. In the plot of the gap over the input,
nothing of it is visible; the inset and the residuals show it, and `diagnose` names it.
"""

import numpy as np

import fingervision as fv

rng = np.random.default_rng(1)
input_mm = np.concatenate([np.linspace(0.0, 1.0, 50), np.linspace(1.0, 0.0, 50)] * 2)
drive = {"time_s": 0.04 * np.arange(input_mm.size), "input_mm": input_mm}
simulation = {"input_mm": [-0.1, 1.1], "gap_mm": [3.2, 12.5]}

truth = fv.simulate(simulation, drive, effects={"backlash": {"play_mm": 0.02}})
measured = {**drive, "gap_mm": truth.gap_mm + rng.normal(0.0, 0.004, input_mm.size)}

# %%
# The effect, its size with U, and how much of the disagreement it explains:

found = fv.diagnose(measured, simulation)
print(found.sentences())
assert [effect.name for effect in found.effects] == ["backlash"]

# %%
# The figure for the paper, one column wide:

figure = found.gap_figure(width_mm=85)
