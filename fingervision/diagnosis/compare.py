"""Compare a measured table with a model: where they disagree beyond the noise, without naming a cause."""

from dataclasses import dataclass, replace

import numpy as np

from fingervision.diagnosis.bodies.body_evidence import body_evidence, drawing_of
from fingervision.diagnosis.bodies.place_diagnosis import without_places
from fingervision.diagnosis.bodies.place_words import body_places
from fingervision.diagnosis.inference.held_out_prediction import rms_mm
from fingervision.diagnosis.inference.hypothesis import Problem
from fingervision.diagnosis.inference.plausibility import mistaken_column
from fingervision.diagnosis.inference.verdict import isolated, limited_noises_mm
from fingervision.diagnosis.input.intersample_interpolation import likelier_interpolation
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.input.preparation import prepare
from fingervision.diagnosis.report.residual_localization import by_channel, places
from fingervision.diagnosis.report.sentences import EDGES, within_clock
from fingervision.domain.effect import Array
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.report import Place
from fingervision.models.corrected import CorrectedModel

MOST_REFITS = 4
"""Most iterations of Newton's method for a drawing's uncertain dimensions; small changes of links and hinges need
two."""


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
        bound of the noise of one gap reading. Fast changes of the disagreement that no other pass repeats count as
        noise here.
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
    # Nothing has been explained yet, so that structure of the disagreement must not count as noise.
    problem = _within_limits(data, data.problem(residual, 0, explained=False), residual)
    found = places(data, problem, residual, np.random.default_rng(seed))
    answers = drawing_of(model) if table.channels else None
    if answers is not None:
        evidence, notes = body_evidence(table, answers, history.input_mm, np.random.default_rng(seed))
        found = (*found, *(() if evidence is None else body_places(evidence, answers)))
        data = replace(data, notes=(*data.notes, *notes))
    mistake = mistaken_column(data, problem, (problem.nothing(),))
    if mistake is not None:
        data = replace(data, notes=(*data.notes, mistake))
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


def _within_limits(data: Observations, problem: Problem, residual_mm: Array) -> Problem:
    """Reduce each channel's noise to what the fast changes and the repeated passes of the residual show."""
    whitener = problem.whitener
    errors = data.measured_pure_errors(np.split(whitener.aside, len(data.channels)))
    limits = limited_noises_mm(data, problem, residual_mm, repeated=errors is not None)
    noises = tuple(noise.scaled(limit / noise.total_mm) for noise, limit in zip(whitener.noises, limits, strict=True))
    return problem.judged_by(replace(whitener, noises=noises), data.aim_mm)
