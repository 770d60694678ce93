"""Positioning accuracy of a measured table compared with its model, as given in report.json and report.html."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from fingervision.diagnosis.inference.measuring_chain import Settings
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.report.html_parts import table
from fingervision.diagnosis.report.positioning_accuracy import Figure, PositioningAccuracy, Visits, positioning_accuracy
from fingervision.domain.effect import Array, Flags, Values
from fingervision.motion.input_path import recorded
from fingervision.motion.repeated_targets import NoRepeatedTargets, RepeatedTargets, repeated_targets

# Positioning accuracy in a diagnosis: as measured, corrected for the named effects, and the share of each effect.


@dataclass(frozen=True, slots=True)
class PositioningReport:
    """Positioning accuracy as measured, after the correction, and with the predicted change of each effect subtracted.

    Parameters
    ----------
    measured : PositioningAccuracy
        Quantities of measured minus simulated values, or of measured minus target values.
    after : PositioningAccuracy or None
        Quantities of the residual after all named effects; None if none was named.
    without : mapping of str to PositioningAccuracy
        By effect, quantities of the measured deviations minus that effect's predicted change.
    assumed : tuple of str
        Assumptions on the targets and their sides of approach.
    reference : str
        Reference of the deviations: `target` or `model`.
    slope_sign : int
        +1 if the gap rises with the input, -1 if it falls: play then causes a reversal of opposite sign.
    """

    measured: PositioningAccuracy
    after: PositioningAccuracy | None
    without: Mapping[str, PositioningAccuracy]
    assumed: tuple[str, ...] = ()
    reference: str = "target"
    slope_sign: int = 1

    def share_mm(self, effect: str, symbol: str) -> float | None:
        """Quantity as measured minus the quantity without the effect (mm); negative if the effect hides a part of it.

        Most quantities are ranges or maxima, so that the shares need not add up to the quantity; only the shares of
        B_mean add up.
        """
        whole, rest = self.measured.figures[symbol].value_mm, self.without[effect].figures[symbol].value_mm
        return None if whole is None or rest is None else whole - rest

    @property
    def cycles(self) -> tuple[int, int]:
        """Smallest and largest number of visits of a target from one side."""
        counts = [v.n for t in self.measured.targets for v in (t.up, t.down) if v is not None]
        return (min(counts), max(counts)) if counts else (0, 0)


def effect_changes(
    predict_mm: Callable[[Mapping[str, Values]], Array], answer: Mapping[str, Values]
) -> dict[str, Array]:
    """Change of the prediction by each named effect, with the other effects present.

    Parameters
    ----------
    predict_mm : callable
        Predicted gap of the measured rows, shape (m,), for the parameters of the effects that act.
    answer : mapping of str to mapping of str to float
        Effects found, with their parameters.
    """
    whole = predict_mm(answer)
    return {
        name: whole - predict_mm({other: values for other, values in answer.items() if other != name})
        for name in answer
    }


def positioning_report(
    visits: RepeatedTargets,
    measured_mm: Array,
    after_mm: Array | None = None,
    changes_mm: Mapping[str, Array] | None = None,
    reference: str = "target",
    slope_sign: int = 1,
) -> PositioningReport:
    """Compute the positioning quantities as measured, corrected, and without each effect.

    Parameters
    ----------
    visits : RepeatedTargets
        Target, side and cycle of the m measured rows.
    measured_mm : ndarray of float, shape (m,)
        Position minus target, or measured gap minus that of the model without the effects found.
    after_mm : ndarray of float, shape (m,), or None
        Measured gap minus that of the model with all effects found.
    changes_mm : mapping of str to ndarray of float, shape (m,), or None
        By effect, the change of the predicted gap: prediction with all effects minus prediction with all others, so
        that an effect that acts through another is counted for both.
    reference : str
        Reference of the deviations: `target` or `model`.
    slope_sign : int
        +1 if the gap rises with the input, -1 if it falls.
    """

    def figures(deviation_mm: Array) -> PositioningAccuracy:
        return positioning_accuracy(visits.target_mm, deviation_mm, visits.direction, visits.cycle)

    without = {
        name: figures(np.asarray(measured_mm - change, dtype=np.float64)) for name, change in (changes_mm or {}).items()
    }
    return PositioningReport(
        figures(measured_mm),
        None if after_mm is None else figures(after_mm),
        without,
        visits.notes,
        reference,
        slope_sign,
    )


# Positioning accuracy in report.json, and as table and sentences in report.html.

STANDARD = "ISO 230-2:2014"
TOLD = 0.05
"""Smallest share of a quantity that is mentioned in sentences: the standard deviation of five readings is itself known
only to a third, and the list stays readable. All shares are in the table and in report.json."""
SENTENCES = ("B_mean", "R", "E", "M", "A")
"""Quantities that are described by a sentence; if there is one direction only, those of that direction."""
NAMES = {
    "B_mean": "Mean reversal",
    "B": "Largest reversal",
    "R": "Repeatability",
    "E": "Systematic deviation",
    "M": "Mean bidirectional deviation",
    "A": "Accuracy",
}
REFERENCES = {
    "target": "Deviations are measured gap minus recorded input, less a constant.",
    "model": "Deviations are measured minus simulated gap: the quantities describe what the model lacks, not "
    "the axis alone.",
}
SHARES = (
    "Shares are those of the best explanation: each share is the figure minus the figure without the effect's "
    "predicted change. Figures are ranges and maxima, so that shares need not add up."
)
SIDES = {"up": "approached from below", "down": "approached from above"}


def positioning_document(report: PositioningReport) -> dict[str, object]:
    """Section `iso230` of report.json: every quantity with unit, definition, residual, and shares of the effects."""
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
        "reference": report.reference,
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
        "notes": list(positioning_notes(report)),
    }


def positioning_rows(report: PositioningReport) -> tuple[list[str], list[list[str]]]:
    """Head and rows of the table in report.html; lengths in mm, with their full values for programs."""
    effects = list(report.without)
    after = [] if report.after is None else ["after correction, mm"]
    head = ["figure", "measured, mm", *after, *(f"share of {effect}, mm" for effect in effects), "definition"]
    rows = []
    for symbol, figure in report.measured.figures.items():
        if figure.value_mm is None:
            cells = [escape(f"none: {figure.reason}"), *("-" for _ in (*after, *effects))]
        else:
            interval = "" if figure.interval_mm is None else f" +- {_number(figure.interval_mm)}"
            cells = [_number(figure.value_mm) + interval]
            cells += [] if report.after is None else [_number(report.after.figures[symbol].value_mm)]
            cells += [_number(report.share_mm(effect, symbol)) for effect in effects]
        rows.append([escape(symbol), *cells, escape(figure.definition)])
    return head, rows


def positioning_notes(report: PositioningReport) -> tuple[str, ...]:
    """Notes: definition of deviations and shares, assumptions on the cycle, and what the standard would require."""
    shares = (SHARES,) if report.without else ()
    return (REFERENCES[report.reference], *shares, *report.assumed, *report.measured.notes)


def positioning_words(report: PositioningReport) -> tuple[str, ...]:
    """Describe each main quantity in a sentence: its value, the share of each effect, and the residual."""
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
    words = f"{name} {symbol}: {_mm(value)}" + (" mm" if symbol != "B_mean" else "")
    if symbol == "B_mean":
        words += f"{_interval(figure)} mm" + (" (95 %)" if figure.interval_mm is not None else "")
        words += _side_words(figure, report.slope_sign)
    causes = []
    for effect in report.without:
        share = report.share_mm(effect, symbol)
        if share is None or abs(share) <= TOLD * abs(value):
            continue
        if 0.0 < share * value <= (1.0 + TOLD) * value**2:
            causes.append(f"{_mm(abs(share))} mm are caused by {effect}")
        else:
            # The effect hides a part of the quantity, or other effects hide a part of the effect: state the quantity
            # without the effect, which is always true.
            causes.append(f"without {effect} the value would be {_mm(value - share)} mm")
    words += f"; {', '.join(causes)}" if causes else ""
    rest = None if report.after is None else report.after.figures[symbol].value_mm
    return words + (f"; {_mm(rest)} mm remain after correction." if rest is not None else ".")


def _side_words(figure: Figure, slope_sign: int) -> str:
    """Sentence on which approach gives smaller readings, and whether play explains it; empty if not significant."""
    value, interval = figure.value_mm or 0.0, figure.interval_mm
    if not value or (interval is not None and abs(value) <= interval):
        return ""
    words = f", {'smaller' if value < 0.0 else 'larger'} readings where a target is approached from below"
    if interval is None:
        return words
    if value * slope_sign < 0.0:
        return f"{words}, as play causes them"
    return f"{words}; play would cause the opposite: are the directions swapped?"


def _visits(visits: Visits | None) -> dict[str, float | None] | None:
    return None if visits is None else {"n": visits.n, "mean_mm": visits.mean_mm, "s_mm": visits.s_mm}


def _mm(value_mm: float | None) -> str:
    """Write a length in millimetres, to a hundredth of a micrometre as in published reports."""
    # Adding zero removes the sign of a value that rounds to zero.
    return "-" if value_mm is None else f"{round(value_mm, 5) + 0.0:.5f}"


def _number(value_mm: float | None) -> str:
    return "-" if value_mm is None else f'<data value="{value_mm!r}">{_mm(value_mm)}</data>'


def _interval(figure: Figure) -> str:
    return "" if figure.interval_mm is None else f" +- {_mm(figure.interval_mm)}"


# Positioning accuracy of a measured table compared with its model and the result of a diagnosis, in one call.

STAGE_SLOPE = 0.05
"""Largest difference of the model's slope from one for which the gap counts as the position of an axis. Scale errors of
stages are a few parts in a thousand. A gripper amplifies the input several times, so that position minus target has no
meaning."""
LINE = 1e-9
"""Deviation of a model from the straight line, as a share of its range, below which it counts as the line: rounding."""
MODEL = "the model"
"""Name under which the share of the model's own deviation from the targets (a map of position errors) is reported."""
TARGET, SIMULATION = "target", "model"
"""References from which deviations are measured."""


