"""
What changed since a healthy recording
======================================

The same specimen was measured when it was new, and again today. Between the days its rest gap grew by 20 µm.
"""

import matplotlib.pyplot as plt
import numpy as np

import fingervision as fv

rng = np.random.default_rng(1)
input_mm = np.linspace(0.0, 1.0, 60)
simulation = {"input_mm": [-0.1, 1.1], "gap_mm": [3.2, 12.5]}
gap_mm = fv.simulate(simulation, input_mm).gap_mm
healthy = {"input_mm": input_mm, "gap_mm": gap_mm + rng.normal(0.0, 0.004, 60)}
today = {"input_mm": input_mm, "gap_mm": gap_mm + 0.02 + rng.normal(0.0, 0.004, 60)}

changes = fv.changes_since(today, healthy, simulation)
print(changes.sentences())

# %%
# The difference of the two recordings:

figure, axes = plt.subplots(figsize=(5, 3), layout="constrained")
axes.plot(input_mm, 1e3 * (today["gap_mm"] - healthy["gap_mm"]), ".")
axes.axhline(0.0, color="0.6", lw=0.8)
axes.set(xlabel="input, mm", ylabel="today - healthy, µm")
