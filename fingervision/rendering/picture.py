"""Rendering of a frame: scene, light, noise, and rounding to integer levels."""

from collections.abc import Sequence
from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from fingervision.domain.frame import Pixels, Region
from fingervision.rendering.camera import Camera
from fingervision.rendering.outline import Line, Outline, Points
from fingervision.rendering.polygon import union
from fingervision.rendering.scene import Scene

# Number of nodes of a panel, and its length in sigma; the error is 1e-7 of full coverage
# (tests/rendering/test_coverage.py).
NODES = 12
PANEL_SIGMAS = 6.0
# The two tails of the Gaussian beyond this number of sigma have a probability of 6e-7.
REACH_SIGMAS = 5.0
# A panel whose width along x is below this value has no effect on the integral.
LEAST_WEIGHT_PX = 1e-12
# Arcs are divided so that the direction changes by at most this angle within a panel.
PANEL_TURN_RAD = 0.8

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
    """Divide outlines into panels and return the quadrature nodes of each panel.

    Parameters
    ----------
    outlines : sequence of Outline
        Closed curves; solids and holes.
    blur_px : float
        Standard deviation of the blur, which limits the length of the panels.

    Returns
    -------
    ndarray of float, shape (panels, NODES, 2)
        Points at the Gauss-Legendre nodes.
    """
    longest = PANEL_SIGMAS * blur_px
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
    """Position of each panel's nodes as fractions of their piece, and the row of the piece for each panel.

    The first entry of each of the `rows` is the number of panels of a piece.
    """
    counts = rows[:, 0].astype(int)
    row = np.repeat(rows, counts, axis=0)
    place = np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)
    return (place[:, None] + _FRACTIONS) / row[:, :1], row


def coverage(outlines: Sequence[Outline], blur_px: float, window: Region) -> NDArray[np.float64]:
    """Covered fraction of each pixel after blur and pixel integration.

    Parameters
    ----------
    outlines : sequence of Outline
        Solids that do not overlap, and holes, in picture coordinates.
    blur_px : float
        Standard deviation of the Gaussian blur; positive.
    window : Region
        The pixels to be computed.

    Returns
    -------
    ndarray of float, shape (window.height_px, window.width_px)
        Covered fraction: 0 outside, 1 inside.
    """
    height, width = window.height_px, window.width_px
    if height == 0 or width == 0:
        return np.zeros((height, width))
    nodes = panels(outlines, blur_px) - (window.x_px, window.y_px)
    reach = REACH_SIGMAS * blur_px + 1.0
    low, high = nodes.min(axis=1), nodes.max(axis=1)
    weight = _WEIGHTS * (nodes[..., 0] @ _DERIVATIVE.T)
    seen = (high[:, 0] > -reach) & (low[:, 0] < width + reach) & (low[:, 1] < height + reach)
    seen &= np.abs(weight).max(axis=1) > LEAST_WEIGHT_PX
    if not seen.any():
        return np.zeros((height, width))
    nodes, low, high, weight = nodes[seen], low[seen], high[seen], weight[seen]
    first = np.floor(low - reach).astype(int)
    columns, rows = (np.ceil((high - low).max(axis=0) + 2 * reach).astype(int) + 2).tolist()

    # Positions of the pixel borders relative to each node; differences of antiderivatives are integrals over pixels.
    x = first[:, None, :1] + np.arange(columns + 1) - 0.5 - nodes[..., :1]
    y = first[:, None, 1:] + np.arange(rows + 2) - 1.5 - nodes[..., 1:]
    kernel_x = np.diff(_gaussian_step(x, blur_px), axis=-1)
    kernel_y = np.diff(_gaussian_ramp(y, blur_px), n=2, axis=-1)
    patch = np.matmul(np.swapaxes(kernel_y, 1, 2), kernel_x * weight[..., None])

    # Contributions from above the window are added to its first row; those from below or beside it go to a border that
    # is removed.
    row = np.clip(first[:, 1:] + np.arange(rows), 0, height)
    column = np.clip(first[:, :1] + np.arange(columns), -1, width) + 1
    index = row[:, :, None] * (width + 2) + column[:, None, :]
    steps = np.bincount(index.ravel(), weights=patch.ravel(), minlength=(height + 1) * (width + 2))
    covered = steps.reshape(height + 1, width + 2).astype(np.float64, copy=False)
    np.cumsum(covered, axis=0, out=covered)
    return covered[:-1, 1:-1]


