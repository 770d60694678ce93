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
INNER_C, OUTER_C, INNER_M, OUTER_M, INNER_R, OUTER_R, TOP_C, TOP_M = range(8)
PARAMETERS = 8
_C, _M, _R = slice(INNER_C, OUTER_C + 1), slice(INNER_M, OUTER_M + 1), slice(INNER_R, OUTER_R + 1)
_FACING = np.array([1.0, -1.0])
# Tukey's biweight at 95 % efficiency (Holland & Welsch, Commun. Stat. A6, 1977).
BIWEIGHT_REACH = 4.685
# How often the outline is looked at anew, and how many times the biweight's own reach a residual may have in the steps
# of each look: the first forgive what the first guess got wrong, only the last tell dust from shape.
PASSES = ((100.0,), (10.0, 10.0), (1.5, 1.0), (1.0, 1.0))
# A shape whose residuals spread over more than so many sigma is no shape.
WORST_MISFIT = 1e3
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
    """

    x: Floats
    y: Floats
    u: Floats
    is_row: NDArray[np.bool_]
    weight: Floats
    blur: Floats


@dataclass(frozen=True, slots=True, eq=False)
class FingerEnds:
    """Fitted ends of one or several fingers.

    Parameters
    ----------
    parameters : ndarray of float, shape (fingers, 8)
        Offsets, slopes and fillet radii of the inner and outer flank, offset and slope of the top.
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


@dataclass(frozen=True, slots=True, eq=False)
class _Sides:
    """Unit normals (outward), offsets n . q of the sides, and the fillets, that follow from the parameters.

    Flanks and fillets have shape (fingers, 2), inner first; the top has shape (fingers, 1).
    """

    flank_x: Floats
    flank_y: Floats
    flank_k: Floats
    centre_x: Floats
    centre_y: Floats
    radius: Floats
    determinant: Floats
    top_x: Floats
    top_y: Floats
    top_k: Floats


def _sides(p: Floats, origin: Floats) -> _Sides:
    slope, top_slope, radius = p[:, _M], p[:, TOP_M:], p[:, _R]
    flank_x = _FACING / np.sqrt(1.0 + slope * slope)
    flank_y = -slope * flank_x
    top_y = -1.0 / np.sqrt(1.0 + top_slope * top_slope)
    top_x = -top_slope * top_y
    flank_k = flank_x * p[:, _C] + flank_y * origin[:, 1:]
    top_k = top_x * origin[:, :1] + top_y * p[:, TOP_C:TOP_M]
    determinant = flank_x * top_y - flank_y * top_x
    from_flank, from_top = flank_k - radius, top_k - radius
    centre_x = (from_flank * top_y - from_top * flank_y) / determinant
    centre_y = (flank_x * from_top - top_x * from_flank) / determinant
    return _Sides(flank_x, flank_y, flank_k, centre_x, centre_y, radius, determinant, top_x, top_y, top_k)


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """Where the points lie on the shape; arrays of shape (fingers, n).

    `alpha` and `beta` are the coordinates, from the centre of the point's own fillet, in the basis of the flank's and
    the top's normal; `to_flank` and `to_top` are what a shift of those sides moves the distance by.
    """

    distance: Floats
    alpha: Floats
    beta: Floats
    from_centre_x: Floats
    from_centre_y: Floats
    radius: Floats
    on_fillet: NDArray[np.bool_]
    to_flank: Floats
    to_top: Floats
    flank_x: Floats
    flank_y: Floats


def _place(s: _Sides, points: OutlinePoints, half: NDArray[np.intp]) -> _Place:
    """Signed normal distance of the points from the outline, and which side they belong to."""
    x, y = points.x, points.y
    own = np.stack((s.flank_x, s.flank_y, s.flank_k, s.centre_x, s.centre_y, s.radius, s.determinant))
    flank_x, flank_y, flank_k, centre_x, centre_y, radius, determinant = own[:, np.arange(len(x))[:, None], half]
    ux, uy = x - centre_x, y - centre_y
    alpha = (ux * s.top_y - uy * s.top_x) / determinant
    beta = (flank_x * uy - flank_y * ux) / determinant
    on_fillet = (alpha > 0) & (beta > 0)
    on_flank = (beta <= 0) & (alpha > beta)
    length = np.maximum(np.sqrt(ux * ux + uy * uy), 1e-6)
    distance = np.where(
        on_fillet,
        length - radius,
        np.where(on_flank, flank_x * x + flank_y * y - flank_k, s.top_x * x + s.top_y * y - s.top_k),
    )
    to_flank = np.where(on_fillet, alpha / length, on_flank)
    to_top = np.where(on_fillet, beta / length, ~on_flank)
    return _Place(distance, alpha, beta, ux, uy, radius, on_fillet, to_flank, to_top, flank_x, flank_y)


def _jacobian(at: _Place, s: _Sides, points: OutlinePoints, origin: Floats, is_inner: Floats) -> Floats:
    """Change of the distance with every parameter, shape (fingers, 8, n).

    A fillet's centre follows the two sides that it touches: the distance of a point on it changes as if both sides,
    seen from the centre, moved along their normals.
    """
    qx = np.where(at.on_fillet, points.x - at.from_centre_x, points.x) - origin[:, :1]
    qy = np.where(at.on_fillet, points.y - at.from_centre_y, points.y) - origin[:, 1:]
    by_flank = -at.to_flank * at.flank_x
    by_top = -at.to_top * s.top_y
    by_radius = np.where(at.on_fillet, at.to_flank + at.to_top - 1.0, 0.0)
    jacobian = np.empty((len(qx), PARAMETERS, qx.shape[1]))
    # A side that turns takes the centre of its fillet along, which lies a radius inside it.
    turning = np.where(at.on_fillet, at.radius, 0.0)
    by_slope = by_flank * qy - at.to_flank * turning * at.flank_x * at.flank_y
    for number, change in ((INNER_C, by_flank), (INNER_M, by_slope), (INNER_R, by_radius)):
        np.multiply(change, is_inner, out=jacobian[:, number])
        np.subtract(change, jacobian[:, number], out=jacobian[:, number + 1])
    jacobian[:, TOP_C] = by_top
    jacobian[:, TOP_M] = by_top * qx - at.to_top * turning * s.top_x * s.top_y
    return jacobian


