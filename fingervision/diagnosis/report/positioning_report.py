"""The positioning figures of a diagnosis: as measured, after the answer, and the share of each named effect."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fingervision.diagnosis.input.repeated_targets import RepeatedTargets
from fingervision.diagnosis.report.positioning_accuracy import positioning_accuracy
from fingervision.diagnosis.report.positioning_figures import Figure, PositioningAccuracy, Visits
from fingervision.domain.effect import Array

STANDARD = "ISO 230-2:2014"
TOLD = 0.05
"""Smallest share of a figure that is told in words, of the figure: the standard deviation of five readings is itself
known to a third only, and the list stays readable. All shares stand in the table and in report.json."""
SENTENCES = ("B_mean", "R", "E", "M", "A")
"""Figures that get a sentence; where there is one direction only, those of that direction."""
NAMES = {
    "B_mean": "Mean reversal",
    "B": "Largest reversal",
    "R": "Repeatability",
    "E": "Systematic deviation",
    "M": "Mean bidirectional deviation",
    "A": "Accuracy",
}
SIDES = {"up": "approached from below", "down": "approached from above"}


@dataclass(frozen=True, slots=True)
class PositioningReport:
    """Positioning figures before and after the answer, and with each effect's predicted change taken out.

    Parameters
    ----------
    measured : PositioningAccuracy
        Of measured minus simulated, or minus target.
    after : PositioningAccuracy or None
        Of what remains after the whole answer; None where nothing was named.
    without : mapping of str to PositioningAccuracy
        By effect, of the measured deviations minus that effect's predicted change.
    assumed : tuple of str
        What was assumed of the targets and their sides of approach.
    """

    measured: PositioningAccuracy
    after: PositioningAccuracy | None
    without: Mapping[str, PositioningAccuracy]
    assumed: tuple[str, ...] = ()

    def share_mm(self, effect: str, symbol: str) -> float | None:
        """Figure as measured minus figure without the effect; negative where the effect hides a part of it.

        Figures are ranges and maxima, so shares need not add up to the figure; those of B_mean do.
        """
        whole, rest = self.measured.figures[symbol].value_mm, self.without[effect].figures[symbol].value_mm
        return None if whole is None or rest is None else whole - rest

    @property
    def cycles(self) -> tuple[int, int]:
        """Fewest and most visits of a target from one side."""
        counts = [v.n for t in self.measured.targets for v in (t.up, t.down) if v is not None]
        return (min(counts), max(counts)) if counts else (0, 0)


def positioning_report(
    visits: RepeatedTargets,
    measured_mm: Array,
    after_mm: Array | None = None,
    changes_mm: Mapping[str, Array] | None = None,
) -> PositioningReport:
    """Compute the figures as measured, after the answer, and without each effect.

    Parameters
    ----------
    visits : RepeatedTargets
        Target, side and cycle of the m measured rows.
    measured_mm : ndarray of float, shape (m,)
        Measured gap minus that of the model without the answer's effects (or position minus target).
    after_mm : ndarray of float, shape (m,), or None
        Measured gap minus that of the model with all of the answer's effects.
    changes_mm : mapping of str to ndarray of float, shape (m,), or None
        By effect, the change of the gap that it predicts: with all effects minus with all others, so that an effect
        that acts through another is counted where both stand.
    """

    def figures(deviation_mm: Array) -> PositioningAccuracy:
        return positioning_accuracy(visits.target_mm, deviation_mm, visits.direction, visits.cycle)

    without = {
        name: figures(np.asarray(measured_mm - change, dtype=np.float64)) for name, change in (changes_mm or {}).items()
    }
    return PositioningReport(
        figures(measured_mm), None if after_mm is None else figures(after_mm), without, visits.notes
    )


def positioning_document(report: PositioningReport) -> dict[str, object]:
    """Section `iso230` of report.json: every figure with unit and definition, what remains of it, shares by effect."""
    figures = {}
    for symbol, figure in report.measured.figures.items():
        after = None if report.after is None else report.after.figures[symbol].value_mm
        figures[symbol] = {
            "definition": figure.definition,
            "unit": "mm",
            "value": figure.value_mm,
            "u": figure.u_mm,
            "interval_95": figure.interval_mm,
            "after": after,
            "shares": {effect: report.share_mm(effect, symbol) for effect in report.without},
            "reason": figure.reason,
        }
    return {
        "standard": STANDARD,
        "up": SIDES["up"],
        "down": SIDES["down"],
        "targets_count": len(report.measured.targets),
        "cycles": list(report.cycles),
        "figures": figures,
        "targets": [
            {
                "target_mm": target.target_mm,
                "up": _visits(target.up),
                "down": _visits(target.down),
                "reversal_mm": target.reversal_mm,
                "u_reversal_mm": target.u_reversal_mm,
            }
            for target in report.measured.targets
        ],
        "words": list(positioning_words(report)),
        "notes": [*report.assumed, *report.measured.notes],
    }


def positioning_rows(report: PositioningReport) -> tuple[list[str], list[list[str]]]:
    """Head and rows of the table in report.html; lengths in um."""
    effects = list(report.without)
    after = [] if report.after is None else ["after the answer, um"]
    head = ["figure", "measured, um", *after, *(f"share of {effect}, um" for effect in effects), "definition"]
    rows = []
    for symbol, figure in report.measured.figures.items():
        if figure.value_mm is None:
            cells = [f"none: {figure.reason}", *("-" for _ in (*after, *effects))]
        else:
            cells = [_um(figure.value_mm) + _interval(figure)]
            cells += [] if report.after is None else [_um(report.after.figures[symbol].value_mm)]
            cells += [_um(report.share_mm(effect, symbol)) for effect in effects]
        rows.append([symbol, *cells, figure.definition])
    return head, rows


def positioning_words(report: PositioningReport) -> tuple[str, ...]:
    """Sentences for a person: each main figure, which effect makes how much of it, what remains."""
    out = []
    for plain in SENTENCES:
        symbols = [plain]
        if report.measured.figures[plain].value_mm is None and f"{plain}_up" in report.measured.figures:
            symbols = [f"{plain}_{side}" for side in SIDES]
        for symbol in symbols:
            value = report.measured.figures[symbol].value_mm
            if value is not None:
                out.append(_sentence(report, symbol, value))
    return tuple(out)


def _sentence(report: PositioningReport, symbol: str, value: float) -> str:
    figure, side = report.measured.figures[symbol], symbol.partition("_")[2]
    name = NAMES.get(symbol) or f"{NAMES[symbol[0]]} {SIDES[side].replace('approached ', '')},"
    words = f"{name} {symbol}: {_um(value)}" + (" um" if symbol != "B_mean" else "")
    if symbol == "B_mean":
        words += f"{_interval(figure)} um" + (" (95 %)" if figure.interval_mm is not None else "")
        if value:
            words += f", {'smaller' if value < 0.0 else 'larger'} readings where a target is approached from below"
    causes = []
    for effect in report.without:
        share = report.share_mm(effect, symbol)
        if share is None or abs(share) <= TOLD * abs(value):
            continue
        if 0.0 < share * value <= value**2:
            causes.append(f"{_um(abs(share))} um of it is {effect}")
        else:
            # It hides a part of the figure, or others hide a part of it: what would stand without it is true always.
            causes.append(f"without {effect} it would be {_um(value - share)} um")
    words += f"; {', '.join(causes)}" if causes else ""
    rest = None if report.after is None else report.after.figures[symbol].value_mm
    return words + (f"; {_um(rest)} um remain after the answer." if rest is not None else ".")


def _visits(visits: Visits | None) -> dict[str, float | None] | None:
    return None if visits is None else {"n": visits.n, "mean_mm": visits.mean_mm, "s_mm": visits.s_mm}


def _um(value_mm: float | None) -> str:
    """Micrometres to a hundredth: the last digit that published reports print."""
    return "-" if value_mm is None else f"{1e3 * value_mm:.2f}"


def _interval(figure: Figure) -> str:
    return "" if figure.interval_mm is None else f" +- {_um(figure.interval_mm)}"
