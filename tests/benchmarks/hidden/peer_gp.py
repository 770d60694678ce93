"""Other method: a Gaussian process for the model's discrepancy (Kennedy & O'Hagan 2001), which names no effect."""

import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.hidden.catalogue_chain import Samples, respond
from tests.benchmarks.hidden.measured_table import read_measured, read_simulation

Array = NDArray[np.float64]
MOST_POINTS = 300


def _features(at: Samples) -> Array:
    way = np.concatenate([
        np.gradient(at.input_mm[a:b]) for a, b in zip(at.starts[:-1], at.starts[1:], strict=True)
    ])  # fmt: skip
    return np.column_stack([at.input_mm, np.sign(way) * (np.abs(way) > 1e-3 * np.ptp(at.input_mm))])


def gp_prediction(folder: Path, unseen: Samples) -> tuple[Array, Array]:
    """Predict gap and midline of an unseen run: simulation plus a Gaussian process over input and direction."""
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    table, model = read_measured(folder / "measured.csv"), read_simulation(folder / "simulation.csv")
    bare, ahead = respond(model, table.at, {}), respond(model, unseen, {})
    rows = np.linspace(0, len(table.gap_mm) - 1, min(MOST_POINTS, len(table.gap_mm))).astype(int)
    known = _features(table.at)
    centre, scale = known.mean(axis=0), known.std(axis=0) + 1e-9
    out = []
    for measured, before, after in ((table.gap_mm, bare[0], ahead[0]), (table.midline_mm, bare[1], ahead[1])):
        rest = (measured - before)[rows]
        size = rest.std() + 1e-9
        kernel = ConstantKernel(1.0) * RBF([1.0, 1.0]) + WhiteKernel(0.3)
        process = GaussianProcessRegressor(kernel, normalize_y=True, random_state=0)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            process.fit((known[rows] - centre) / scale, rest / size)
        out.append(after + size * process.predict((_features(unseen) - centre) / scale))
    return out[0], out[1]
