"""Fit a blurred disc: maximum-likelihood centre and diameter from all pixels near its outline.

The light level is `plane + (A + plane) S(r0 - r)`, with `S` the integral over the pixel of a Gaussian-blurred step
across the outline. Blur moves the half-level of a curved edge towards the inside by `sigma^2 / (2 R)` (to second order
in sigma / R); the reported radius is that of the disc before blurring.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.straight_edge_fit import (
    LARGEST_BLUR_PX,
    LEAST_CONTRAST,
    RIDGE,
    ROUNDING,
    SETTLED_PX,
    SMALLEST_BLUR_PX,
    blurred_box_step,
    reach_px,
)

Floats = NDArray[np.float64]

ITERATIONS = 30
# Number of pieces into which the outline is divided (the eighths of a square are all equal, its sixteenths are not). A
# scatter of the pieces' radii beyond the 99.9 % quantile of chi-square increases the uncertainty.
PIECES, CHI_SQUARE_999 = 16, 39.25
# Number of linear parameters (one plane of light inside the disc and one outside), and of all parameters.
LINEAR, PARAMETERS = 6, 10


@dataclass(frozen=True, slots=True, eq=False)
class Circle:
    """A fitted disc.

    Parameters
    ----------
    x_px, y_px : float
        Centre, in the picture's pixels.
    radius_px : float
        Radius of the disc before blurring.
    covariance : ndarray of float, shape (3, 3)
        Covariance of x, y and radius.
    contrast : float
        Level inside minus level outside.
    blur_px : float
        Gaussian sigma of the optics.
    noise : float
        Standard deviation of the residuals.
    least_piece : float
        Smallest contrast among sixteenths of the outline, as a share of the mean contrast.
    unround_px : float
        Root-mean-square deviation of the radii fitted to the sixteenths from the radius of the circle.
    """

    x_px: float
    y_px: float
    radius_px: float
    covariance: Floats
    contrast: float
    blur_px: float
    noise: float
    least_piece: float
    unround_px: float


class NoCircleFitError(ValueError):
    """The pixels do not determine a circle."""


def fit_circle(
    levels: Floats,
    origin_px: tuple[int, int],
    start: tuple[float, float, float],
    blur_px: float = 1.0,
    shared_pixels: float = 1.0,
) -> Circle:
    """Fit a blurred disc.

    Parameters
    ----------
    levels : ndarray of float, shape (height, width)
        Light in a part of the picture.
    origin_px : (int, int)
        Column and row of the part's first pixel.
    start : (float, float, float)
        Initial estimate of x, y and radius, within about twice `blur_px`.
    blur_px : float
        Initial estimate of the blur.
    shared_pixels : float
        Number of neighbouring pixels that share an error (from a codec) and count as one pixel.

    Raises
    ------
    NoCircleFitError
        If the outline leaves the part of the picture, or the pixels do not determine a circle.
    """
    x = np.arange(levels.shape[1], dtype=np.float64) + origin_px[0]
    y = np.arange(levels.shape[0], dtype=np.float64)[:, None] + origin_px[1]
    p = np.array([start[0], start[1], start[2], min(max(blur_px, SMALLEST_BLUR_PX), LARGEST_BLUR_PX)])
    fitted, at, contrast = 0.0, p.copy(), None
    for _iteration in range(ITERATIONS):
        reach = reach_px(p[3])
        if abs(reach - fitted) > 0.5 or np.max(np.abs(p[:3] - at[:3])) > 0.5:
            fitted, at = reach, p.copy()
            away = np.hypot(x - p[0], y - p[1]) - p[2]
            rows, columns = np.nonzero(np.abs(away) <= reach)
            xx, yy = columns.astype(np.float64) + origin_px[0], rows.astype(np.float64) + origin_px[1]
            seen = levels[rows, columns]
            if seen.size < 4 * PARAMETERS or p[2] < 1.5:
                raise NoCircleFitError("the zone has too few pixels")
        if contrast is None:
            linear, _ = _columns(xx, yy, p)
            contrast = float(_least_squares(linear, seen)[0][3])
        if abs(contrast) < LEAST_CONTRAST:
            raise NoCircleFitError("the zone has no contrast")
        linear, moved = _columns(xx, yy, p)
        design = np.concatenate((linear, contrast * moved))
        found, inverse, scaled, scale = _least_squares(design, seen)
        ratio = min(max(contrast / found[3], 0.0), 1.0) if abs(found[3]) > LEAST_CONTRAST else 0.0
        contrast = float(found[3])
        step = ratio * found[LINEAR:]
        step[:3] = np.clip(step[:3], -1.0, 1.0)
        step[3] = np.clip(step[3], -0.3 * p[3], 0.5 * p[3])
        p = p + step
        p[3] = min(max(p[3], SMALLEST_BLUR_PX), LARGEST_BLUR_PX)
        if np.max(np.abs(step[:3])) < SETTLED_PX and abs(step[3]) < 0.05:
            break
    else:
        raise NoCircleFitError("the fit does not converge")
    return _result(p, contrast, (design, found, inverse, scaled, scale), (xx, yy, seen), shared_pixels)


def _columns(x: Floats, y: Floats, p: Floats) -> tuple[Floats, Floats]:
    """Columns of the linear part of the model, and derivatives by x, y, radius and blur."""
    dx, dy = x - p[0], y - p[1]
    r = np.maximum(np.hypot(dx, dy), 1e-9)
    cosine, sine = np.abs(dx) / r, np.abs(dy) / r
    # In a pixel whose middle is the centre, there is no direction; elsewhere the larger one is at least 1 / sqrt(2).
    wide, narrow = np.maximum(np.maximum(cosine, sine), 0.5**0.5), np.minimum(cosine, sine)
    sigma = np.sqrt(p[3] ** 2 + narrow**2 / 12.0)
    step, density, widening = blurred_box_step(p[2] - r, sigma, wide)
    one = np.ones_like(r)
    linear = np.stack((one, dx, dy, step, dx * step, dy * step))
    return linear, np.stack((density * dx / r, density * dy / r, density, widening * p[3] / sigma))


def _least_squares(design: Floats, seen: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    scale = np.sqrt(np.einsum("ij,ij->i", design, design))
    scale[scale == 0.0] = 1.0
    scaled = design / scale[:, None]
    normal = scaled @ scaled.T
    normal[np.diag_indices_from(normal)] += RIDGE
    try:
        inverse = np.linalg.inv(normal)
    except np.linalg.LinAlgError:
        raise NoCircleFitError("the pixels do not determine a circle") from None
    return inverse @ (scaled @ seen) / scale, inverse, scaled, scale


def _result(
    p: Floats,
    contrast: float,
    solved: tuple[Floats, Floats, Floats, Floats, Floats],
    pixels: tuple[Floats, Floats, Floats],
    shared_pixels: float,
) -> Circle:
    design, found, inverse, _, scale = solved
    x, y, seen = pixels
    residual = seen - found @ design
    variance = max(float(residual @ residual) / max(seen.size - PARAMETERS, 1), ROUNDING)
    wanted = slice(LINEAR, LINEAR + 3)
    covariance = variance * inverse[wanted, wanted] / scale[wanted, None] / scale[None, wanted]
    piece = np.minimum(((np.arctan2(y - p[1], x - p[0]) / (2.0 * np.pi) + 0.5) * PIECES).astype(np.intp), PIECES - 1)
    by_radius = design[LINEAR + 2]
    info = np.maximum(np.bincount(piece, by_radius**2, PIECES), 1e-12)
    score = np.bincount(piece, by_radius * residual, PIECES)
    chi_square = float(np.sum(score**2 / info)) / variance
    rough = chi_square / (PIECES - 3) if chi_square > CHI_SQUARE_999 else 1.0
    step = design[3]
    centred = step - (np.bincount(piece, step, PIECES) / np.maximum(np.bincount(piece, minlength=PIECES), 1))[piece]
    power = np.maximum(np.bincount(piece, centred**2, PIECES), 1e-12)
    own = 1.0 + np.bincount(piece, centred * residual, PIECES) / power / contrast
    inside = p[3] ** 2 + ROUNDING
    return Circle(
        float(p[0]), float(p[1]), float(p[2] + 0.5 * inside / p[2]), covariance * max(rough, shared_pixels, 1.0),
        contrast, float(p[3]), float(np.sqrt(variance)), float(own.min()), float(np.sqrt(np.mean((score / info) ** 2))),
    )  # fmt: skip
