"""Smooth maps of position errors, as of screws and scales."""

from dataclasses import dataclass

import numpy as np

from tests.benchmarks.world.rig import Array


@dataclass(frozen=True, slots=True, eq=False)
class ErrorMap:
    """A sum of cosines over the travel, with its straight line subtracted, scaled to an RMS over the travel.

    Parameters
    ----------
    low_mm, high_mm : float
        Ends of the travel.
    weights, phases : ndarray, shape (k,)
        Weights and phases of the cosines with 1/2, 1, 3/2, ... periods over the travel.
    line : ndarray, shape (2,)
        Coefficients of the subtracted straight line.
    scale : float
    """

    low_mm: float
    high_mm: float
    weights: Array
    phases: Array
    line: Array
    scale: float

    def _waves(self, u_mm: Array) -> Array:
        z = (np.asarray(u_mm) - self.low_mm) / (self.high_mm - self.low_mm)
        count = np.arange(1, self.weights.size + 1)
        return np.cos(np.pi * np.multiply.outer(z, count) + self.phases) @ self.weights

    def __call__(self, u_mm: Array) -> Array:
        """Error (mm) at each position."""
        z = (np.asarray(u_mm) - self.low_mm) / (self.high_mm - self.low_mm)
        return np.asarray(self.scale * (self._waves(u_mm) - np.polyval(self.line, z)))


def draw_map(rng: np.random.Generator, places_mm: Array, rms_mm: float, waves: int) -> ErrorMap:
    """Draw a map; its line and RMS are computed over `places_mm`, the positions of readings."""
    low, high = float(np.min(places_mm)), float(np.max(places_mm))
    count = np.arange(1, waves + 1)
    weights = rng.standard_normal(waves) / (1 + count)
    raw = ErrorMap(low, high, weights, rng.uniform(0, 2 * np.pi, waves), np.zeros(2), 1.0)
    z = (places_mm - low) / (high - low)
    line = np.polyfit(z, raw(places_mm), 1)
    bent = raw(places_mm) - np.polyval(line, z)
    return ErrorMap(low, high, weights, raw.phases, line, rms_mm / float(np.sqrt(np.mean(bent**2))))
