"""How much of each pixel a shape covers, seen through a Gaussian blur: exactly, as an integral along the outline.

Blur and the pixel's own square act together as the kernel K(x, y) = k(x) k(y), where k is the Gaussian averaged over
one pixel. The covered part of the pixel at p is the integral of K(p - q) over the shape; by Green's theorem this is

    V(p) = - integral round the outline of  c(p_x - q_x) k(p_y - q_y) dq_y,      c' = k,

and k and c have closed forms (error function and its integral). The outline is cut into panels of a few sigma, each
integrated by Gauss-Legendre: the integrand is analytic, so the error falls geometrically, without any raster. Panels
only touch pixels within REACH sigma; what lies to the right of them follows from a running sum along the row.
"""

from collections.abc import Callable, Sequence
from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from fingervision.rendering.outline import Line, Outline, Points

# Nodes of one panel and its length in sigma: together good to 1e-7 of full coverage (tests/rendering/test_coverage.py).
NODES = 10
PANEL_SIGMAS = 4.0
# The Gaussian's tail beyond this many sigma holds 6e-7.
REACH_SIGMAS = 5.0
# An arc is cut so that no panel turns further than this; a lens bends a straight line less per panel than this arc.
PANEL_TURN_RAD = 0.8
# No panel is longer, however wide the blur: the lens's map is then smooth along each.
PANEL_LONGEST_PX = 24.0

_GAUSS_X, _GAUSS_W = np.polynomial.legendre.leggauss(NODES)
_FRACTIONS = (_GAUSS_X + 1) / 2
_WEIGHTS = _GAUSS_W / 2
# Derivative at the nodes of the polynomial through them (barycentric form; Berrut and Trefethen, SIAM Rev. 46, 2004).
_bary = np.array([1.0 / np.prod(np.delete(x - _FRACTIONS, i)) for i, x in enumerate(_FRACTIONS)])
_difference = _FRACTIONS[:, None] - _FRACTIONS[None, :] + np.eye(NODES)
_DERIVATIVE = _bary[None, :] / _bary[:, None] / _difference
np.fill_diagonal(_DERIVATIVE, 0.0)
np.fill_diagonal(_DERIVATIVE, -_DERIVATIVE.sum(axis=1))


def panels(outlines: Sequence[Outline], blur_px: float) -> Points:
    """Cut outlines into panels and give the nodes of each.

    Parameters
    ----------
    outlines : sequence of Outline
        Closed curves; solids and holes.
    blur_px : float
        Standard deviation of the blur that the panels are short enough for.

    Returns
    -------
    ndarray of float, shape (panels, NODES, 2)
        Points at the Gauss-Legendre nodes.
    """
    longest = min(PANEL_SIGMAS * blur_px, PANEL_LONGEST_PX)
    lines: list[tuple[float, ...]] = []
    arcs: list[tuple[float, ...]] = []
    for outline in outlines:
        for piece in outline.pieces:
            if isinstance(piece, Line):
                count = max(1.0, np.ceil(piece.length_px / longest))
                lines.append((count, piece.x0_px, piece.y0_px, piece.x1_px - piece.x0_px, piece.y1_px - piece.y0_px))
            else:
                count = max(1.0, np.ceil(piece.length_px / longest), np.ceil(abs(piece.sweep_rad) / PANEL_TURN_RAD))
                arcs.append((count, piece.x_px, piece.y_px, piece.radius_px, piece.start_rad, piece.sweep_rad))
    nodes = []
    if lines:
        t, row = _fractions(np.array(lines))
        nodes.append(row[:, None, 1:3] + t[..., None] * row[:, None, 3:5])
    if arcs:
        t, row = _fractions(np.array(arcs))
        angle = row[:, None, 4] + t * row[:, None, 5]
        circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        nodes.append(row[:, None, 1:3] + row[:, None, 3:4] * circle)
    return np.concatenate(nodes) if nodes else np.zeros((0, NODES, 2))