def _half_level(at: _Place, s: _Sides, blur: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """How far the half-level lies inside the outline, and which points a blurred-out corner leaves their say.

    The shift is sigma^2 kappa / 2 on a fillet and fades out beyond its ends: the mean of the heat kernels from 0 to
    sigma^2 / 2 acts like one of variance sigma^2 / 2.
    """
    width = blur * np.sqrt(0.5)
    share = np.ones_like(blur)
    for nx, ny, past_end in ((at.flank_x, at.flank_y, at.beta), (s.top_x, s.top_y, at.alpha)):
        outwards = at.from_centre_x * nx + at.from_centre_y * ny
        along = np.abs(at.from_centre_x * ny - at.from_centre_y * nx)
        share *= ndtr(np.where(past_end > 0, at.radius * np.arctan2(along, outwards), -along) / width)
    shift = 0.5 * blur**2 / np.maximum(at.radius, blur) * share
    reach = -(SHARP_REACH * blur + at.radius)
    is_blurred_out = (at.radius < SHARP_IN_BLURS * blur) & (at.alpha > reach) & (at.beta > reach)
    return shift, ~is_blurred_out


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
    p = start
    information_prior = 1.0 / u_prior**2
    s = _sides(p, origin)
    half = (points.x <= 0.5 * s.centre_x.sum(axis=1, keepdims=True)).astype(np.intp)
    is_inner = 1.0 - half
    for patiences in PASSES:
        at = _place(s, points, half)
        shift, counts = _half_level(at, s, points.blur)
        along_line = np.where(
            points.is_row,
            np.abs(at.to_flank * at.flank_x + at.to_top * s.top_x),
            np.abs(at.to_flank * at.flank_y + at.to_top * s.top_y),
        )
        u_normal = points.u * np.maximum(along_line, 0.3)
        counted = points.weight * counts
        jacobian = _jacobian(at, s, points, origin, is_inner) / u_normal[:, None, :]
        turned = jacobian.transpose(0, 2, 1)
        distance = (at.distance + shift) / u_normal
        # While the weights settle, the outline follows its parameters in a straight line.
        move = np.zeros_like(p)
        for patience in patiences:
            residual = distance + (turned @ move[..., None])[..., 0]
            misfit = np.clip(_spread(residual, counted), 1.0, WORST_MISFIT)
            cut = residual * (1.0 / (BIWEIGHT_REACH * patience * misfit))[:, None]
            robust = counted * np.maximum(1.0 - cut * cut, 0.0) ** 2
            scaled = jacobian * robust[:, None, :]
            normal = scaled @ turned
            normal[:, _EVERY, _EVERY] += information_prior
            right = (scaled @ distance[..., None])[..., 0] + (p - start) * information_prior
            move = -np.linalg.solve(normal, right[..., None])[..., 0]
        p = p + move
        np.maximum(p[:, _R], 0.0, out=p[:, _R])
        s = _sides(p, origin)
    residual = (_place(s, points, half).distance + shift) / u_normal
    return FingerEnds(p, np.linalg.inv(normal), origin, misfit, residual, robust)


_EVERY = np.arange(PARAMETERS)


def _spread(residual: Floats, weight: Floats) -> Floats:
    """Robust standard deviation of each finger's residuals (1.4826 times the median absolute value)."""
    magnitude = np.sort(np.where(weight > 0, np.abs(residual), np.inf), axis=1)
    middle = np.maximum((weight > 0).sum(axis=1) // 2, 0)
    return np.asarray(1.4826 * magnitude[np.arange(len(magnitude)), middle])


def corner_tops(p: Floats, origin: Floats) -> tuple[Floats, Floats]:
    """Where the inner and the outer fillet are outermost along the axis, (x, y) each of shape (m, 2), inner first."""
    s = _sides(p, origin)
    return s.centre_x, s.centre_y - s.radius


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
    s = _sides(p, origin)
    centre_x, centre_y, radius = s.centre_x[:, 0], s.centre_y[:, 0], s.radius[:, 0]
    flank_from = centre_y + radius * s.flank_y[:, 0]
    top_until = centre_y + radius * s.top_y[:, 0]
    inside = np.clip(y - centre_y, -0.999 * radius, 0.999 * radius)
    half_width = np.sqrt(np.maximum(radius**2 - inside**2, 1e-12))
    on_flank = p[:, INNER_C] + p[:, INNER_M] * (y - origin[:, 1])
    steepness = np.where(np.abs(p[:, TOP_M]) < 1e-3, 1e-3, p[:, TOP_M])
    on_top = origin[:, 0] + (y - p[:, TOP_C]) / steepness
    x = np.where(y >= flank_from, on_flank, np.where(y <= top_until, on_top, centre_x + half_width))
    slope = np.where(y >= flank_from, p[:, INNER_M], np.where(y <= top_until, 1.0 / steepness, -inside / half_width))
    return x, slope
