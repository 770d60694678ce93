"""Hide an effect in made-up data and diagnose them: the least that an effect of the catalogue must stand."""

from collections.abc import Mapping

import numpy as np

from fingervision.diagnosis.diagnose import diagnose
from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.domain.effect import History
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.report import DiagnosisReport
from fingervision.models.corrected import CorrectedModel
from fingervision.models.table import TableModel

NOISE_MM = 5e-4
"""Random noise of an ordinary bench (0.02 px at 34 px/mm)."""


def diagnosed(name: str, values: Mapping[str, float], *, seed: int = 1) -> DiagnosisReport:
    """Hide an effect of the catalogue in two runs there and back, with noise, and diagnose them.

    Parameters
    ----------
    name : str
        The effect: built in, installed, or registered by `fingervision.effects.register`.
    values : mapping of str to float
        Its parameters.
    seed : int
        Of the noise.
    """
    input_mm = np.array([-0.6, 1.6])
    gap_mm = 4.0 + 7.7 * input_mm
    model = TableModel("straight", input_mm, -0.5 * gap_mm, 0.5 * gap_mm)
    rng = np.random.default_rng(seed)
    up = np.linspace(-0.45, 1.45, 100)
    run = np.concatenate([up, up[::-1]])
    u = np.concatenate([run, run])
    runs = (slice(0, run.size), slice(run.size, u.size))
    time_s = np.arange(u.size, dtype=np.float64) * np.float64(0.04)
    history = History(u, time_s, runs, rest_gap_mm=4.0, opening_mm=11.2, closing_mm=3.5)
    seen = MeasuringChain(model, history, {}).respond({name: values})
    left_mm, right_mm = (edge + NOISE_MM * rng.standard_normal(u.size) for edge in (seen.left_mm, seen.right_mm))
    table = MeasuredTable(u, right_mm - left_mm, np.asarray(0.5 * (left_mm + right_mm)), time_s, runs, ("1", "2"))
    return diagnose(table, CorrectedModel("straight", model, "straight.csv", (-0.6, 1.6), {}), seed=seed).report
