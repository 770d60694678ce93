"""What the shape of a finger's end leaves unexplained: how far it can be trusted, and whether it holds at all."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled
from fingervision.domain.frame import Coding
from fingervision.vision.finger_end import SIGMAS_IN_MEDIAN, FingerEnd
from fingervision.vision.finger_shape import INNER_M, OUTER_M, PARAMETERS, on_flanks
from fingervision.vision.flanks import STEEPEST
from fingervision.vision.measuring_point import MeasuringPoint
from fingervision.vision.median import middle
from fingervision.vision.outline_points import OutlinePoints

Floats = NDArray[np.float64]

# Neighbouring points share what the model leaves unexplained, and a codec's blocks, over so many of them.
LAGS = 8
# Points over which a codec shares its errors: measured on clips of a moving gripper at 1 to 8 Mbit/s and on JPEG of
# quality 70 to 95 (`tests/benchmarks/accuracy.py --only jpeg h264`).
SHARED_POINTS = {Coding.LOSSLESS: 1.0, Coding.INTRAFRAME: 2.5, Coding.INTERFRAME: 12.0}
# Mean of w r^2 over mean of w for normal residuals under the biweight: the weights shrink the spread by this.
BIWEIGHT_SPREAD = 0.828
# The three-sided shape holds where its mean residual near the two points that matter is below so many of its own sigma.
SHAPE_LIMIT, MISFIT_LIMIT = 3.5, 2.5
# So much of a finger's end, seen closely, are straight flanks; a round thing has next to nothing of them.
FLANKS_SHARE = 0.05
# Residuals within so many pixels of a point speak of the shape there.
SHAPE_REACH_PX, FEWEST_NEAR = 8.0, 3.0
# Dust covers less than this share of the outline near the measuring point: what is more is the finger's own shape. A
# point counts that has at least this weight.
MOST_REJECTED, LEAST_COUNTED = 0.5, 0.05
# A measuring point farther from every point of the outline would be extrapolated (pixels).
FARTHEST_POINT_PX = 2.5


def spread(end: FingerEnd) -> float:
    """Variance of the residuals in units of what the points' own uncertainties explain."""
    free = max(float(end.robust.sum()) - PARAMETERS, 1.0)
    return max(float(end.robust @ end.residual**2) / free / BIWEIGHT_SPREAD, 0.5)


@compiled
def _shared(residual: Floats, robust: Floats, side: NDArray[np.int_]) -> float:
    """How many neighbours share one residual: the sum of the correlations under Bartlett's weights (Newey-West).

    With these weights the sum over lags is the mean square of the moving sums over that many neighbours. The sides of a
    finger do not see each other.
    """
    power, moving = 1e-12, 0.0
    first = 0
    while first < side.size:
        past = first
        while past < side.size and side[past] == side[first]:
            power += robust[past] * residual[past] ** 2
            past += 1
        for start in range(first - LAGS, past):
            total = 0.0
            for i in range(max(start, first), min(start + LAGS + 1, past)):
                total += np.sqrt(robust[i]) * residual[i]
            moving += total * total
        first = past
    return float(moving / ((LAGS + 1.0) * power))


def shared_points(
    points: tuple[OutlinePoints, OutlinePoints], ends: tuple[FingerEnd, FingerEnd], coding: Coding
) -> float:
    """Neighbouring points that share their errors, in both fingers alike.

    What a codec does to a whole block the fit takes for shape: the residuals do not show it, the block's side does.
    """
    seen = [_shared(end.residual, end.robust, p.side) for p, end in zip(points, ends, strict=True)]
    return max(0.5 * sum(seen), SHARED_POINTS[coding])