def positioning_of_table(
    input_mm: Array,
    measured: Flags,
    runs: Sequence[slice],
    time_s: Array | None,
    gap_mm: Array,
    predict_mm: Callable[[Mapping[str, Values]], Array],
    answer: Mapping[str, Values],
) -> PositioningReport | NoRepeatedTargets:
    """Compute the positioning accuracy, if the table has repeated targets.

    If the model's gap follows the input one to one, as on a stage, a deviation is measured gap minus recorded input, as
    in an ISO 230-2 report. For a stage, the share of the model's prediction is reported together with the shares of the
    effects. For any other model than that of a stage, a deviation is the measured gap minus the simulated gap. A
    constant added to all deviations (such as a rest gap) changes none of the quantities.

    Parameters
    ----------
    input_mm : ndarray of float, shape (n,)
        Inputs of the path in order of time, including rows without a reading.
    measured : ndarray of bool, shape (n,)
        Rows with a reading; m is their number.
    runs : sequence of slice
        Rows of each run.
    time_s : ndarray of float, shape (n,), or None
        Times.
    gap_mm : ndarray of float, shape (m,)
        Measured gaps.
    predict_mm : callable
        Predicted gap at the m readings, for given effects and their parameters.
    answer : mapping of str to mapping of str to float
        Effects found, with their parameters.
    """
    visits = repeated_targets(input_mm, measured, runs, time_s)
    if isinstance(visits, NoRepeatedTargets):
        return visits
    inputs, plain = input_mm[measured], predict_mm({})
    changes = effect_changes(predict_mm, answer)
    after = gap_mm - predict_mm(answer)
    slope = float(np.polyfit(inputs - inputs.mean(), plain, 1)[0])
    sign = -1 if slope < 0.0 else 1
    if abs(abs(slope) - 1.0) > STAGE_SLOPE:
        return positioning_report(visits, gap_mm - plain, after if answer else None, changes, SIMULATION, sign)
    ideal = sign * inputs
    departure = plain - ideal
    if np.ptp(departure) > LINE * np.ptp(inputs):
        changes = {MODEL: departure, **changes}
    return positioning_report(visits, gap_mm - ideal, after if changes else None, changes, TARGET, sign)


