"""Summary of measurements: range of the gap in each recording, with its uncertainty."""

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fingervision.batch.task import Digest, Outcome, thinned

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STATISTICS = (
    "least_mm",
    "median_mm",
    "mean_mm",
    "greatest_mm",
    "standard_deviation_mm",
    "median_u_gap_mm",
    "median_u_random_mm",
)
COLUMNS = ("frames", "ok_frames", *STATISTICS)
MOST_NAMES = 40
"""Largest number of readable names along the axis; more recordings are numbered instead."""


def digest_of(folder: Path) -> Digest:
    """Summarise summary.json and gaps.csv of one measurement."""
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    with (folder / "gaps.csv").open(encoding="utf-8", newline="") as file:
        gap_mm = np.array([float(row["gap_mm"]) if row["gap_mm"] else np.nan for row in csv.DictReader(file)])
    gap = summary["gap"]
    cells = {"frames": summary["frames"], "ok_frames": gap["count"], **{name: gap[name] for name in STATISTICS}}
    caption = f"{gap['least_mm']:.4g} to {gap['greatest_mm']:.4g} mm" if gap["count"] else "no frame could be measured"
    return Digest(cells, thinned(gap_mm), caption)


def draw(figure: "Figure", outcomes: Sequence[Outcome]) -> None:
    """Plot range and median of the gap in each recording, and the uncertainty of a single frame."""
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    number = np.arange(1, len(outcomes) + 1)
    least, median, greatest, u_mm = (
        np.array([_cell(outcome, name) for outcome in outcomes])
        for name in ("least_mm", "median_mm", "greatest_mm", "median_u_gap_mm")
    )
    random = np.array([_cell(outcome, "median_u_random_mm") for outcome in outcomes])
    upper.vlines(number, least, greatest, color="#8fbcdb", linewidth=max(0.5, min(6.0, 400.0 / len(outcomes))))
    upper.plot(number, median, ".", color="#11507a", label="median; the bar is from the least to the greatest")
    without = number[~np.isfinite(median)]
    if without.size:
        upper.plot(
            without,
            np.full(without.size, 0.02),
            "x",
            color="#c0392b",
            transform=upper.get_xaxis_transform(),
            label=f"no number: {without.size} of {number.size}",
        )
    upper.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, fontsize="small", frameon=False)
    upper.set_ylabel("gap (mm)")
    has_budget = bool(np.isfinite(u_mm).any())
    expanded_um = 2e3 * (u_mm if has_budget else random)
    lower.plot(number, expanded_um, ".", color="#11507a")
    lower.set_ylabel("U, k = 2 (µm)" if has_budget else "2 u random (µm)")
    lower.set_ylim(0.0, 1.2 * float(np.nanmax(expanded_um)) if np.isfinite(expanded_um).any() else 1.0)
    lower.set_xlim(0.4, number.size + 0.6)
    if number.size <= MOST_NAMES:
        names = [outcome.folder.name if outcome.folder else Path(outcome.input).name for outcome in outcomes]
        lower.set_xticks(number, [name if len(name) <= 28 else f"…{name[-27:]}" for name in names])
        lower.tick_params(axis="x", rotation=90 if number.size > 6 else 0, labelsize="small")
    else:
        lower.set_xlabel("recording, in the order of the table")
    for axes in (upper, lower):
        axes.grid(visible=True, alpha=0.3)


def _cell(outcome: Outcome, name: str) -> float:
    value = outcome.digest.cells.get(name) if outcome.digest is not None else None
    return float(value) if isinstance(value, int | float) else float("nan")
