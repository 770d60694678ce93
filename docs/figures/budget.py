"""Contributions to the uncertainty of a gap, from a calibration on the sample references, over the size of the gap."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from fingervision.storage.calibration_json import read_calibration

REFERENCE = Path(__file__).parents[2] / "sample_frames" / "reference" / "calibration.json"


def draw() -> Figure:
    """Draw the standard uncertainty by source."""
    scale = read_calibration(REFERENCE)
    gap_mm = np.linspace(0.1, 15.0, 60)
    half_px = 0.5 * gap_mm * scale.px_per_mm
    points_px = np.stack(
        [np.stack([319.5 + s * half_px, np.full_like(half_px, 239.5)], axis=1) for s in (-1, 1)], axis=1
    )
    budget = scale.budget(points_px, np.full(gap_mm.size, 0.0106 * 2**0.5), np.full(gap_mm.size, True))
    figure = Figure(figsize=(7.0, 3.8), layout="constrained")
    axes = figure.subplots()

    for line in sorted(budget.lines, key=lambda line: -float(line.u_mm[-1]))[:6]:
        axes.semilogy(gap_mm, 1e3 * line.u_mm, label=line.source)
    axes.semilogy(gap_mm, 1e3 * budget.u_mm, color="black", linewidth=2.0, label="combined")
    axes.set(xlabel="gap, mm", ylabel="standard uncertainty, µm", ylim=(0.05, 100.0))
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure
