"""Standard uncertainty of the fitted blur of flanks and tips, due to the picture's noise and its codec.

For a step of contrast A blurred by sigma, the derivative of a line's light with respect to position has the squared
norm A^2 / (2 sqrt(pi) sigma), and the derivative with respect to sigma has half this squared norm. Noise of standard
deviation n on N lines therefore causes the standard uncertainty n / A sqrt(4 sqrt(pi) sigma / N) of sigma (Cramer-Rao
bound; Kay, Estimation Theory, 1993, section 3.9). If a codec may change the light by a certain squared error, it may
displace the edge by d, or widen the edge by sqrt(2) d with the same squared error.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.edge_filters import PIXEL_VARIANCE
from fingervision.vision.edges import EdgePoints
from fingervision.vision.profile_lines import IS_INNER, IS_ROW

Floats = NDArray[np.float64]
# Function that returns the standard uncertainty, due to a codec, of the positions of the left and of the right finger's
# edges (pixels).
Displacement = Callable[[EdgePoints], tuple[float, float]]


def not_displaced(_edges: EdgePoints) -> tuple[float, float]:
    """Displacement of edges (px) by the codec of an uncompressed picture, which is zero."""
    return 0.0, 0.0


def u_squared_blur(edges: EdgePoints, displaced_px: tuple[float, float]) -> Floats:
    """Standard uncertainty of the squared spread of each finger's flanks and tip, shape (2, 2) (pixels squared).

    Parameters
    ----------
    edges : EdgePoints
        Steps that were fitted to every line.
    displaced_px : (float, float)
        Standard uncertainty of the position of the left and of the right finger's edges by a codec (pixels); 0 for a
        picture that was not compressed.

    Returns
    -------
    ndarray of float, shape (2, 2)
        Indices: left or right finger; flanks or tip.
    """
    spread = np.sqrt(edges.blur_px**2 + PIXEL_VARIANCE)
    by_noise = np.zeros((2, 2))
    for part, is_part in enumerate((IS_INNER, ~IS_ROW)):
        is_seen = edges.lines.weight[:, is_part] > 0
        contrast = np.abs(edges.contrast[:, is_part])
        # Lines of different contrast are weighted by the square of their contrast.
        power = np.maximum(np.where(is_seen, contrast**2, 0.0).sum(axis=1), 1e-9)
        by_noise[:, part] = edges.noise * np.sqrt(4.0 * np.sqrt(np.pi) * edges.shared_lines * spread[:, part] / power)
    u_blur = np.hypot(by_noise, np.sqrt(2.0) * np.array(displaced_px)[:, None])
    return np.asarray(2.0 * spread * u_blur)
