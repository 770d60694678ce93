"""Fit of the edge in every stretch of a body's outline: offset from the drawing, blur, and uncertainties.

The straight stretches of an outline are divided into chunks about a millimetre long. In each chunk one blurred step is
fitted to all pixels near the edge, I = a + b Phi(-(s - d) / sigma_e), with s the pixel's distance along the outward
normal and d the offset of the edge. The picture is not resampled, so that the sub-pixel phase causes no bias.
"""

from dataclasses import dataclass, field, replace
from math import ceil
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

Array = NDArray[np.float64]

REACH_PX = 6.0
"""Half width of the window across an edge, in pixels: three times a blur of 1.5 px, plus a margin for the search."""
LEAST_CONTRAST = 5.0
"""Least contrast of an edge, in standard deviations of a pixel's noise."""
FARTHEST_PX = 3.5
"""Largest distance of an edge from its expected position; farther away the window does not contain all of it."""
BLURS_PX = (0.4, 3.5)
"""Range of the blur: within a pixel a blur below 0.4 px cannot be distinguished from 0.4 px, and edges wider than 3.5
px do not fit into the window."""
OTHER_LEVEL, OTHER_CONTRAST, OTHER_BLUR, OTHER_BLUR_PX, OTHER_NOISE = 0.3, (0.4, 2.5), 1.25, 0.2, 4.0
"""Limits of the difference between a chunk and the other chunks of its body: level of the body (in contrasts), contrast
(relative to the median), blur (a factor, and pixels added), noise (a factor; relative to the lower quartile). An edge
outside these limits is that of a shadow, or two edges fitted as one: a cast shadow has another level inside, and an
edge with a shadow of 3 px has twice the blur. Texture of a sixth of the contrast is within the limits.
"""
LEAST_WINDOW = 0.7
"""Least share of a chunk's window that must lie in the picture: an edge in the middle of the window then has background
and body on its two sides."""


@dataclass(frozen=True, slots=True, eq=False)
class Chunks:
    """Short stretches of a body's outline.

    Parameters
    ----------
    middles : ndarray of float, shape (2, m)
        Middles of the stretches.
    normals : ndarray of float, shape (2, m)
        Outward unit normals.
    half_length : float
        Half the length of a stretch.
    bends : ndarray of float, shape (m, k)
        Outward displacement of every stretch by one standard deviation of each of the k ways in which the body bends
        beside its rigid motion.
    """

    middles: Array
    normals: Array
    half_length: float
    bends: Array = field(default_factory=lambda: np.zeros((0, 0)))

    def moved(self, shift: Array, angle: float, about: Array) -> "Chunks":
        """Move the chunks rigidly: rotation about a point, then a shift."""
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s], [s, c]])
        middles = turn @ (self.middles - about[:, None]) + (about + shift)[:, None]
        return replace(self, middles=middles, normals=turn @ self.normals)


class FlatMap(Protocol):
    """Map, in both directions, between the picture and the object plane without perspective and distortion (px)."""

    def to_flat(self, points: Array) -> Array:
        """Remove lens distortion and perspective from points, shape (2, n)."""
        ...

    def to_picture(self, points: Array) -> Array:
        """Apply lens distortion and perspective to points, shape (2, n)."""
        ...


@dataclass(frozen=True, slots=True)
class EdgeView:
    """How the edges of bodies appear in a picture.

    Parameters
    ----------
    flat : FlatMap or None
        Map that removes lens distortion and perspective; chunks and motions are then given in the undistorted plane.
        None for a picture without distortion and perspective.
    outward_px : float
        Edge bias: distance by which an edge appears outside its body, in pixels of the picture.
    shared_pixels : float
        Number of neighbouring pixels that share an error (from a codec) and count as one pixel.
    body_level, contrast : float or None
        Level of the bodies, and difference of the background from it; None if not known.
    u_outward_px, u_size : float
        Standard uncertainties of `outward_px` and (relative) of the bodies' sizes. The caller propagates them by
        `RigidFit.by_outward` and `by_scale`; the scatter that they cause among the edges is therefore not counted again
        in the covariance.
    """

    flat: FlatMap | None = None
    outward_px: float = 0.0
    shared_pixels: float = 1.0
    body_level: float | None = None
    contrast: float = 0.0
    u_outward_px: float = 0.0
    u_size: float = 0.0


