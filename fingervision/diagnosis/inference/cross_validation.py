"""Cross-validation: prediction error for each run that is left out of the fit."""

from dataclasses import replace

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.noise.run_offsets import RunOffsets
from fingervision.domain.effect import Array


def rms_mm(residual_mm: Array, samples: int, edges: bool) -> float:
    """RMS residual (mm) of left and right finger if both are measured, else of the gap; without the midline's constant.

    Parameters
    ----------
    residual_mm : ndarray of float, shape (channels * samples,)
        Gap, then midline.
    samples : int
        Number of rows in one channel.
    edges : bool
        Whether the second channel is the midline.
    """
    gap = residual_mm[:samples]
    if not edges:
        return float(np.sqrt(np.mean(gap**2)))
    midline = residual_mm[samples : 2 * samples]
    midline = midline - np.mean(midline)
    return float(np.sqrt(np.mean(0.25 * gap**2 + midline**2)))


def left_out_rms_mm(data: Observations, problem: Problem, best: Explanation) -> tuple[float | None, float | None]:
    """RMS prediction error (mm) of runs left out of the fit in turn, without and with effects; None for one run."""
    history = data.chain.history
    n, channels = history.input_mm.size, len(data.channels)
    if len(history.runs) < 2:
        return None, None
    before = data.stacked_mm - data.chain.stacked({})
    after = before.copy()
    for run in history.runs:
        if not best.names:
            break
        hidden = problem.whitener.aside.copy()
        for channel in range(channels):
            hidden[channel * n + run.start : channel * n + run.stop] = True
        whitener = replace(problem.whitener, aside=hidden)
        rest = replace(problem, whitener=whitener, measured=whitener.one(data.aim_mm), offsets=RunOffsets.of(whitener))
        fitted = fit(rest, best.names, best.values, sigma_mm=best.sigma_mm, iterations=6)
        residual = data.stacked_mm - data.chain.stacked(fitted.values)
        for channel in range(channels):
            rows = slice(channel * n + run.start, channel * n + run.stop)
            after[rows] = residual[rows]
    return rms_mm(before, n, history.both_edges), rms_mm(after, n, history.both_edges)
