"""Residuals of a finger end's fitted shape: the uncertainty that they imply, and whether the shape is rejected."""

from math import hypot, sqrt
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.frame import Coding
from fingervision.domain.loops import loop
from fingervision.vision.finger_end import FingerEnd
from fingervision.vision.finger_shape import INNER_R, OUTER_R, PARAMETERS, TOP_M, compared, seen
from fingervision.vision.measuring_point import MeasuringPoint
from fingervision.vision.outline_points import OutlinePoints

Floats = NDArray[np.float64]

# Largest lag (points) at which correlations of the residuals are used; neighbouring points have errors of the model and
# of a codec's blocks in common.
LAGS = 8
# Number of neighbouring points that have a codec error in common, in addition to the displacement of a whole flank
# (`coded_picture`). Measured on videos of a moving gripper at 1 to 8 Mbit/s and on JPEG of quality 70 to 95
# (`tests/benchmarks/accuracy.py --only jpeg`, `python -m tests.benchmarks.compressed_video`).
SHARED_POINTS = {Coding.LOSSLESS: 1.0, Coding.INTRAFRAME: 2.5, Coding.INTERFRAME: 4.0}
# Ratio of the weighted to the true variance of normal residuals under the biweight (mean of w r^2 / mean of w).
BIWEIGHT_SPREAD = 0.828
# Largest mean residual near the measuring point and near the tip, in its standard uncertainties, at which the
# three-sided shape is accepted; largest misfit.
SHAPE_LIMIT, MISFIT_LIMIT = 3.5, 2.5
# Distance (pixels) from a point within which residuals are used to test the shape, and least number of points.
SHAPE_REACH_PX, FEWEST_NEAR = 8.0, 3.0
# Share of rejected points near the measuring point above which they are not dust but the finger's shape; weight below
# which a point counts as rejected.
MOST_REJECTED, LEAST_COUNTED = 0.5, 0.05
# Least number of rejected points of a finger's end that may be corners of another shape.
FEWEST_OF_CORNER = 3
# A fillet of radius r and the cut of the same area: chi-square of their difference, in units of r^3 / u^2; difference
# in height of inclined tips, in radii; expected chi-square (with errors of a fitted shape, e^20 to one) below which the
# outline does not decide between them; and what blur hides of the difference, in sigma.
CUT_CHI_SQUARE, CUT_LOWER, UNDECIDED, U_BLURRED = 1.35e-3, 0.345, 200.0, 0.05
# Where most of the points within so many pixels above or below the measuring point are rejected, or half of them on
# both sides, they may be the finger's own edge (a corner that is cut off, a bend) and not dust.
BESIDE_PX = 4.0
# Largest height of a tip above every point (in sigma, plus pixels). Blur moves the half-level of a sharp right-angled
# corner away from the vertex by 0.77 sigma, and by 1.1 sigma at a turn of 120 degrees.
TIP_BEYOND_IN_BLURS, TIP_BEYOND_PX = 1.5, 0.5
# Largest distance of the measuring point from the nearest point of the outline (pixels), beyond which it would be
# extrapolated.
FARTHEST_POINT_PX = 2.5


class Residuals(Protocol):
    """Residuals of a fitted shape: in units of the points' uncertainties, the points' weights, and their spread."""

    @property
    def residual(self) -> Floats:
        """Normal distance of every point in units of its uncertainty, shape (n,)."""
        ...

    @property
    def robust(self) -> Floats:
        """Weight of every point between 0 and 1, shape (n,)."""
        ...

    @property
    def misfit(self) -> float:
        """Ratio of the residuals' spread to the points' uncertainties."""
        ...


_shared = loop("residuals_shared")
_roughness = loop("residuals_roughness")
_rejected = loop("residuals_rejected")
_set_aside = loop("residuals_set_aside")
_systematic = loop("residuals_systematic")
_distance_in_spacings = loop("residuals_distance_in_spacings")


def spread(end: FingerEnd) -> float:
    """Ratio of the residuals' variance to the variances that were stated for the points."""
    free = max(float(end.robust.sum()) - PARAMETERS, 1.0)
    return max(float(end.robust @ end.residual**2) / free / BIWEIGHT_SPREAD, 0.5)


