"""
Two models in the figure for a paper
====================================

`compare` takes several models, named as the legend shall name them. The figure is 85 or 170 mm wide, has text of 8
points, and is saved as SVG or PDF.
"""

import tempfile

import fingervision as fv

folder = fv.example("diagnose", tempfile.mkdtemp())
models = {"finite elements": folder / "comsol.csv", "lumped model": folder / "gripper.toml"}
found = fv.compare(folder / "samples.csv", models)
print(found.report())

figure = found.gap_figure(width_mm=170)
figure.savefig(folder / "figure.pdf")
