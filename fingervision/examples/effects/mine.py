"""Example of a user-defined effect: `--effects ./mine.py` adds it to the catalogue."""

import numpy as np

import fingervision as fv


@fv.effect("mechanism", fv.Parameter("height_mm", "mm", -0.2, 0.2, "height of the bump"), residual="a single bump")
def mid_bump(points, history, values):
    """The gap bulges in the middle of the range.

    height_mm exp(-((u - 0.5) / 0.1)^2 / 2)
    """
    bulge = np.exp(-0.5 * ((history.input_mm - 0.5) / 0.1) ** 2)
    return points.with_gap(points.gap_mm + values["height_mm"] * bulge)
