"""The blur that a curved outline is felt through: along the edge, and by a fit along a slanted line."""

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.edge_filters import PIXEL_VARIANCE
from fingervision.vision.profile_lines import IS_ROW

Floats = NDArray[np.float64]


def curvature_gain(slope: Floats, reach_sigmas: Floats) -> Floats:
    """What a fit with two free levels makes of an edge whose distance along the line is not quite straight.

    Along a line that meets a curved edge at a slant of slope m, the distance to the edge is t + kappa m^2 t^2 / (2 (1 +
    m^2)^(1/2)). Projected on the fit's own directions over a window of w standard deviations this moves the position by
    m^2 c sigma^2 kappa / 2 across the edge, c = (1 / (4 sqrt pi) - 1 / 2w) / (1 / (2 sqrt pi) - 1 / 2w); the half-level
    itself is moved by sigma^2 kappa / 2.
    """
    level = 0.5 / np.maximum(reach_sigmas, 2.5)
    root = 0.5 / np.sqrt(np.pi)
    return np.asarray(1.0 + slope**2 * (0.5 * root - level) / (root - level))


def outline_blur(blur_px: Floats, slope: Floats, gain: Floats) -> Floats:
    """Blur (sigma_e, the pixel included) that the curvature of the outline is felt through, shape (2, PLACES).

    Blur along the edge moves a curved edge's half-level, blur across it does not. Motion makes the two differ: what is
    seen on the flanks is the blur across the fingers, what is seen on the tips that along them. What counts is the
    variance along the edge of what stays on it: det S / n' S n for a covariance S and the edge's normal n. What a fit
    with free levels adds on a slanted line comes from the blur across the edge, n' S n.

    Parameters
    ----------
    blur_px : ndarray of float, shape (2, 2)
        Gaussian sigma of the optics at each finger's flanks and tip, without the pixel.
    slope, gain : ndarray of float, shape (2, PLACES)
        Of every line, and what `curvature_gain` says of it.
    """
    across, along = blur_px[:, :1] ** 2 + PIXEL_VARIANCE, blur_px[:, 1:] ** 2 + PIXEL_VARIANCE
    steep = slope**2
    normal = np.where(IS_ROW, across + along * steep, along + across * steep) / (1.0 + steep)
    # A short window takes a little of a slanted line's share away: never all that stays on the edge.
    return np.asarray(np.sqrt(np.maximum(across * along / normal + (gain - 1.0) * normal, PIXEL_VARIANCE)))
