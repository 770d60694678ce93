"""Find sides of a body whose edges are blurred differently from its other sides, because of a shadow or glare.

A narrow shadow along an edge is a second step in the same profile. A shadow with a fraction q of the contrast and a
width w beyond the edge displaces the single fitted step by q w, and adds q (1 - q) w^2 to the squared blur of the step
(mean and variance of a mixture of two steps). Optics and defocus blur all sides equally; motion blurs opposite sides
equally, and displaces neither of them. If one side's squared blur differs by D from the blur that optics and motion
explain, its edges may be displaced by sqrt(|D| q / (1 - q)): by sqrt(|D|) if the shadow is half as dark as the body (q
= 1/2), by twice that for q = 4/5. The offset of a side with the excess D therefore has the standard uncertainty
sqrt(|D|).

A lens with distortion, or a camera that looks at the plane at an angle, magnifies the sides differently. The blur of
the optics is equal on all sides in the picture; the blur of an object out of focus is more nearly equal in the object
plane. The blurs of two sides are therefore accepted as equal if they are equal in the picture, in the object plane, or
in between.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SAME_LINE_PX = 0.5
"""Distance from a line within which chunks belong to one straight stretch; the rounding of a pose causes far less."""
OPPOSITE = -0.94
"""Cosine between the normals of two sides below which they count as opposite: at most 20 degrees from antiparallel, so
that motion blurs both equally within a tenth. Other sides that are not parallel count as crossing each other.
"""
SURE = 3.0
"""Difference in standard uncertainties above which a side counts as doubtful. One side in four hundred exceeds it by
chance, and then only has a larger uncertainty in that picture; for a side of one chunk (noise 4 for a contrast of 150,
blur 1.6 px) a shadow of 1 px and a fifth of the contrast is detected."""
OPTICS = 0.05
"""Share of the squared blur by which optics and defocus may let the sides of one body differ; this is a fortieth of the
blur itself."""


def sides_of(middles: Array, normals: Array) -> NDArray[np.intp]:
    """Index of the straight stretch to which each chunk belongs, shape (m,); chunks are in order along the outline.

    Parameters
    ----------
    middles, normals : ndarray of float, shape (2, m)
        Middles and unit normals of the chunks, in pixels.
    """
    side = np.zeros(middles.shape[1], dtype=np.intp)
    for k in range(1, side.size):
        off = abs(float((middles[:, k] - middles[:, k - 1]) @ normals[:, k]))
        is_on = off < SAME_LINE_PX and float(normals[:, k] @ normals[:, k - 1]) > 1.0 - 1e-6
        side[k] = side[k - 1] + (not is_on)
    return side


def doubtful_offsets(
    middles: Array, normals: Array, blur_px: Array, u_blur_px: Array, stretch: Array | None = None
) -> Array:
    """Uncertainty of the edge positions that is suggested by differences in blur between the sides of a body.

    Each column of the result is one standard uncertainty, which all chunks of one side share.

    Parameters
    ----------
    middles, normals : ndarray of float, shape (2, m)
        Middles and unit normals of the fitted chunks, in their order along the outline.
    blur_px, u_blur_px : ndarray of float, shape (m,)
        Gaussian sigma of each chunk's edge, and its standard uncertainty.
    stretch : ndarray of float, shape (m,), or None
        Distance across each edge in the undistorted plane over that in the picture; None for 1 everywhere.

    Returns
    -------
    ndarray of float, shape (m, k)
        For each of k doubtful sides a column with the standard uncertainty of its chunks' positions (px), and 0 for all
        other chunks.
    """
    side = sides_of(middles, normals)
    numbers = np.unique(side)
    square, variance = blur_px**2, np.maximum((2.0 * blur_px * u_blur_px) ** 2, 1e-12)
    mean, spread, normal = np.zeros(numbers.size), np.zeros(numbers.size), np.zeros((2, numbers.size))
    magnified = np.ones(numbers.size)
    for j, number in enumerate(numbers):
        own = side == number
        weight = 1.0 / variance[own]
        mean[j] = weight @ square[own] / weight.sum()
        chi_square = float(weight @ (square[own] - mean[j]) ** 2)
        spread[j] = max(1.0, chi_square / max(int(own.sum()) - 1, 1)) / weight.sum()
        normal[:, j] = normals[:, own].mean(axis=1)
        if stretch is not None:
            magnified[j] = stretch[own].mean()
    excess = _excess(mean, spread, normal, magnified)
    if not excess.any():
        return np.zeros((side.size, 0))
    # If one side has a shadow, the positions of the other sides have an uncertainty as well, from the uncertainty of
    # their blur.
    u_side = np.sqrt(np.where(excess > 0.0, excess, np.sqrt(spread)))
    return np.asarray(np.where(side[:, None] == numbers, u_side, 0.0))


def _excess(mean: Array, variance: Array, normal: Array, magnified: Array) -> Array:
    """Part of each side's squared blur that only a shadow explains, shape (k,); 0 for a side without shadow.

    Parameters
    ----------
    mean, variance : ndarray of float, shape (k,)
        Mean squared blur of each side, and the variance of this mean.
    normal : ndarray of float, shape (2, k)
        Outward normal of each side.
    magnified : ndarray of float, shape (k,)
        Mean stretch of each side.
    """
    cosine = normal.T @ normal
    apart = mean[:, None] - mean
    least = np.minimum(mean[:, None], mean)
    limit = np.hypot(SURE * np.sqrt(variance[:, None] + variance), OPTICS * least)
    limit += least * np.abs(np.exp(2.0 * np.abs(np.log(magnified[:, None] / magnified))) - 1.0)
    agree = np.abs(apart) <= limit
    across = np.abs(cosine) < -OPPOSITE
    found = np.zeros(mean.size)
    for j in range(mean.size):
        facing = cosine[j] < OPPOSITE
        if facing.any():
            # Motion blurs opposite sides equally, and equal shadows on opposite sides do not move the body.
            if agree[j, facing].any():
                continue
            is_usual, are_usual = (bool(agree[k][:, across[j]].any()) for k in ([j], np.flatnonzero(facing)))
            if not is_usual or are_usual:
                found[j] = np.abs(apart[j, facing]).min()
        elif across[j].any():
            # A side without an opposite side may be blurred by motion, which cannot be distinguished from a shadow.
            sharpest = int(np.flatnonzero(across[j])[np.argmin(mean[across[j]])])
            found[j] = apart[j, sharpest] if apart[j, sharpest] > limit[j, sharpest] else 0.0
    return found
