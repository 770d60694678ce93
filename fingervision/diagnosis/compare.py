"""Compare a measured table with a model: where they disagree beyond the noise, without naming a cause."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fingervision.diagnosis.bodies.body_evidence import body_evidence, drawing_of
from fingervision.diagnosis.bodies.place_diagnosis import without_places
from fingervision.diagnosis.bodies.place_words import body_places
from fingervision.diagnosis.inference.held_out_prediction import rms_mm
from fingervision.diagnosis.inference.plausibility import mistaken_column
from fingervision.diagnosis.inference.verdict import isolated
from fingervision.diagnosis.input.intersample_interpolation import likelier_interpolation
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.input.preparation import prepare
from fingervision.diagnosis.report.clock_words import within_clock
from fingervision.diagnosis.report.residual_channels import by_channel, places
from fingervision.diagnosis.report.sentences import EDGES
from fingervision.domain.effect import Array, History
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.report import Place
from fingervision.models.corrected import CorrectedModel

MOST_REFITS = 4
"""Most iterations of Newton's method for a drawing's uncertain dimensions; small changes of links and hinges need
two."""

PIECE_S, LEAST_PIECE = 1.0, 12
"""Length of a straight piece in seconds, and least number of samples; only faster changes count as noise."""


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Result of a comparison: the residual, and the regions where the residual is more than noise.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    residual_mm : dict of ndarray of float, shape (n,)
        Measured minus predicted, by channel.
    places : tuple of Place
        Regions, largest first.
    rms_mm, noise_mm : float
        RMS disagreement over all rows, of each finger's edge if both edges were measured, else of the gap; and an upper
        bound of the noise of one gap reading. Fast changes of the disagreement count as noise here, so that this bound
        is larger for a model that deviates more.
    counted_rms_mm : float
        RMS disagreement without the rows in `left_out`.
    left_out : tuple of int
        Outliers that stand alone.
    """

    data: Observations
    residual_mm: dict[str, Array]
    places: tuple[Place, ...]
    rms_mm: float
    noise_mm: float
    counted_rms_mm: float
    left_out: tuple[int, ...]

    def words(self) -> str:
        """Return disagreement and noise as a part of a sentence."""
        of = EDGES if self.data.chain.history.both_edges else ""
        rows = f"{len(self.left_out)} of {self.data.table.gap_mm.size} rows"
        without = f" ({self.counted_rms_mm:.3g} mm without {rows} left out as outliers)" if self.left_out else ""
        return f"RMS disagreement {self.rms_mm:.3g} mm{of}{without}, noise of the gap at most {self.noise_mm:.2g} mm"

    def document(self) -> dict[str, object]:
        """Return the comparison as a mapping that can be written as JSON."""
        return {
            "schema": 1,
            "rms_mm": self.rms_mm,
            "noise_mm": self.noise_mm,
            "of": "edges" if self.data.chain.history.both_edges else "gap",
            "counted_rms_mm": self.counted_rms_mm,
            "rows": self.data.table.gap_mm.size,
            "rows_left_out": len(self.left_out),
            "where": [
                {
                    "channel": p.channel,
                    "variable": p.variable,
                    "from": p.start,
                    "to": p.end,
                    "size": p.size,
                    "unit": p.unit,
                    "sigma": p.sigma,
                    "words": p.words,
                }
                for p in self.places
            ],
            "notes": [*self.data.notes, *self.data.refitted()],
        }


def rough(residual_mm: Array, history: History) -> Array:
    """Residual minus straight segments from reversal to reversal in each run; same shape as the residual.

    A jump at a reversal contains all frequencies, so that a spectrum would count it as noise.
    """
    n = history.input_mm.size
    if history.time_s is None:
        return residual_mm
    rest = residual_mm.copy()
    piece = max(LEAST_PIECE, round(PIECE_S / history.sample_time_s))
    for run in history.runs:
        way = np.sign(np.diff(history.input_mm[run], prepend=history.input_mm[run][0]))
        turns = np.flatnonzero(np.diff(way)) + 1
        ends = [0]
        for turn in turns:
            if turn - ends[-1] >= piece:
                ends.append(int(turn))
        ends.append(run.stop - run.start)
        for start, stop in pairwise(ends):
            at = np.arange(stop - start)
            knots = np.linspace(0, max(1, stop - start - 1), 1 + max(1, (stop - start) // piece))
            hats = np.maximum(0.0, 1.0 - np.abs(at[:, None] - knots) / (knots[1] - knots[0]))
            for channel in range(residual_mm.size // n):
                rows = slice(channel * n + run.start + start, channel * n + run.start + stop)
                rest[rows] -= hats @ np.linalg.lstsq(hats, rest[rows], rcond=None)[0]
    return rest


def compare(table: MeasuredTable, model: CorrectedModel, *, seed: int = 1) -> Comparison:
    """Find where a measured table and a model disagree beyond the noise."""
    table, model = without_places(table, model)
    data = prepare(table, model)
    over = data.with_overshoots()
    if np.sum((data.stacked_mm - over.chain.stacked({})) ** 2) < np.sum(
        (data.stacked_mm - data.chain.stacked({})) ** 2
    ):
        data = over
    residual = data.stacked_mm - data.chain.stacked({})
    problem = data.problem(residual, 0, explained=False)
    # If the model includes a delay, interpolate the input as in a diagnosis.
    data = likelier_interpolation(data, problem, problem.nothing())
    residual = data.stacked_mm - data.chain.stacked({})
    for _ in range(MOST_REFITS if data.refit.moved else 0):
        nearer = data.redrawn(problem, problem.nothing())
        settled = nearer.straight(data, problem)
        data = nearer
        residual = data.stacked_mm - data.chain.stacked({})
        problem = data.problem(residual, 0, explained=False)
        if settled:
            break
    history = data.chain.history
    # Nothing has been explained yet, so that changes of the disagreement over seconds must not count as noise.
    problem = data.problem(rough(residual, history), 0, explained=False)
    found = places(data, problem, residual, np.random.default_rng(seed))
    answers = drawing_of(model) if table.channels else None
    if answers is not None:
        evidence, notes = body_evidence(table, answers, history.input_mm, np.random.default_rng(seed))
        found = (*found, *(() if evidence is None else body_places(evidence, answers)))
        data = replace(data, notes=(*data.notes, *notes))
    mistake = mistaken_column(data, problem, (problem.nothing(),))
    if mistake is not None:
        data = replace(data, notes=(*data.notes, mistake.words))
    n, both = history.input_mm.size, history.both_edges
    aside = isolated(residual[:n], problem.whitener.aside[:n], history.runs)
    counted = np.concatenate([part[~aside] for part in np.split(residual, len(data.channels))])
    return Comparison(
        data,
        by_channel(data, residual),
        within_clock(found, data),
        rms_mm(residual, n, both),
        problem.whitener.noises[0].total_mm,
        rms_mm(counted, int(np.sum(~aside)), both),
        tuple(np.flatnonzero(aside).tolist()),
    )
