"""Data for other methods that name effects: whitened residuals and linear signatures, from the files only."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.hidden.candidates import candidates
from tests.benchmarks.hidden.catalogue_chain import respond
from tests.benchmarks.hidden.fit import Problem
from tests.benchmarks.hidden.linear_signatures import Library
from tests.benchmarks.hidden.measured_table import read_measured, read_simulation
from tests.benchmarks.hidden.noise import Noise
from tests.benchmarks.hidden.weights import Weights

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Whitened:
    """Whitened residual, and signatures with the effects to which they belong."""

    residual: Array
    library: Library
    names: tuple[str, ...]


def _spread(values: Array) -> float:
    return float(1.4826 * np.median(np.abs(values - np.median(values))))


def whiten(folder: Path) -> Whitened:
    """Estimate the noise from differences within runs (white part and AR(1) from lags one to three), and whiten all
    signatures.
    """
    table, model = read_measured(folder / "measured.csv"), read_simulation(folder / "simulation.csv")
    bare = respond(model, table.at, {})
    model = replace(model, placement_mm=float(np.median(table.midline_mm - bare[1])))
    bare = respond(model, table.at, {})
    gap, midline = table.gap_mm - bare[0], table.midline_mm - bare[1]
    inside = np.ones(len(gap) - 3, dtype=bool)
    for start in table.at.starts[1:-1]:
        inside[start - 3 : start] = False
    lags = [_spread((midline[k:] - midline[:-k])[: len(inside)][inside]) for k in (1, 2, 3)]
    rho = float(np.clip((lags[1] / max(lags[0], 1e-12)) ** 2 - 1, 0.0, 0.95))
    middle_sd = lags[0] / np.sqrt(2 * (1 - rho))
    gap_sd = _spread(np.diff(gap)) / np.sqrt(2 * (1 - rho))
    force_sd = _spread(np.diff(table.force_n - bare[2])) / np.sqrt(2) if table.has_force else None
    ones = np.ones_like(gap)
    weights = Weights(gap_sd * ones, middle_sd * ones, rho, 0.0, table.at.starts, force_sd)
    step = np.abs(np.diff(table.at.input_mm))
    quantum = float(np.min(step[step > 1e-9], initial=1.0))
    noise = Noise(middle_sd, encoder_step_mm=quantum if quantum > 1e-6 else 0.0)
    known = candidates(model, table.at, noise, time_restarts=table.time_restarts, has_force=table.has_force)
    problem = Problem(model, table.at, weights)
    library = Library.of(problem, known)
    residual = weights.apply(gap, midline, table.force_n - bare[2])
    size = _spread(residual)
    residual = np.clip(residual, -6 * size, 6 * size)
    return Whitened(residual, library, tuple(c.name for c in known))
