"""What the gap is: a frame of the samples with outline, tips, measuring height and measuring points, as measured."""

from pathlib import Path

import cv2
import numpy as np
from matplotlib.figure import Figure

from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.vision.pipeline import Settings, measure_frame

PICTURE = Path(__file__).parents[2] / "sample_frames" / "table1" / "frame_04.png"
PX_PER_MM = 34.0


def draw() -> Figure:
    """Draw the tips at four times their size."""
    pixels = cv2.imread(str(PICTURE), cv2.IMREAD_GRAYSCALE)
    assert pixels is not None  # noqa: S101 - a sample
    found = measure_frame(Frame(np.asarray(pixels), 0, 0.0), Settings(0.3 * PX_PER_MM))
    assert isinstance(found, GapMeasurement)  # noqa: S101 - a sample
    left, right = found.left, found.right
    x0, x1 = int(left.x_px) - 60, int(right.x_px) + 60
    y0, y1 = int(left.tip_px) - 22, int(left.y_px) + 28
    figure = Figure(figsize=(7.0, 2.6), layout="constrained")
    axes = figure.subplots()
    axes.imshow(pixels[y0:y1, x0:x1], cmap="gray", vmin=0, vmax=255, extent=(x0 - 0.5, x1 - 0.5, y1 - 0.5, y0 - 0.5))
    for edge, side in ((left, -1.0), (right, 1.0)):
        axes.plot(
            [edge.x_px + 34.0 * side, edge.x_px - 12.0 * side], [edge.tip_px] * 2, color="tab:orange", linewidth=1.0
        )
        axes.plot(edge.x_px, edge.y_px, "o", color="tab:cyan", markersize=5.0)
        at = edge.x_px + 26.0 * side
        axes.annotate("", (at, edge.y_px), (at, edge.tip_px), arrowprops={"arrowstyle": "<->", "color": "tab:orange"})
        axes.text(
            at + 2.0 * side,
            0.5 * (edge.tip_px + edge.y_px),
            "0.3 mm",
            color="white",
            va="center",
            ha="right" if side < 0 else "left",
        )
    axes.annotate(
        "", (right.x_px, right.y_px), (left.x_px, left.y_px), arrowprops={"arrowstyle": "<->", "color": "tab:cyan"}
    )
    axes.text(
        0.5 * (left.x_px + right.x_px),
        left.y_px + 2.0,
        f"gap: {found.gap_px:.2f} px",
        color="tab:blue",
        ha="center",
        va="top",
    )
    axes.text(0.5 * (left.x_px + right.x_px), left.tip_px - 3.0, "tips", color="tab:orange", ha="center")
    axes.set(xlabel="x, px", ylabel="y, px")
    return figure