def window_of(outlines: Sequence[Outline], blur_px: float, width_px: int, height_px: int) -> Region:
    """Find the part of a frame whose pixels the outlines can change; its width and height may be 0."""
    boxes = np.array([outline.box_px for outline in outlines if outline.pieces])
    if not boxes.size:
        return Region(0, 0, 0, 0)
    reach = REACH_SIGMAS * blur_px + 1.0
    limits = (width_px, height_px)
    first = np.clip(np.floor(boxes[:, :2].min(axis=0) - reach), 0, limits).astype(int)
    last = np.clip(np.ceil(boxes[:, 2:].max(axis=0) + reach) + 1, first, limits).astype(int)
    size = last - first
    return Region(int(first[0]), int(first[1]), int(size[0]), int(size[1]))


def _gaussian_step(t: NDArray[np.float64], sigma: float) -> NDArray[np.float64]:
    """Integral of the Gaussian."""
    return np.asarray(0.5 * (1.0 + erf(t / (sigma * sqrt(2.0)))))


def _gaussian_ramp(t: NDArray[np.float64], sigma: float) -> NDArray[np.float64]:
    """Integral of the integral of the Gaussian."""
    return t * _gaussian_step(t, sigma) + sigma / sqrt(2 * pi) * np.exp(-0.5 * (t / sigma) ** 2)


def render(scene: Scene, camera: Camera, rng: np.random.Generator) -> Pixels:
    """Render one frame.

    Parameters
    ----------
    scene : Scene
        Scene in front of the camera.
    camera : Camera
        Camera model.
    rng : numpy.random.Generator
        Generator of the noise; not used for a camera without noise.

    Returns
    -------
    ndarray of uint8 or uint16, shape (height_px, width_px) or (height_px, width_px, 3)
        Grey levels, or red, green and blue.
    """
    return digitised(with_noise(exact_grey(scene, camera), camera, rng), camera)


def exact_grey(scene: Scene, camera: Camera) -> NDArray[np.float64]:
    """Grey levels before noise and rounding, shape (height_px, width_px); full scale is 255, values are not clipped."""
    light = scene.light
    grey: NDArray[np.float64] = np.full((scene.height_px, scene.width_px), light.ground, dtype=np.float64)
    for patch in scene.behind:
        _paint(grey, patch.outlines, patch.level, light.ground, camera)
    outlines = tuple(finger.outline for finger in scene.fingers)
    if outlines and scene.rim is None:
        _paint(grey, union(outlines), light.fingers, light.ground, camera)
    elif outlines and scene.rim is not None:
        rimmed = union(tuple(outline.grown(scene.rim.width_px) for outline in outlines))
        _paint(grey, rimmed, scene.rim.level, light.ground, camera)
        # The rim's outline includes the fingers. Where both edges are blurred, the result is exact only if the fingers
        # add the difference between their level and the rim's level.
        part, covered = _covered(grey, union(outlines), light.fingers < scene.rim.level, camera)
        part += (light.fingers - scene.rim.level) * covered
    for patch in scene.before:
        _paint(grey, patch.outlines, patch.level, light.fingers, camera)
    grey *= light.field(scene.width_px, scene.height_px, camera.blur_px)
    return grey


def with_noise(grey: NDArray[np.float64], camera: Camera, rng: np.random.Generator) -> NDArray[np.float64]:
    """Add white noise, and shot noise if the camera has it."""
    shot = camera.shot_grey * np.maximum(grey, 0.0) if camera.shot_grey else 0.0
    variance = camera.noise_grey**2 + shot
    if not np.any(variance):
        return grey
    noise = rng.standard_normal(grey.shape)
    noise *= np.sqrt(variance)
    noise += grey
    return noise


def digitised(grey: NDArray[np.float64], camera: Camera) -> Pixels:
    """Round to integers, and clip at the sensor's full scale."""
    if camera.tint is not None:
        grey = grey[..., None] * np.array(camera.tint)
    if camera.bits == 8:
        return np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    return np.clip(np.rint(grey * 257.0), 0, 65535).astype(np.uint16)


def _paint(
    grey: NDArray[np.float64], outlines: tuple[Outline, ...], level: float, around: float, camera: Camera
) -> None:
    """Paint solids of one level; `around` is the level of their surroundings, which decides the edge bias."""
    part, covered = _covered(grey, outlines, level < around, camera)
    # part = level + (part - level) (1 - covered), computed in place, because new arrays of a frame's size take longer
    # than the arithmetic.
    np.subtract(1.0, covered, out=covered)
    part -= level
    part *= covered
    part += level


def _covered(
    grey: NDArray[np.float64], outlines: tuple[Outline, ...], dark: bool, camera: Camera
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the part of the picture that solids can change, as a view, and their coverage of its pixels."""
    height_px, width_px = grey.shape
    spread_px = -camera.bloom_px if dark else camera.bloom_px
    grown = [outline.grown(spread_px) for outline in camera.sees(outlines, width_px, height_px)]
    window = window_of(grown, camera.blur_px, width_px, height_px)
    part = grey[window.y_px : window.y_px + window.height_px, window.x_px : window.x_px + window.width_px]
    return part, coverage(grown, camera.blur_px, window)