PLAIN = EdgeView()
_GAUSS = np.array([-(0.6**0.5), 0.0, 0.6**0.5])
_GAUSS_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0
"""Weights of three-point Gauss-Legendre quadrature: exact for the mean over a chunk of a polynomial of degree five."""


@dataclass(frozen=True, slots=True, eq=False)
class ChunkEdges:
    """Edges fitted in m chunks; each attribute is an array of shape (m,).

    Parameters
    ----------
    offset, variance : ndarray of float, shape (m,)
        Distance of the edge outside its expected position in px of the undistorted plane, and its variance due to the
        pixels' noise.
    blur, u_blur : ndarray of float, shape (m,)
        Gaussian sigma of the optics (px), and its standard uncertainty.
    stretch : ndarray of float, shape (m,)
        Distance across the edge in the undistorted plane over that in the picture.
    used, in_view : ndarray of bool, shape (m,)
        Whether the chunk shows an edge of the body, and whether the chunk lies in the picture.
    """

    offset: Array
    variance: Array
    blur: Array
    u_blur: Array
    stretch: Array
    used: NDArray[np.bool_]
    in_view: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class _InPicture:
    """Chunks in picture coordinates, and the ratio of distances across them in the undistorted plane to the picture."""

    middles: Array
    normals: Array
    half_lengths: Array
    stretch: Array


def _in_picture(chunks: Chunks, flat: FlatMap | None) -> _InPicture:
    """Map chunks into the picture by their mean positions and chords."""
    count, half = chunks.middles.shape[1], chunks.half_length
    if flat is None or not count:
        return _InPicture(chunks.middles, chunks.normals, np.full(count, half), np.ones(count))
    way = np.stack([-chunks.normals[1], chunks.normals[0]])
    at = [chunks.middles + t * half * way for t in (*_GAUSS, -1.0, 1.0)]
    seen = flat.to_picture(np.concatenate([*at, chunks.middles + chunks.normals], axis=1)).reshape(2, 6, count)
    middles = np.tensordot(seen[:, :3], _GAUSS_WEIGHTS, axes=(1, 0))
    chord = seen[:, 4] - seen[:, 3]
    length = np.hypot(*chord)
    normals = np.stack([chord[1], -chord[0]]) / length
    normals *= np.sign(np.sum(normals * (seen[:, 5] - seen[:, 1]), axis=0))
    out = flat.to_flat(np.concatenate([middles + normals, middles - normals], axis=1)).reshape(2, 2, count)
    stretch = 0.5 * np.sum((out[:, 0] - out[:, 1]) * chunks.normals, axis=0)
    return _InPicture(middles, normals, 0.5 * length, stretch)


def chunk_edges(
    grey: NDArray[np.float64], flat_chunks: Chunks, body_is_dark: bool, blur: float, view: EdgeView
) -> ChunkEdges:
    """Fit a blurred step to the pixels around every chunk (short stretch of the outline).

    Parameters
    ----------
    grey : ndarray of float, shape (height, width)
        Levels proportional to light.
    flat_chunks : Chunks
        Expected positions of the chunks, in the undistorted plane.
    body_is_dark : bool
        Whether the body is darker than the background.
    blur : float
        Initial estimate of the blur (px).
    view : EdgeView
        How edges appear in the picture.
    """
    chunks = _in_picture(flat_chunks, view.flat)
    count = chunks.middles.shape[1]
    height, width = grey.shape
    reach = REACH_PX
    longest = float(chunks.half_lengths.max(initial=0.0))
    box = ceil(np.hypot(longest, reach)) + 1
    offset, variance, blurs, u_blur = np.zeros(count), np.full(count, np.inf), np.full(count, blur), np.zeros(count)
    level, contrast, noise = np.zeros(count), np.ones(count), np.ones(count)
    used, in_view = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    steps = np.arange(-box, box + 1)
    for k in range(count):
        x, y = chunks.middles[:, k]
        column, row = round(float(x)), round(float(y))
        columns = steps[(steps >= -column) & (steps < width - column)]
        rows = steps[(steps >= -row) & (steps < height - row)]
        if not (0 <= column < width and 0 <= row < height):
            continue
        nx, ny = chunks.normals[:, k]
        half = chunks.half_lengths[k]
        dx, dy = columns[None, :] + column - x, rows[:, None] + row - y
        s, t = dx * nx + dy * ny, -dx * ny + dy * nx
        inside = (np.abs(t) <= half) & (np.abs(s) <= reach)
        if inside.sum() < LEAST_WINDOW * 4.0 * half * reach:
            continue
        in_view[k] = True
        window = grey[row + rows[0] : row + rows[-1] + 1, column + columns[0] : column + columns[-1] + 1]
        values = window[inside]
        fitted = _step(values, s[inside], blur, body_is_dark)
        if fitted is not None:
            offset[k], variance[k], blurs[k], u_blur[k], level[k], contrast[k], noise[k] = fitted
            used[k] = True
    if view.body_level is not None:
        used &= np.abs(level - view.body_level) <= OTHER_LEVEL * abs(view.contrast)
    if used.any():
        used &= _like_the_others(blurs, level, contrast, noise, used)
    offset = chunks.stretch * (offset - view.outward_px)
    variance, u_blur = variance * view.shared_pixels * chunks.stretch**2, u_blur * view.shared_pixels**0.5
    return ChunkEdges(offset, variance, blurs, u_blur, chunks.stretch, used, in_view)


