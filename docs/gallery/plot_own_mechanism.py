"""
A mechanism of your own, from its drawing
=========================================

A drawing of the bodies and flexures is a model: here a stage on two parallel leaves.
"""

import tempfile

import matplotlib.pyplot as plt

import fingervision as fv

folder = fv.example("model", tempfile.mkdtemp())
print((folder / "mechanism.toml").read_text()[:600])

# %%
# Both kinds of model, beam-like flexures and finite elements:

predicted = fv.model(folder / "mechanism.toml")
print(predicted.report())

# %%
# The force over the input:

figure, axes = plt.subplots(figsize=(5, 3.2), layout="constrained")
for kind, line in zip(predicted, ("-", "--"), strict=True):
    axes.plot(predicted[kind]["input_mm"], predicted[kind]["force_n"], line, label=kind)
axes.set(xlabel="input, mm", ylabel="force at the drive, N")
axes.legend()
