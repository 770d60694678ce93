"""Make the pictures of README and tutorial from the opening clip: a measured frame with the gap over time; the idea.

python sample_frames/make_picture.py
"""

from pathlib import Path
from textwrap import fill

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

import fingervision as fv

mpl.use("Agg")

CASE = Path(__file__).parent / "opening"
SHOWN_FRAME = 75
COLOURS = {"opening": "#1f6fb2", "closing": "#d2691e"}


def main() -> None:
    """Measure and diagnose the clip, and draw."""
    scale = CASE / "calibration.json"
    measured = fv.measure(CASE / "opening.mp4", calibration=scale, drive=CASE / "drive.csv")
    diagnosed = fv.diagnose(measured, CASE / "simulation.csv")
    draw_measured(measured)
    draw_idea(measured, diagnosed)


def draw_measured(measured: fv.Measurement) -> None:
    """A measured frame, and the gap over time."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4), width_ratios=(4, 5), layout="constrained")
    _draw_frame(left, measured)
    right.plot(measured.time_s, measured.gap_mm, lw=1.2, color=COLOURS["opening"])
    row = measured[SHOWN_FRAME]
    right.plot(row.time_s, row.gap_mm, "o", color="#d62728")
    right.set(xlabel="time / s", ylabel="gap / mm", title="Distance of the fingers, 0.3 mm below their tips")
    right.grid(alpha=0.3)
    figure.savefig(CASE / "measured.png", dpi=100)


def draw_idea(measured: fv.Measurement, diagnosed: fv.Diagnosis) -> None:
    """What is seen, where the simulation fails and what is left once the missing effect is added, and the sentence."""
    figure, axes = plt.subplots(1, 3, figsize=(11, 4), width_ratios=(5, 3.6, 3.6))
    figure.subplots_adjust(left=0.01, right=0.99, top=0.92, bottom=0.29, wspace=0.3)
    _draw_frame(axes[0], measured)
    axes[0].set_title("1  every frame is measured", fontsize=10)
    table = measured.measured_table()
    opens = np.gradient(table.input_mm) >= 0.0
    before, after = (dict(each)["gap"] for each in (diagnosed.residual_before_mm, diagnosed.residual_after_mm or {}))
    titles = ("2  measured minus simulated", "3  with the missing effect added")
    largest_um = 1e3 * float(np.abs(before).max())
    for panel, title, residual_mm in zip(axes[1:], titles, (before, after), strict=True):
        for name, rows in (("opening", opens), ("closing", ~opens)):
            panel.plot(table.input_mm[rows], 1e3 * residual_mm[rows], ".", ms=3, color=COLOURS[name], label=name)
        panel.set_ylim(-1.15 * largest_um, 1.15 * largest_um)
        panel.set_xlabel("input of the stage / mm", fontsize=9)
        panel.set_ylabel("gap, residual / µm", fontsize=9)
        panel.set_title(title, fontsize=10)
        panel.tick_params(labelsize=8)
        panel.grid(alpha=0.3)
    axes[1].legend(frameon=False, fontsize=8, markerscale=3, loc="center right")
    sentence = f"{diagnosed.verdict}: {diagnosed.report.sentence}"
    figure.text(0.5, 0.075, fill(sentence, 118), ha="center", va="center", fontsize=10, weight="bold")
    figure.savefig(CASE / "idea.png", dpi=100)


def _draw_frame(panel: Axes, measured: fv.Measurement) -> None:
    panel.imshow(measured.picture(SHOWN_FRAME))
    panel.set_axis_off()


if __name__ == "__main__":
    main()