def _fractions(rows: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Fractions of the piece at each panel's nodes, and each panel's piece; `rows` begin with the number of panels."""
    counts = rows[:, 0].astype(int)
    row = np.repeat(rows, counts, axis=0)
    place = np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)
    return (place[:, None] + _FRACTIONS) / row[:, :1], row


def coverage(
    outlines: Sequence[Outline],
    blur_px: float,
    width_px: int,
    height_px: int,
    picture_from_ideal: Callable[[Points], Points] | None = None,
) -> NDArray[np.float64]:
    """Covered part of each pixel after blur and pixel integration.

    Parameters
    ----------
    outlines : sequence of Outline
        Solids that do not overlap, and holes.
    blur_px : float
        Standard deviation of the Gaussian blur in the picture; positive.
    width_px, height_px : int
        Size of the frame.
    picture_from_ideal : callable, optional
        Lens and tilt: maps points (..., 2) from the ideal plane into the picture.

    Returns
    -------
    ndarray of float, shape (height_px, width_px)
        0 outside, 1 inside.
    """
    nodes = panels(outlines, blur_px)
    if picture_from_ideal is not None:
        nodes = picture_from_ideal(nodes)
    return integrate(nodes, blur_px, width_px, height_px)


def integrate(nodes: Points, blur_px: float, width_px: int, height_px: int) -> NDArray[np.float64]:
    """Integrate along panels that together are closed curves in the picture; see `coverage`."""
    reach = REACH_SIGMAS * blur_px + 1.0
    low, high = nodes.min(axis=1), nodes.max(axis=1)
    seen = (high[:, 1] > -reach - 1) & (low[:, 1] < height_px + reach) & (low[:, 0] < width_px + reach)
    nodes, low, high = nodes[seen], low[seen], high[seen]
    if len(nodes) == 0:
        return np.zeros((height_px, width_px))
    weight = -_WEIGHTS * (nodes[..., 1] @ _DERIVATIVE.T)
    first = np.floor(low - reach).astype(int)
    columns, rows = (np.ceil((high - low).max(axis=0) + 2 * reach).astype(int) + 2).tolist()

    # Positions of the pixels' edges about each node; differences of the primitives are integrals over pixels.
    y = first[:, None, 1:] + np.arange(rows + 1) - 0.5 - nodes[..., 1:]
    x = first[:, None, :1] + np.arange(columns + 2) - 1.5 - nodes[..., :1]
    kernel_y = np.diff(_gaussian_step(y, blur_px), axis=-1)
    kernel_x = np.diff(_gaussian_ramp(x, blur_px), n=2, axis=-1)
    patch = np.matmul(np.swapaxes(kernel_y, 1, 2) * weight[:, None, :], kernel_x)

    # Left of the frame everything adds to the first column; right of it and above and below it goes to waste.
    row = np.clip(first[:, 1:] + np.arange(rows), -1, height_px) + 1
    column = np.clip(first[:, :1] + np.arange(columns), 0, width_px)
    index = row[:, :, None] * (width_px + 1) + column[:, None, :]
    size = (height_px + 2) * (width_px + 1)
    steps = np.bincount(index.ravel(), weights=patch.ravel(), minlength=size).reshape(height_px + 2, width_px + 1)
    return np.cumsum(steps[1:-1, :-1], axis=1)


def _gaussian_step(t: NDArray[np.float64], sigma: float) -> NDArray[np.float64]:
    """Integral of the Gaussian."""
    return 0.5 * (1.0 + erf(t / (sigma * sqrt(2.0))))


def _gaussian_ramp(t: NDArray[np.float64], sigma: float) -> NDArray[np.float64]:
    """Integral of the integral of the Gaussian."""
    return t * _gaussian_step(t, sigma) + sigma / sqrt(2 * pi) * np.exp(-0.5 * (t / sigma) ** 2)
