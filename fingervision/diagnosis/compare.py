"""Where a measured table and a model disagree, without a word about why."""

from dataclasses import dataclass

import numpy as np

from fingervision.diagnosis.bench_data import BenchData, prepare
from fingervision.diagnosis.diagnose import by_channel, places
from fingervision.diagnosis.unseen_runs import rms_mm
from fingervision.domain.effect import Array
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.report import Place
from fingervision.models.corrected import CorrectedModel

MOST_REFITS = 4
"""Steps of Newton's rule for a drawing's uncertain numbers; small changes of links and hinges need two."""


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Regions that cannot be noise, and the residual that they were found in.

    Parameters
    ----------
    bench : BenchData
        Measurement and model.
    residual_mm : dict of ndarray of float, shape (n,)
        Measured minus predicted, by channel.
    places : tuple of Place
        Largest first.
    rms_mm, noise_mm : float
        Disagreement and noise of one gap reading.
    """

    bench: BenchData
    residual_mm: dict[str, Array]
    places: tuple[Place, ...]
    rms_mm: float
    noise_mm: float

    def document(self) -> dict[str, object]:
        """Lay the comparison out for programs."""
        return {
            "schema": 1,
            "rms_mm": self.rms_mm,
            "noise_mm": self.noise_mm,
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
            "notes": [*self.bench.notes, *self.bench.refitted()],
        }


def compare(table: MeasuredTable, model: CorrectedModel, *, seed: int = 1) -> Comparison:
    """Find where a measured table and a model disagree beyond the noise."""
    bench = prepare(table, model)
    residual = bench.stacked_mm - bench.chain.stacked({})
    problem = bench.problem(residual, 0, explained=False)
    for _ in range(MOST_REFITS if bench.refit.moved else 0):
        nearer = bench.redrawn(problem, problem.nothing())
        settled = nearer.straight(bench, problem)
        bench = nearer
        residual = bench.stacked_mm - bench.chain.stacked({})
        problem = bench.problem(residual, 0, explained=False)
        if settled:
            break
    found = places(bench, problem, residual, np.random.default_rng(seed))
    history = bench.chain.history
    rms = rms_mm(residual, history.input_mm.size, history.both_edges)
    return Comparison(bench, by_channel(bench, residual), found, rms, problem.whitener.noises[0].total_mm)