def positioning_of_data(data: Observations, answer: Settings) -> PositioningReport | NoRepeatedTargets:
    """Positioning accuracy for a measured table, its model and a diagnosis, or the reason why there is none.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    answer : Settings
        Everything that the search found: effects with parameters and start states, and the curve of a map.
    """
    table, rows = data.table, data.table.input_mm.size

    def predict_mm(acting: Settings) -> Array:
        return np.asarray(data.chain.stacked(acting)[:rows], dtype=np.float64)

    along_mm, time_s, runs = recorded(table)
    if time_s is None:
        return NoRepeatedTargets("the table has no time_s, and without times the order of the rows is unknown")
    measured = np.zeros(along_mm.size, dtype=bool)
    measured[table.path_rows] = True
    return positioning_of_table(along_mm, measured, runs, time_s, table.gap_mm, predict_mm, answer)


def positioning_section(found: PositioningReport | NoRepeatedTargets) -> dict[str, object]:
    """Section `iso230` of report.json; `figures` is null, with the reason, if no targets are repeated."""
    if isinstance(found, NoRepeatedTargets):
        return {"standard": STANDARD, "figures": None, "reason": found.reason}
    return positioning_document(found)


def positioning_html(found: PositioningReport | NoRepeatedTargets) -> str | None:
    """Section of report.html with sentences, table and notes; None if no targets are repeated."""
    if isinstance(found, NoRepeatedTargets):
        return None
    head, rows = positioning_rows(found)
    told = "".join(f"<li>{escape(sentence)}</li>" for sentence in positioning_words(found))
    notes = "".join(f"<p>{escape(note)}</p>" for note in positioning_notes(found))
    return f"<ul>{told}</ul>{table(head, rows)}{notes}"
