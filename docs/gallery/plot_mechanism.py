"""
Effects of the mechanism: a longer lever, a wider rest gap, a creeping material
===============================================================================

Effects of the mechanism change the gap for a given input. The ratio and the rest gap make straight lines over the
input; creep appears over time, while the stage stands.
"""

import matplotlib.pyplot as plt
import numpy as np

import fingervision as fv

simulation = {"input_mm": [-0.1, 1.1], "gap_mm": [3.2, 12.5]}
input_mm = np.concatenate([np.linspace(0.0, 1.0, 20), np.full(80, 1.0), np.linspace(1.0, 0.0, 20), np.zeros(80)])
drive = {"input_mm": input_mm, "time_s": 0.1 * np.arange(input_mm.size)}
effects = {
    "lever_ratio_error": {"ratio": 0.01},
    "rest_gap_error": {"offset_mm": 0.05},
    "viscoelastic_creep": {"fraction_1s": 0.01, "fraction_4s": 0.01},
}

plain = fv.simulate(simulation, drive)
figure, (over_input, over_time) = plt.subplots(1, 2, sharey=True, figsize=(8, 3.2), layout="constrained")
for name, values in effects.items():
    residual_um = 1e3 * (fv.simulate(simulation, drive, effects={name: values}).gap_mm - plain.gap_mm)
    over_input.plot(input_mm, residual_um, ".", ms=3, label=name)
    over_time.plot(drive["time_s"], residual_um)
over_input.set(xlabel="input, mm", ylabel="measured - model, µm")
over_time.set_xlabel("time, s")
over_input.legend()
