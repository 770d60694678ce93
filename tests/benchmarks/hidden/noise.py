"""Simulated errors of measurement: edge noise, offsets of runs, outliers, errors and steps of the recorded input."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Noise:
    """Noise of one experiment.

    Parameters
    ----------
    edge_mm : float
        Standard deviation of one edge.
    correlation : float
        AR(1) coefficient between successive frames of a run.
    run_offset_mm : float
        Standard deviation of one edge's offset per run.
    outlier_share : float
        Share of frames with a gross error on one edge.
    pixel_mm : float
        Rounding step of the edges; 0 for no rounding.
    input_mm : float
        Standard deviation of the white noise of the recorded input.
    encoder_step_mm : float
        Rounding step of the recorded input; 0 for no rounding.
    force_n : float
        Standard deviation of the force.
    """

    edge_mm: float
    correlation: float = 0.0
    run_offset_mm: float = 0.0
    outlier_share: float = 0.0
    pixel_mm: float = 0.0
    input_mm: float = 0.0
    encoder_step_mm: float = 0.0
    force_n: float = 0.02

    @property
    def input_variance_mm2(self) -> float:
        """Variance of the recorded input, including rounding."""
        return self.input_mm**2 + self.encoder_step_mm**2 / 12

    @property
    def edge_variance_mm2(self) -> float:
        """Variance of one edge, including rounding."""
        return self.edge_mm**2 + self.pixel_mm**2 / 12


def draw_noise(rng: np.random.Generator, runs: int, slope: float, width_mm: float) -> Noise:
    """Draw a random mixture of all kinds of noise; each kind is absent in about half of the cases."""
    edge = float(np.exp(rng.uniform(np.log(0.002), np.log(0.01))))
    correlation = float(rng.choice([0.0, 0.0, 0.3, 0.5, 0.8]))
    offset = edge * rng.uniform(0.3, 1.0) if runs > 1 and rng.random() < 0.4 else 0.0
    outliers = 0.01 if rng.random() < 0.35 else 0.0
    pixel = edge * rng.uniform(0.5, 1.5) if rng.random() < 0.2 else 0.0
    jitter, step = 0.0, 0.0
    kind = rng.random()
    if kind < 0.2:
        jitter = edge / slope * rng.uniform(0.2, 1.0)
    elif kind < 0.5:
        step = min(edge / slope * rng.uniform(0.5, 3.0), width_mm / 100)
    return Noise(edge, correlation, offset, outliers, pixel, jitter, step)


def edge_errors(rng: np.random.Generator, noise: Noise, count: int) -> Array:
    """Errors of left and right over one run, shape (2, count), in mm."""
    white = rng.standard_normal((2, count))
    rho = noise.correlation
    start = rng.standard_normal((2, 1))
    rest = lfilter([np.sqrt(1 - rho**2)], [1, -rho], white, axis=1, zi=rho * start)[0]
    errors = noise.edge_mm * rest + noise.run_offset_mm * rng.standard_normal((2, 1))
    wild = rng.random(count) < noise.outlier_share
    side = rng.integers(0, 2, count)
    errors[side[wild], np.flatnonzero(wild)] += (
        noise.edge_mm * rng.choice([-1, 1], wild.sum()) * rng.uniform(8, 40, wild.sum())
    )
    return np.asarray(errors)


def rounded(values_mm: Array, step_mm: float) -> Array:
    """Round values to whole steps; unchanged for a step of 0."""
    return values_mm if step_mm == 0 else step_mm * np.round(values_mm / step_mm)
