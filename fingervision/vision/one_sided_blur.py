"""Sides of a body whose edges have another blur than its other sides: a shadow, or glare, lies along them.

A narrow shadow along an edge is a second step in the same profile. With a fraction q of the contrast, at a distance w
beyond the edge, it displaces the single fitted step by q w, and adds q (1 - q) w^2 to the square of its blur (mean and
variance of a mixture of two steps). Optics and defocus blur all sides equally; motion blurs opposite sides equally, and
displaces neither. A remaining difference D of one side's squared blur means that its edges may be displaced by sqrt(|D|
q / (1 - q)): sqrt(|D|) if the shadow is half as dark as the body, twice that at four fifths. The offset of this side
therefore has the standard uncertainty sqrt(|D|).
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SAME_LINE_PX = 0.5
"""Chunks of one stretch lie on one line: what a pose's own rounding leaves is far less."""
OPPOSITE = -0.94
"""Cosine between the normals of opposite sides: 20 degrees apart at most, where motion blurs both alike to a tenth.
Sides whose normals are farther from being parallel than that lie across each other."""
SURE = 3.0
"""Standard uncertainties. A side in four hundred differs by chance, and is then only less sure in that picture; a side
of one chunk (noise 4 of contrast 150, blur 1.6 px) shows a shadow of 1 px and a fifth of the contrast."""
OPTICS = 0.05
"""Share of a blur's square by which optics and defocus let sides of one body differ: a fortieth of the blur itself."""


def sides_of(middles: Array, normals: Array) -> NDArray[np.intp]:
    """Number of the straight stretch to which each chunk belongs, shape (m,); chunks are in order along the outline.

    Parameters
    ----------
    middles, normals : ndarray of float, shape (2, m)
        Of the chunks, in pixels.
    """
    side = np.zeros(middles.shape[1], dtype=np.intp)
    for k in range(1, side.size):
        off = abs(float((middles[:, k] - middles[:, k - 1]) @ normals[:, k]))
        is_on = off < SAME_LINE_PX and float(normals[:, k] @ normals[:, k - 1]) > 1.0 - 1e-6
        side[k] = side[k - 1] + (not is_on)
    return side


def doubtful_offsets(middles: Array, normals: Array, blur_px: Array, u_blur_px: Array) -> Array:
    """Uncertainty of the edges' positions from each side's blur: one standard uncertainty per column, shape (m, k).

    Parameters
    ----------
    middles, normals : ndarray of float, shape (2, m)
        Of the chunks that were fitted, in their order along the outline.
    blur_px, u_blur_px : ndarray of float, shape (m,)
        Gaussian sigma of each one's edge, and its standard uncertainty.

    Returns
    -------
    ndarray of float, shape (m, k)
        For each of k doubtful sides, its u for the chunks that are its own, 0 for all others.
    """
    side = sides_of(middles, normals)
    numbers = np.unique(side)
    square, variance = blur_px**2, np.maximum((2.0 * blur_px * u_blur_px) ** 2, 1e-12)
    mean, spread, normal = np.zeros(numbers.size), np.zeros(numbers.size), np.zeros((2, numbers.size))
    for j, number in enumerate(numbers):
        own = side == number
        weight = 1.0 / variance[own]
        mean[j] = weight @ square[own] / weight.sum()
        chi_square = float(weight @ (square[own] - mean[j]) ** 2)
        spread[j] = max(1.0, chi_square / max(int(own.sum()) - 1, 1)) / weight.sum()
        normal[:, j] = normals[:, own].mean(axis=1)
    excess = _excess(mean, spread, normal)
    if not excess.any():
        return np.zeros((side.size, 0))
    # Where there is a shadow, what the blur of the other sides leaves open of theirs is in doubt as well.
    u_side = np.sqrt(np.where(excess > 0.0, excess, np.sqrt(spread)))
    return np.asarray(np.where(side[:, None] == numbers, u_side, 0.0))


def _excess(mean: Array, variance: Array, normal: Array) -> Array:
    """Excess of each side's squared blur that a shadow would explain; 0 where nothing suggests one, (k,).

    Parameters
    ----------
    mean, variance : ndarray of float, shape (k,)
        Square of the blur of each side, and the variance of that.
    normal : ndarray of float, shape (2, k)
        Out of the body.
    """
    cosine = normal.T @ normal
    apart = mean[:, None] - mean
    limit = np.hypot(SURE * np.sqrt(variance[:, None] + variance), OPTICS * np.minimum(mean[:, None], mean))
    agree = np.abs(apart) <= limit
    across = np.abs(cosine) < -OPPOSITE
    found = np.zeros(mean.size)
    for j in range(mean.size):
        facing = cosine[j] < OPPOSITE
        if facing.any():
            # Motion blurs both alike, and the same shadow on both moves the body no way.
            if agree[j, facing].any():
                continue
            is_usual, are_usual = (bool(agree[k][:, across[j]].any()) for k in ([j], np.flatnonzero(facing)))
            if not is_usual or are_usual:
                found[j] = np.abs(apart[j, facing]).min()
        elif across[j].any():
            # An edge with none opposite may also be blurred by motion, which nothing tells from a shadow.
            sharpest = int(np.flatnonzero(across[j])[np.argmin(mean[across[j]])])
            found[j] = apart[j, sharpest] if apart[j, sharpest] > limit[j, sharpest] else 0.0
    return found