def shared_points(
    points: tuple[OutlinePoints, OutlinePoints], ends: tuple[FingerEnd, FingerEnd], coded: float
) -> float:
    """Number of neighbouring points that share an error; one number is used for both fingers.

    The error that a codec causes in a whole block is absorbed by the fitted shape and does not appear in the residuals;
    therefore the result is at least the number `coded` for the codec's blocks.
    """
    seen: list[float] = [_shared(end.residual, end.robust, p.side) for p, end in zip(points, ends, strict=True)]
    return max(0.5 * sum(seen), coded)


def shape_holds(
    points: OutlinePoints, end: Residuals, found: MeasuringPoint, below_tip_px: float, stray: float = 1.0
) -> bool:
    """Whether a shape leaves no systematic residuals near the measuring point and near the tip.

    Parameters
    ----------
    points, end, found : OutlinePoints, FingerEnd or Chain, MeasuringPoint
        Outline points, fitted shape and measuring point of one finger.
    below_tip_px : float
        Distance of the measuring point below the tip.
    stray : float
        Number of neighbouring points of a rough edge that deviate together; such deviations are not attributed to the
        shape.
    """
    if np.count_nonzero(end.robust) < PARAMETERS or not is_on_outline(points, found.edge, found.tip + below_tip_px):
        return False
    if found.tip < points.y.min() - TIP_BEYOND_PX - TIP_BEYOND_IN_BLURS * float(points.blur.max()):
        return False
    if _rejected(points.x, points.y, end.robust, found.edge, found.tip, below_tip_px) > MOST_REJECTED:
        return False
    limit = max(_roughness(end.residual, end.robust), 1.0) * np.sqrt(stray)
    systematic = _systematic(points.x, points.y, end.residual, end.robust, found.edge, found.tip, below_tip_px)
    return bool(systematic < SHAPE_LIMIT * limit and end.misfit < MISFIT_LIMIT * limit)


def set_aside_variance(points: OutlinePoints, end: FingerEnd, edge: float, height: float) -> float:
    """Variance of the edge due to points near the measuring point that the fit rejected as dust (pixels squared).

    The edge may lie anywhere between the fitted shape and the farthest rejected point (a rectangular distribution).
    The errors of the two fingers may be fully correlated. Each finger's variance is therefore doubled, so that the
    variance of the gap is large enough (JCGM 100:2008, 4.3.7 and 5.2.2).
    """
    place = (end.parameters, end.origin, points.x, points.y)
    is_outer, _ = seen(*place, points.is_row)
    _, _, counts = compared(*place, points.u, points.is_row, is_outer, points.blur)
    residual = np.where(counts, end.residual, 0.0)  # a point that a sharp corner blurs says nothing about the edge
    return float(2.0 / 3.0 * _set_aside(points.x, points.y, points.u, residual, end.robust, edge, height) ** 2)


def is_open(points: OutlinePoints, end: FingerEnd, found: MeasuringPoint, below_tip_px: float, shared: float) -> bool:
    """Whether corners of another shape may explain the outline too: points were rejected, or a fillet is small.

    A fillet of radius r and the cut of the same area nowhere differ by more than 0.06 r. Over the corner's points this
    is a chi-square of about 1.35e-3 r^3 / u^2, and tips that are inclined by an angle differ in height by 0.35 r times
    its sine.

    Parameters
    ----------
    points, end, found : OutlinePoints, FingerEnd, MeasuringPoint
        Outline points, fitted end and measuring point of one finger.
    below_tip_px : float
        Distance of the measuring point below the tip.
    shared : float
        Number of neighbouring points that share an error.
    """
    is_aside = (end.robust <= 0.0) & (points.y < found.tip + below_tip_px + SHAPE_REACH_PX)
    if np.count_nonzero(is_aside) >= FEWEST_OF_CORNER:
        return True
    u_px = hypot(float(np.median(points.u)), U_BLURRED * float(np.median(points.blur)))
    for radius in end.parameters[[INNER_R, OUTER_R]].tolist():
        is_felt = CUT_LOWER * radius * abs(float(end.parameters[TOP_M])) > sqrt(found.covariance[0, 0])
        if is_felt and CUT_CHI_SQUARE * radius**3 < UNDECIDED * shared * u_px**2:
            return True
    return False


def is_on_outline(points: OutlinePoints, edge: float, height: float) -> bool:
    """Whether there are outline points next to the measuring point, so that it is not extrapolated."""
    return float(_distance_in_spacings(points.x, points.y, edge, height)) < FARTHEST_POINT_PX