def _like_the_others(
    blurs: Array, level: Array, contrast: Array, noise: Array, used: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Whether each chunk shows the body's own edge, judged by comparison with the other chunks of the body."""
    usual = float(np.median(contrast[used]))
    # A shadow affects at most half of a body's sides, so that the sharper half shows the body's own edges.
    sharp, quiet = float(np.quantile(blurs[used], 0.25)), float(np.quantile(noise[used], 0.25))
    low, high = OTHER_CONTRAST
    return np.asarray(
        (np.abs(level - np.median(level[used])) <= OTHER_LEVEL * abs(usual))
        & (contrast / usual >= low)
        & (contrast / usual <= high)
        & (blurs <= OTHER_BLUR * sharp + OTHER_BLUR_PX)
        & (noise <= OTHER_NOISE * quiet)
    )


def _step(
    values: Array, s: Array, blur: float, body_is_dark: bool
) -> tuple[float, float, float, float, float, float, float] | None:
    """Fit a blurred step by Gauss-Newton iteration; None if the pixels contain no step.

    Return the offset, its variance, the blur of the optics and its standard uncertainty, the level of the body, the
    contrast to the background, and the standard deviation of the noise.

    The width of a square pixel adds 1/12 px^2 to the squared blur.
    """
    d, sigma = 0.0, float(np.hypot(blur, 12**-0.5))
    for _ in range(4):
        z = (s - d) / sigma
        step, bell = ndtr(-z), np.exp(-0.5 * z**2) / (sigma * np.sqrt(2.0 * np.pi))
        columns = np.stack([np.ones_like(s), step, bell, bell * z], axis=1)
        normal = columns.T @ columns
        try:
            inverse = np.linalg.inv(normal)
        except np.linalg.LinAlgError:
            return None
        a, b, by_d, by_sigma = inverse @ (columns.T @ values)
        rest = values - columns @ np.array([a, b, by_d, by_sigma])
        noise2 = float(rest @ rest) / max(values.size - 4, 1)
        if b == 0.0 or (b < 0.0) != body_is_dark or abs(b) < LEAST_CONTRAST * np.sqrt(noise2):
            return None
        move = float(by_d / b)
        d = float(np.clip(d + np.clip(move, -2.0, 2.0), -FARTHEST_PX - 1.0, FARTHEST_PX + 1.0))
        wider = float(by_sigma / b)
        sigma = float(np.clip(sigma + np.clip(wider, -0.3 * sigma, 0.3 * sigma), *BLURS_PX))
        if abs(move) < 1e-3:
            break
    if abs(d) > FARTHEST_PX:
        return None
    variance = noise2 * float(inverse[2, 2]) / float(b) ** 2
    of_optics = float(np.sqrt(max(sigma**2 - 1.0 / 12.0, BLURS_PX[0] ** 2)))
    # The pixel's contribution to the squared blur has no uncertainty.
    u_of_optics = float(np.sqrt(noise2 * inverse[3, 3])) / abs(float(b)) * sigma / of_optics
    return d, variance, of_optics, u_of_optics, float(a + b), float(b), float(np.sqrt(noise2))
