"""Step 6, the finger's end: the outline as three straight sides joined by two round corners.

A printed or cut finger ends in an inner flank, a top and an outer flank, each straight, with a fillet of any radius
(sharp to fully round) between them. Fitting this shape to the edge points of a finger as one thing uses every
point, needs no window, and gives the tip and the inner edge together with their joint covariance.

Blur moves the half-level of a curved edge towards the inside of the curve by sigma^2 kappa / 2 (kappa the
curvature); near the end of a fillet it feels part of the curvature only. The points are compared with the
outline moved in that way, so what is found is the outline before the blur.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

Floats = NDArray[np.float64]

# Order of the parameters. A line is across = c + m (along - y0), or along = c + m (across - x0) for the top.
INNER_C, INNER_M, TOP_C, TOP_M, OUTER_C, OUTER_M, INNER_R, OUTER_R = range(8)
PARAMETERS = 8
# The first passes forgive what the first guess got wrong; only the last ones tell dust from shape.
PATIENCE = (100.0, 20.0, 4.0, 1.0, 1.0, 1.0)
# Tukey's biweight at 95 % efficiency (Holland & Welsch, Commun. Stat. A6, 1977).
BIWEIGHT_REACH = 4.685
# Fillets below so many sigma are sharp corners in the picture, which say nothing within so many sigma.
SHARP_IN_BLURS, SHARP_REACH = 1.5, 2.0


@dataclass(frozen=True, slots=True, eq=False)
class OutlinePoints:
    """Points of one or several fingers' half-level outline, each finger seen with its inner side at larger `x`.

    All arrays have shape (fingers, n); a weight of zero pads.

    Parameters
    ----------
    x, y : ndarray of float
        Across (inwards positive) and along (to the root positive), relative to the finger's own origin.
    u : ndarray of float
        Standard uncertainty along the line on which the point was found.
    is_row : ndarray of bool
        Whether that line is a row.
    weight : ndarray of float
        1 for a point, 0 for padding.
    blur : ndarray of float
        Gaussian sigma of the optics at the point, the pixel included.
    side : ndarray of int
        0 inner flank, 1 top, 2 outer flank, as the coarse outline saw it.
    """

    x: Floats
    y: Floats
    u: Floats
    is_row: NDArray[np.bool_]
    weight: Floats
    blur: Floats
    side: NDArray[np.int_]


@dataclass(frozen=True, slots=True, eq=False)
class FingerEnds:
    """Fitted ends of one or several fingers.

    Parameters
    ----------
    parameters : ndarray of float, shape (fingers, 8)
        Inner line, top line, outer line (offset, slope each), inner and outer fillet radius.
    covariance : ndarray of float, shape (fingers, 8, 8)
        From the points' own uncertainties.
    origin : ndarray of float, shape (fingers, 2)
        x0 of the top line and y0 of the flanks.
    misfit : ndarray of float, shape (fingers,)
        Robust ratio of the residuals' spread to the points' uncertainties; 1 for a perfect shape.
    residual : ndarray of float, shape (fingers, n)
        Normal distance of every point in units of its uncertainty.
    robust : ndarray of float, shape (fingers, n)
        Weight of every point, between 0 and 1.
    """

    parameters: Floats
    covariance: Floats
    origin: Floats
    misfit: Floats
    residual: Floats
    robust: Floats


def _lines(p: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    """Unit normals (outward) of inner flank, top and outer flank, each as (nx, ny)."""
    inner = 1.0 / np.sqrt(1.0 + p[:, INNER_M] ** 2)
    top = 1.0 / np.sqrt(1.0 + p[:, TOP_M] ** 2)
    outer = 1.0 / np.sqrt(1.0 + p[:, OUTER_M] ** 2)
    return inner, -p[:, INNER_M] * inner, p[:, TOP_M] * top, -top, -outer, p[:, OUTER_M] * outer


def _corner(
    offset_1: Floats, n1x: Floats, n1y: Floats, offset_2: Floats, n2x: Floats, n2y: Floats
) -> tuple[Floats, Floats]:
    """Point where n1 . p = offset_1 and n2 . p = offset_2."""
    determinant = n1x * n2y - n1y * n2x
    return (offset_1 * n2y - offset_2 * n1y) / determinant, (n1x * offset_2 - n2x * offset_1) / determinant


@dataclass(frozen=True, slots=True, eq=False)
class _Shape:
    """Normals, offsets and fillet centres that follow from the parameters; arrays of shape (fingers, 1)."""

    nix: Floats
    niy: Floats
    ntx: Floats
    nty: Floats
    nox: Floats
    noy: Floats
    ki: Floats
    kt: Floats
    ko: Floats
    c1x: Floats
    c1y: Floats
    c2x: Floats
    c2y: Floats
    r1: Floats
    r2: Floats


def _shape(p: Floats, origin: Floats) -> _Shape:
    nix, niy, ntx, nty, nox, noy = _lines(p)
    x0, y0 = origin[:, 0], origin[:, 1]
    # n . q for a point q on each line
    ki = nix * p[:, INNER_C] + niy * y0
    kt = ntx * x0 + nty * p[:, TOP_C]
    ko = nox * p[:, OUTER_C] + noy * y0
    r1, r2 = p[:, INNER_R], p[:, OUTER_R]
    c1x, c1y = _corner(ki - r1, nix, niy, kt - r1, ntx, nty)
    c2x, c2y = _corner(ko - r2, nox, noy, kt - r2, ntx, nty)
    every = (nix, niy, ntx, nty, nox, noy, ki, kt, ko, c1x, c1y, c2x, c2y, r1, r2)
    return _Shape(*(a[:, None] for a in every))


def _distance(
    s: _Shape, p: Floats, origin: Floats, points: OutlinePoints
) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
    """Signed distance of the points from the half-level outline, its derivatives, |normal component|, and who counts."""
    x, y = points.x, points.y
    x0, y0 = origin[:, :1], origin[:, 1:]
    # Coordinates of p - C in the (oblique) basis of the two normals that meet at the fillet.
    det1 = s.nix * s.nty - s.niy * s.ntx
    ux, uy = x - s.c1x, y - s.c1y
    alpha1 = (ux * s.nty - uy * s.ntx) / det1
    beta1 = (s.nix * uy - s.niy * ux) / det1
    det2 = s.nox * s.nty - s.noy * s.ntx
    vx, vy = x - s.c2x, y - s.c2y
    alpha2 = (vx * s.nty - vy * s.ntx) / det2
    beta2 = (s.nox * vy - s.noy * vx) / det2

    inner_half = x > 0.5 * (s.c1x + s.c2x)
    fillet1 = (alpha1 > 0) & (beta1 > 0) & inner_half
    fillet2 = (alpha2 > 0) & (beta2 > 0) & ~inner_half
    flank1 = inner_half & ~fillet1 & (beta1 <= 0) & (alpha1 > beta1)
    flank2 = ~inner_half & ~fillet2 & (beta2 <= 0) & (alpha2 > beta2)

    h1, h2 = np.hypot(ux, uy), np.hypot(vx, vy)
    h1, h2 = np.maximum(h1, 1e-6), np.maximum(h2, 1e-6)
    a_inner = np.where(fillet1, alpha1 / h1, flank1)
    a_outer = np.where(fillet2, alpha2 / h2, flank2)
    a_top = np.where(fillet1, beta1 / h1, np.where(fillet2, beta2 / h2, ~(flank1 | flank2)))
    # Where the line's own equation is looked at: the point itself, or the fillet's centre.
    qx = np.where(fillet1, s.c1x, np.where(fillet2, s.c2x, x))
    qy = np.where(fillet1, s.c1y, np.where(fillet2, s.c2y, y))

    d_inner = s.nix * x + s.niy * y - s.ki
    d_top = s.ntx * x + s.nty * y - s.kt
    d_outer = s.nox * x + s.noy * y - s.ko
    d = np.where(
        fillet1, h1 - s.r1, np.where(fillet2, h2 - s.r2, np.where(flank1, d_inner, np.where(flank2, d_outer, d_top)))
    )
    # Half-level of a blurred curved edge: curvature felt through a Gaussian along the outline. Arc length from the
    # fillet's two ends follows from the angle on the fillet and from the distance beyond it on the straight sides.
    # A fillet that is small against the blur is no fillet in the picture: its neighbourhood says nothing of the sides.
    reach1 = SHARP_REACH * points.blur + s.r1
    reach2 = SHARP_REACH * points.blur + s.r2
    blurred_out = (s.r1 < SHARP_IN_BLURS * points.blur) & (alpha1 > -reach1) & (beta1 > -reach1)
    blurred_out |= (s.r2 < SHARP_IN_BLURS * points.blur) & (alpha2 > -reach2) & (beta2 > -reach2)
    d = d + np.where(
        inner_half,
        _blur_shift(
            points.blur,
            s.r1,
            (ux * s.nix + uy * s.niy, ux * s.niy - uy * s.nix, beta1),
            (ux * s.ntx + uy * s.nty, ux * s.nty - uy * s.ntx, alpha1),
        ),
        _blur_shift(
            points.blur,
            s.r2,
            (vx * s.nox + vy * s.noy, vx * s.noy - vy * s.nox, beta2),
            (vx * s.ntx + vy * s.nty, vx * s.nty - vy * s.ntx, alpha2),
        ),
    )

    jacobian = np.zeros((*x.shape, PARAMETERS))
    jacobian[..., INNER_C] = -a_inner * s.nix
    jacobian[..., INNER_M] = -a_inner * s.nix * (qy - y0)
    jacobian[..., TOP_C] = -a_top * s.nty
    jacobian[..., TOP_M] = -a_top * s.nty * (qx - x0)
    jacobian[..., OUTER_C] = -a_outer * s.nox
    jacobian[..., OUTER_M] = -a_outer * s.nox * (qy - y0)
    jacobian[..., INNER_R] = np.where(fillet1, a_inner + a_top - 1.0, 0.0)
    jacobian[..., OUTER_R] = np.where(fillet2, a_outer + a_top - 1.0, 0.0)
    nx = a_inner * s.nix + a_top * s.ntx + a_outer * s.nox
    ny = a_inner * s.niy + a_top * s.nty + a_outer * s.noy
    along_line = np.where(points.is_row, np.abs(nx), np.abs(ny))
    return d, jacobian, along_line, ~blurred_out


def _blur_shift(
    blur: Floats,
    radius: Floats,
    from_flank: tuple[Floats, Floats, Floats],
    from_top: tuple[Floats, Floats, Floats],
) -> Floats:
    """How far the half-level lies inside the outline: sigma^2 kappa / 2 on a fillet, fading out beyond its ends.

    The mean of the heat kernels from 0 to sigma^2 / 2 acts like one of variance sigma^2 / 2. For each end of the
    fillet the point is given as (outwards, along, past the end), seen from the fillet's centre.
    """
    width = np.maximum(blur, 1e-3) * np.sqrt(0.5)
    share = np.ones_like(blur)
    for outwards, along, past_end in (from_flank, from_top):
        on_arc = radius * np.arctan2(np.abs(along), outwards)
        share = share * ndtr(np.where(past_end > 0, on_arc, -np.abs(along)) / width)
    return np.asarray(0.5 * blur**2 / np.maximum(radius, blur) * share)


def fit_finger_ends(points: OutlinePoints, start: Floats, origin: Floats, u_prior: Floats) -> FingerEnds:
    """Least squares with Tukey's biweight over the points of each finger.

    Parameters
    ----------
    points : OutlinePoints
        Sub-pixel outline.
    start : ndarray of float, shape (fingers, 8)
        First guess.
    origin : ndarray of float, shape (fingers, 2)
        x0 and y0 of the lines.
    u_prior : ndarray of float, shape (fingers, 8)
        Weak knowledge that keeps a parameter in place where no point speaks of it.

    Returns
    -------
    FingerEnds
        One a finger.
    """
    p = start.copy()
    robust = points.weight
    information_prior = 1.0 / u_prior**2
    misfit = np.ones(len(p))
    for iteration in range(len(PATIENCE)):
        d, jacobian, along_line, counts = _distance(_shape(p, origin), p, origin, points)
        u_normal = points.u * np.maximum(along_line, 0.3)
        residual = d / u_normal
        counted = points.weight * counts
        spread = _spread(residual, counted)
        misfit = np.maximum(spread, 1.0)
        reach = BIWEIGHT_REACH * np.maximum(misfit, 1.0)[:, None] * PATIENCE[iteration]
        robust = counted * np.clip(1.0 - (residual / reach) ** 2, 0.0, None) ** 2
        scaled = jacobian * (robust / u_normal**2)[..., None]
        normal = np.swapaxes(scaled, 1, 2) @ jacobian
        normal[:, np.arange(PARAMETERS), np.arange(PARAMETERS)] += information_prior
        right = -(scaled * d[..., None]).sum(axis=1) - (p - start) * information_prior
        p = p + np.linalg.solve(normal, right[..., None])[..., 0]
        p[:, INNER_R:] = np.maximum(p[:, INNER_R:], 0.0)
    covariance = np.linalg.inv(normal)
    return FingerEnds(p, covariance, origin, misfit, residual, robust)


def _spread(residual: Floats, weight: Floats) -> Floats:
    """Robust standard deviation of each finger's weighted residuals (1.4826 times the median absolute value)."""
    magnitude = np.where(weight > 0, np.abs(residual), np.nan)
    return np.asarray(1.4826 * np.nanmedian(magnitude, axis=1))


