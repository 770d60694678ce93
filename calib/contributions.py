"""Sources of a distance's uncertainty, one function for each source; only `calib.budget` combines the sources.

Every function returns a standard uncertainty in millimetres, shape (n,), for n distances. The formula is
gap_mm = (gap_px + p b) / s, where gap_px is the measured width, s the scale, b the edge bias, and p = +1 for a light
gap and -1 for a dark gap (JCGM 100:2008, equation 13).
"""

from math import cos, sqrt

import numpy as np
from numpy.typing import NDArray

from calib.limits import Limits, rectangular

Floats = NDArray[np.float64]


def edge_noise_mm(u_random_px: Floats, px_per_mm: float) -> Floats:
    """Contribution of the noise of the two edges, the only contribution that differs from frame to frame."""
    return np.asarray(u_random_px / px_per_mm)


def estimator_mm(limits: Limits, px_per_mm: float, count: int) -> Floats:
    """Contribution of the edge fit's phase error, for two independent edges."""
    return np.full(count, sqrt(2.0) * rectangular(limits.estimator_px) / px_per_mm)


def scale_and_bias_mm(value_mm: Floats, polarity: Floats, px_per_mm: float, covariance: Floats) -> Floats:
    """Contribution of one cause that changes scale and edge bias, from the covariance of (px_per_mm, edge_bias_px).

    The function is called once for each cause: the reference's size, the reference's edges, and the edge bias if no
    reference determines it.
    """
    variance = (
        covariance[1, 1] + value_mm**2 * covariance[0, 0] - 2.0 * polarity * value_mm * covariance[0, 1]
    ) / px_per_mm**2
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def plane_mm(value_mm: Floats, limits: Limits) -> Floats:
    """Contribution of a plane that is not at the distance Z of the reference from the camera: dg / g = dz / Z."""
    return np.asarray(np.abs(value_mm) * rectangular(limits.plane_mm) / limits.camera_distance_mm)


def foreshortening_mm(value_mm: Floats, limits: Limits) -> Floats:
    """Contribution of oblique view: a distance is shortened by the factor cos(tilt)."""
    return np.asarray(np.abs(value_mm) * rectangular(1.0 - cos(limits.tilt_rad)))


def keystone_mm(change_mm_per_rad: Floats, limits: Limits) -> Floats:
    """Contribution of the perspective of a tilted plane; `change_mm_per_rad` has shape (2, n), one row per axis."""
    return np.asarray(np.hypot(change_mm_per_rad[0], change_mm_per_rad[1]) * rectangular(limits.tilt_rad))


def lens_mm(change_mm_per_unit: Floats, limits: Limits) -> Floats:
    """Contribution of residual lens distortion, from the change per unit of distortion of distance minus scale."""
    return np.asarray(np.abs(change_mm_per_unit) * rectangular(limits.lens_relative))


def lens_fit_mm(change_px: Floats, covariance: Floats, px_per_mm: float) -> Floats:
    """Contribution of a calibrated lens, from `change_px` per unit of each parameter, shape (p, n), and covariance."""
    variance = np.einsum("in,ij,jn->n", change_px, covariance, change_px)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)) / px_per_mm)


def temperature_mm(value_mm: Floats, limits: Limits) -> Floats:
    """Contribution of thermal expansion of the reference relative to the temperature of its certificate."""
    return np.asarray(np.abs(value_mm) * limits.expansion_per_k * rectangular(limits.temperature_k))
