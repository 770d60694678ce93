"""
Calibrate on bars of known width
================================

Three widths give the scale and the edge bias: by how much the picture of an edge lies beside the edge. The budget
lists what the uncertainty of the scale consists of.
"""

import tempfile

import matplotlib.pyplot as plt

import fingervision as fv

folder = fv.example("calibrate", tempfile.mkdtemp())
sizes = {folder / "ref5.png": 5.0, folder / "ref11.png": 11.0, folder / "ref17.png": 17.0}
calibration = fv.calibrate("bar", sizes, plane_mm=0.2)
print(calibration)

# %%
# The bars themselves:

figure, panels = plt.subplots(1, 3, figsize=(8, 2.4), layout="constrained")
for axes, (path, size_mm) in zip(panels, sizes.items(), strict=True):
    axes.imshow(plt.imread(path), cmap="gray")
    axes.set_title(f"{size_mm:g} mm")
    axes.set_axis_off()