def corner_tops(p: Floats, origin: Floats) -> tuple[Floats, Floats]:
    """Outermost point of the inner and of the outer fillet along the axis, each shape (m,)."""
    s = _shape(p, origin)
    return (s.c1y - s.r1)[:, 0], (s.c2y - s.r2)[:, 0]


def inner_edge(p: Floats, origin: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Where the inner side of the outline crosses a height, and its slope there.

    Parameters
    ----------
    p : ndarray of float, shape (m, 8)
        Finger ends.
    origin : ndarray of float, shape (m, 2)
        x0 and y0 of the lines.
    y : ndarray of float, shape (m,)
        Height of measuring.

    Returns
    -------
    x, slope : ndarray of float, shape (m,)
        The crossing and its change per pixel towards the root.
    """
    s = _shape(p, origin)
    c1x, c1y, r1 = s.c1x[:, 0], s.c1y[:, 0], s.r1[:, 0]
    flank_from = c1y + r1 * s.niy[:, 0]
    top_until = c1y + r1 * s.nty[:, 0]
    inside = np.clip(y - c1y, -0.999 * r1, 0.999 * r1)
    half_width = np.sqrt(np.maximum(r1**2 - inside**2, 1e-12))
    on_flank = p[:, INNER_C] + p[:, INNER_M] * (y - origin[:, 1])
    steepness = np.where(np.abs(p[:, TOP_M]) < 1e-3, 1e-3, p[:, TOP_M])
    on_top = origin[:, 0] + (y - p[:, TOP_C]) / steepness
    x = np.where(y >= flank_from, on_flank, np.where(y <= top_until, on_top, c1x + half_width))
    slope = np.where(y >= flank_from, p[:, INNER_M], np.where(y <= top_until, 1.0 / steepness, -inside / half_width))
    return x, slope
