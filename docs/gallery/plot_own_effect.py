"""
An effect of your own
=====================

A function is an effect. From here on, every diagnosis of this session tries it too.
"""

import matplotlib.pyplot as plt
import numpy as np

import fingervision as fv


@fv.effect("mechanism", fv.Parameter("height_mm", "mm", -0.2, 0.2, "height of the bump"))
def mid_bump(points, history, values):
    """The gap bulges in the middle of the range.

    height_mm exp(-((u - 0.5) / 0.1)^2 / 2)
    """
    bulge = values["height_mm"] * np.exp(-0.5 * ((history.input_mm - 0.5) / 0.1) ** 2)
    return points.with_gap(points.gap_mm + bulge)


simulation = {"input_mm": [-0.1, 1.1], "gap_mm": [3.2, 12.5]}
input_mm = np.linspace(0.0, 1.0, 200)
bumpy = fv.simulate(simulation, input_mm, effects={"mid_bump": {"height_mm": 0.05}})
figure, axes = plt.subplots(figsize=(5, 3), layout="constrained")
axes.plot(input_mm, 1e3 * (bumpy.gap_mm - fv.simulate(simulation, input_mm).gap_mm))
axes.set(xlabel="input, mm", ylabel="what the effect adds, µm")

# %%
# It is listed as all others are:

print(fv.effects["mid_bump"].words)
