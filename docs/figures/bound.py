"""The Cramer-Rao bound of one edge over its blur, for 1, 20 and 60 independent rows."""

import numpy as np
from matplotlib.figure import Figure

from fingervision.inspection.noise_bound import edge_noise_px

NOISE_OVER_CONTRAST = 0.02


def draw() -> Figure:
    """Draw the least standard uncertainty that any unbiased estimator can have."""
    blur_px = np.linspace(0.5, 5.0, 60)
    figure = Figure(figsize=(7.0, 3.4), layout="constrained")
    axes = figure.subplots()
    for rows in (1, 20, 60):
        axes.semilogy(
            blur_px,
            [edge_noise_px(NOISE_OVER_CONTRAST, blur, rows) for blur in blur_px],
            label=f"{rows} row{'s' * (rows > 1)}",
        )
    axes.set(xlabel="blur of the edge, the pixel included, px", ylabel="least u of one edge, px")
    axes.grid(alpha=0.3, which="both")
    axes.legend(title="noise / contrast = 2 %")
    return figure