def shape_holds(
    points: OutlinePoints, end: FingerEnd, found: MeasuringPoint, below_tip_px: float, stray: float = 1.0
) -> bool:
    """Whether the three-sided shape leaves nothing systematic near the measuring point and near the tip.

    Parameters
    ----------
    points, end, found : OutlinePoints, FingerEnd, MeasuringPoint
        One finger.
    below_tip_px : float
        Height of measuring below the tip.
    stray : float
        So many neighbouring points of a rough edge stray together, which is no matter of shape.
    """
    if np.count_nonzero(end.robust) < PARAMETERS or not is_on_outline(points, found.edge, found.tip + below_tip_px):
        return False
    if _rejected(points.x, points.y, end.robust, found.edge, found.tip, below_tip_px) > MOST_REJECTED:
        return False
    limit = max(_roughness(end.residual, end.robust), 1.0) * np.sqrt(stray)
    systematic = _systematic(points.x, points.y, end.residual, end.robust, found.edge, found.tip, below_tip_px)
    return bool(systematic < SHAPE_LIMIT * limit and end.misfit < MISFIT_LIMIT * limit)


def has_flanks(points: OutlinePoints, end: FingerEnd, turn: float = 0.0) -> bool:
    """Whether enough of the outline that was fitted belongs to flanks that stand nearly along the axis.

    Parameters
    ----------
    points : OutlinePoints
        Sub-pixel outline.
    end : FingerEnd
        The shape that was fitted to it.
    turn : float
        How both fingers of a turned camera lean, in this finger's own axes.
    """
    if max(abs(end.parameters[INNER_M] - turn), abs(end.parameters[OUTER_M] - turn)) > STEEPEST:
        return False
    seen = end.robust > 0.0
    share = float(on_flanks(end.parameters, end.origin, points.x, points.y)[seen].mean())
    return share > FLANKS_SHARE


@compiled
def _roughness(residual: Floats, robust: Floats) -> float:
    """Spread from point to point: that of the noise, where a wrong shape differs from one end to the other."""
    counted = residual[robust > 0.0]
    return float(SIGMAS_IN_MEDIAN * middle(np.abs(counted[1:] - counted[:-1])) / np.sqrt(2.0))


@compiled
def _rejected(x: Floats, y: Floats, robust: Floats, edge: float, tip: float, below_tip: float) -> float:
    """Share of the points near the measuring point that the fit takes for dust."""
    near, rejected = 0, 0
    for i in range(x.size):
        if abs(y[i] - tip - below_tip) < SHAPE_REACH_PX and abs(x[i] - edge) < 2.0 * SHAPE_REACH_PX:
            near += 1
            rejected += robust[i] < LEAST_COUNTED
    return rejected / max(near, 1)


@compiled
def _systematic(
    x: Floats, y: Floats, residual: Floats, robust: Floats, edge: float, tip: float, below_tip: float
) -> float:
    """Mean residual near the measuring point or near the tip, the larger, in units of its own uncertainty."""
    sums, weights = np.zeros(2), np.zeros(2)
    for i in range(x.size):
        if abs(y[i] - tip - below_tip) < SHAPE_REACH_PX and abs(x[i] - edge) < 2.0 * SHAPE_REACH_PX:
            sums[0] += robust[i] * residual[i]
            weights[0] += robust[i]
        if y[i] - tip < 0.5 * SHAPE_REACH_PX:
            sums[1] += robust[i] * residual[i]
            weights[1] += robust[i]
    largest = 0.0
    for near in range(2):
        if weights[near] >= FEWEST_NEAR:
            largest = max(largest, abs(sums[near]) / np.sqrt(weights[near]))
    return largest


def is_on_outline(points: OutlinePoints, edge: float, height: float) -> bool:
    """Whether a measuring point has points of the outline beside it: nothing is ever extrapolated."""
    return _distance_in_spacings(points.x, points.y, edge, height) < FARTHEST_POINT_PX


@compiled
def _distance_in_spacings(x: Floats, y: Floats, edge: float, height: float) -> float:
    """Distance to the nearest point; a large finger's outline is thinned out: its points stand farther apart."""
    nearest = np.inf
    for i in range(x.size):
        nearest = min(nearest, (x[i] - edge) ** 2 + (y[i] - height) ** 2)
    return float(np.sqrt(nearest) / max(1.0, (x.max() - x.min() + y.max() - y.min()) / x.size))
