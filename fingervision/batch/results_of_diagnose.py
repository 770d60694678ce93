"""Summary of diagnoses: frequency of each verdict, and the remaining disagreement."""

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fingervision.batch.task import Digest, Outcome

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RMS = ("before_rms_mm", "after_rms_mm", "noise_rms_mm", "unseen_before_rms_mm", "unseen_after_rms_mm")
COLUMNS = ("verdict", "effects", "alternatives", "parameters", *RMS)
COLOURS = {"agrees": "#5b8c5a", "named": "#11507a", "ambiguous": "#d99a2b", "unknown": "#c0392b"}
MOST_ANSWERS = 20
FEWEST_PLACES = 6
"""Smallest number of bars for which the plot has room, because a single bar would otherwise fill it."""


def digest_of(folder: Path) -> Digest:
    """Summarise report.json of one diagnosis."""
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    names = " + ".join(effect["name"] for effect in report["effects"])
    values = [
        f"{name} = {estimate['value']:.5g}" + ("" if estimate["u"] is None else f" (u {estimate['u']:.2g})")
        for effect in report["effects"]
        for name, estimate in effect["parameters"].items()
    ]
    rms = {name: report["disagreement"][name] for name in RMS}
    cells = {
        "verdict": report["verdict"],
        "effects": names,
        "alternatives": "; ".join(" + ".join(found) for found in report["alternatives"]),
        "parameters": "; ".join(values),
        **rms,
    }
    caption = (
        f"{report['verdict']}{': ' if names else ''}{names}; {1e3 * rms['before_rms_mm']:.3g} µm, after correction "
    )
    caption += f"{1e3 * rms['after_rms_mm']:.3g} µm, noise {1e3 * rms['noise_rms_mm']:.3g} µm"
    if report["disagreement"].get("rows_left_out"):
        caption += f" (all rows, with the {report['disagreement']['rows_left_out']} left out as outliers)"
    return Digest(cells, (rms["before_rms_mm"], rms["after_rms_mm"], rms["noise_rms_mm"]), caption)


def draw(figure: "Figure", outcomes: Sequence[Outcome]) -> None:
    """Plot the frequency of each verdict, and the disagreement after the diagnosis over the disagreement before it."""
    left, right = figure.subplots(1, 2)
    done = [outcome.digest.cells for outcome in outcomes if outcome.digest is not None]
    answers = Counter((str(cells["effects"]) or str(cells["verdict"]), str(cells["verdict"])) for cells in done)
    shown = answers.most_common(MOST_ANSWERS)[::-1]
    left.barh(
        range(len(shown)),
        [count for _, count in shown],
        color=[COLOURS.get(verdict, "grey") for (_, verdict), _ in shown],
    )
    left.set_yticks(
        range(len(shown)), [name if name == verdict else f"{name} ({verdict})" for (name, verdict), _ in shown]
    )
    left.tick_params(axis="y", labelsize="small")
    left.set_xlabel("tables")
    left.xaxis.get_major_locator().set_params(integer=True)
    left.set_ylim(len(shown) - 0.4 - max(FEWEST_PLACES, len(shown)), len(shown) - 0.4)
    for verdict, colour in COLOURS.items():
        chosen = [cells for cells in done if cells["verdict"] == verdict]
        before, after = (
            np.array([1e3 * float(cells[name] or np.nan) for cells in chosen])
            for name in ("before_rms_mm", "after_rms_mm")
        )
        if chosen:
            right.plot(before, after, "o", color=colour, markersize=5, alpha=0.8, label=f"{verdict}: {len(chosen)}")
    if done:
        right.set_xscale("log")
        right.set_yscale("log")
        right.axline((1.0, 1.0), (10.0, 10.0), color="grey", linewidth=0.8, linestyle="--")
        right.legend(fontsize="small")
    right.set_xlabel("disagreement before, RMS (µm)")
    right.set_ylabel("after (µm)")
    for axes in (left, right):
        axes.grid(visible=True, alpha=0.3)
