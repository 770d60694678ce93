"""
Effects of the camera: lens, tilt and a drift
=============================================

What the camera adds shows in the two fingers, not in the gap alone: a drift of the camera moves both fingers and
leaves the gap; a lens moves them apart by a cubic. This is why a measured table should hold `left_mm` and `right_mm`.
"""

import matplotlib.pyplot as plt
import numpy as np

import fingervision as fv

simulation = {"input_mm": [-0.1, 1.1], "gap_mm": [3.2, 12.5]}
input_mm = np.concatenate([np.linspace(0.0, 1.0, 60), np.linspace(1.0, 0.0, 60)])
drive = {"input_mm": input_mm, "time_s": 0.1 * np.arange(input_mm.size)}
families = ("lens_distortion", "camera_tilt", "camera_drift")

plain = fv.simulate(simulation, drive)
figure, panels = plt.subplots(1, 3, sharex=True, figsize=(9, 3), layout="constrained")
for axes, name in zip(panels, families, strict=True):
    effect = fv.effects[name]
    values = {each.name: 0.1 * each.upper for each in effect.parameters if each.run is None}
    seen = fv.simulate(simulation, drive, effects={name: values})
    for finger, line in (("left", "-"), ("right", "--")):
        residual_um = 1e3 * (getattr(seen, f"{finger}_mm") - getattr(plain, f"{finger}_mm"))
        axes.plot(input_mm, residual_um, line, label=finger)
    axes.set(title=name, xlabel="input, mm")
panels[0].set_ylabel("measured - model, µm")
panels[0].legend()
