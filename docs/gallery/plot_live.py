"""
Plot while you measure
======================

`measure` takes single pictures, so that a plot can follow a camera. The camera of this example is rendered; in its
place stands whatever yields your pictures.
"""

import matplotlib.pyplot as plt
import numpy as np

import fingervision as fv
from fingervision.rendering import Camera, render, two_fingers

noise = np.random.default_rng(1)


def pictures():
    """Eight pictures, in which the fingers open."""
    for number in range(8):
        yield render(two_fingers(60.0 + 4.0 * number, below_tip_px=10.2), Camera(), noise)


figure, (view, axes) = plt.subplots(1, 2, figsize=(8, 3), layout="constrained")
gaps_mm = []
for picture in pictures():
    row = fv.measure(picture, px_per_mm=34.0)[0]
    gaps_mm.append(row.gap_mm)
    axes.clear()
    axes.plot(gaps_mm, "o-")
    axes.set(xlabel="picture", ylabel="gap, mm")
    figure.canvas.draw_idle()  # in a notebook with `%matplotlib widget`, or in a window: plt.pause(0.01)
view.imshow(picture, cmap="gray")
view.set_axis_off()
print(f"{gaps_mm[0]:.3f} to {gaps_mm[-1]:.3f} mm")
