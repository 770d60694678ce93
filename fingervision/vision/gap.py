"""Step 7, the gap: the two points below the tips, the distance between them, and how surely it is known."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.frame import Coding
from fingervision.domain.gap import FingerEdge, GapMeasurement, NoGap
from fingervision.domain.status import Status
from fingervision.vision.edges import PIXEL_VARIANCE, EdgePoints, outline_blur
from fingervision.vision.finger_end import (
    INNER_M,
    OUTER_M,
    PARAMETERS,
    TOP_M,
    FingerEnds,
    OutlinePoints,
    corner_tops,
    fit_finger_ends,
    inner_edge,
)
from fingervision.vision.fingers import CoarseFinger, CoarseFingers
from fingervision.vision.first_guess import first_guess, line
from fingervision.vision.local_outline import FingerPoints, local_edge, local_tip
from fingervision.vision.profile_lines import IS_INNER, IS_ROW, ROWS

Floats = NDArray[np.float64]

# Above this blur (sigma_e, pixels) an edge is no longer an edge.
BLUR_LIMIT_PX = 5.0
# Where the outline runs at 45 degrees, rows and columns look at the same pixels: each counts for less.
SHARED_SLOPE, SHARED_FACTOR = 0.75, 1.25
# A line and its scatter need so many points.
FEWEST_ROWS = 4
# A finger's end has eight parameters: it needs this many lines across its outline.
FEWEST_LINES = 2 * PARAMETERS
# A measuring point farther from every point of the outline would be extrapolated (pixels).
FARTHEST_POINT_PX = 2.5
# A local polynomial that is less sure than this (pixels) has not found a smooth outline.
LOCAL_LIMIT_PX = 1.0
# A line whose contrast is below this share of the typical one meets the border of the picture, not of a finger.
LEAST_CONTRAST = 0.3
# Below this ratio of contrast to noise nothing is measured.
CONTRAST_TO_NOISE = 3.0
# The three-sided shape holds where its mean residual near the two points that matter is below so many of its own sigma.
SHAPE_LIMIT, MISFIT_LIMIT = 3.5, 2.5
# Residuals within so many pixels of a point speak of the shape there.
SHAPE_REACH_PX = 8.0
# Neighbouring points share what the model leaves unexplained, and a codec's blocks, over so many of them.
LAGS = 8
# Points over which a codec shares its errors: measured on clips of a moving gripper at 1 to 8 Mbit/s and on JPEG of
# quality 70 to 95 (`tests/benchmarks/accuracy.py --only jpeg h264`).
SHARED_POINTS = {Coding.LOSSLESS: 1.0, Coding.INTRAFRAME: 2.5, Coding.INTERFRAME: 12.0}
# Mean of w r^2 over mean of w for normal residuals under the biweight: the weights shrink the spread by this.
BIWEIGHT_SPREAD = 0.828
# A top is square to its flanks where it is so within this many sigma; it then is to this (slope).
SQUARE_IN_SIGMAS, U_SQUARE = 2.5, 3e-4
# A top whose two corners differ in height by less than so many sigma is level
# (a corner that is not in view says nothing: never by more than this).
LEVEL_IN_SIGMAS, LEVEL_LIMIT_PX = 2.0, 0.5


@dataclass(frozen=True, slots=True, eq=False)
class MeasuringPoints:
    """Tips and inner edges of several fingers in their own axes.

    Parameters
    ----------
    tip, apex : ndarray of float, shape (fingers,)
        Height of the tip, and where across it lies.
    edge, slope : ndarray of float, shape (fingers,)
        Inner edge at the measuring height, and its change per pixel to the root.
    covariance : ndarray of float, shape (fingers, 2, 2)
        Of (tip, edge).
    """

    tip: Floats
    apex: Floats
    edge: Floats
    slope: Floats
    covariance: Floats


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredFinger:
    """One finger's measuring point in the finger's own axes, relative to its origin.

    Parameters
    ----------
    tip, edge, slope : float
        Height of the tip, inner edge at the measuring height, and the edge's change per pixel to the root.
    covariance : ndarray of float, shape (2, 2)
        Of (tip, edge).
    """

    tip: float
    edge: float
    slope: float
    covariance: Floats


def outline_points(fingers: CoarseFingers, edges: EdgePoints) -> tuple[OutlinePoints, Floats]:
    """Each finger's sub-pixel points in its own axes (inner side at larger x, tip at small y), and their origins."""
    lines = edges.lines
    origin = np.array([(finger.outline[0, 0], finger.top_along_px) for finger in (fingers.left, fingers.right)], float)
    sign = np.array([[fingers.left.inner_sign], [fingers.right.inner_sign]])
    across, along = edges.position.copy(), lines.fixed.astype(np.float64)
    across[:, ROWS:], along[:, ROWS:] = lines.fixed[:, ROWS:], edges.position[:, ROWS:]
    is_edge = np.abs(edges.contrast) > LEAST_CONTRAST * _median(np.abs(edges.contrast[lines.weight > 0]))
    u = np.where(np.abs(lines.slope) > SHARED_SLOPE, SHARED_FACTOR * edges.u_position, edges.u_position)
    points = OutlinePoints(
        x=sign * (across - origin[:, :1]),
        y=along - origin[:, 1:],
        u=u,
        is_row=np.broadcast_to(IS_ROW, u.shape),
        weight=lines.weight * is_edge,
        blur=outline_blur(edges),
    )
    return points, origin


@dataclass(frozen=True, slots=True, eq=False)
class Explained:
    """Two fingers' outlines explained as finger ends: the fit, and what it says of tips and inner edges."""

    ends: FingerEnds
    fitted: MeasuringPoints


def explain(outlines: Sequence[OutlinePoints], below_tip_px: float) -> list[Explained]:
    """Fit the ends of the fingers of one or many frames.

    The frames do not see each other: many at once cost less than one by one, and give the same numbers.

    Parameters
    ----------
    outlines : sequence of OutlinePoints
        Two fingers each.
    below_tip_px : float
        Height of measuring below the tips.

    Returns
    -------
    list of Explained
        One a frame.
    """
    every = OutlinePoints(*(np.concatenate([getattr(o, name) for o in outlines]) for name in OutlinePoints.__slots__))
    ends = _squared(fit_finger_ends(every, *first_guess(every, below_tip_px)))
    fitted = _evaluate(ends, below_tip_px)
    return [
        Explained(_rows(ends, slice(2 * k, 2 * k + 2)), _rows(fitted, slice(2 * k, 2 * k + 2)))
        for k in range(len(outlines))
    ]


Record = TypeVar("Record", FingerEnds, MeasuringPoints)


def _rows(record: Record, rows: slice) -> Record:
    """Part of a record of arrays."""
    return type(record)(*(getattr(record, name)[rows] for name in type(record).__slots__))


def measuring_gap(
    fingers: CoarseFingers, edges: EdgePoints, below_tip_px: float, full_scale: int, light_gap: bool, coding: Coding
) -> Generator[OutlinePoints, Explained, GapMeasurement | NoGap]:
    """Measure the gap from the edge points of both fingers; asks once for its outlines to be explained.

    Parameters
    ----------
    fingers : CoarseFingers
        Where they were found.
    edges : EdgePoints
        Their sub-pixel outlines.
    below_tip_px : float
        Height of measuring below the tips.
    full_scale : int
        Largest grey level.
    light_gap : bool
        Whether the fingers are dark.
    coding : Coding
        How far errors are shared.

    Yields
    ------
    OutlinePoints
        To be sent back as `explain` explains them.

    Returns
    -------
    GapMeasurement or NoGap
        The number, or why there is none.
    """
    refusal = _refuse(edges, full_scale, light_gap)
    if refusal is not None:
        return refusal
    points, origin = outline_points(fingers, edges)
    if points.weight.sum(axis=1).min() < FEWEST_LINES:
        return NoGap(Status.NO_FINGERS, "Too little of a finger's outline is in view to be measured.")
    explained = yield points
    ends, fitted = explained.ends, explained.fitted
    inflation = _inflation(points, ends, coding)
    holds = [_shape_holds(points, ends, k, fitted.tip[k], fitted.edge[k], below_tip_px) for k in range(2)]
    measured: list[MeasuredFinger] = []
    for k in range(2):
        finger = None
        if not all(holds):  # both in the same way: what a method does to a shape, it does to either
            finger = _measure_locally(points, k, below_tip_px, coding)
        if finger is None and holds[k]:
            if fitted.apex[k] < points.x[k][points.weight[k] > 0].min() - 1.0:
                return NoGap(Status.TIP_OUT_OF_VIEW, "A finger's tip lies beyond the picture's border.")
            finger = MeasuredFinger(
                float(fitted.tip[k]), float(fitted.edge[k]), float(fitted.slope[k]), fitted.covariance[k] * inflation[k]
            )
        if finger is None:
            return NoGap(Status.NO_FINGERS, "The outline near the measuring height is broken.")
        measured.append(finger)
    return _assemble(fingers, edges, origin, measured, below_tip_px, light_gap)


def _refuse(edges: EdgePoints, full_scale: int, light_gap: bool) -> NoGap | None:
    """Reasons to give no number that the edges themselves show."""
    real = edges.lines.weight > 0
    inner = real & IS_INNER
    if inner.sum() < FEWEST_ROWS:  # a slanted or touching tip: what faces the gap is seen in columns
        inner = real & ~IS_ROW
    if inner.sum() < FEWEST_ROWS:
        return NoGap(Status.NO_FINGERS, "The inner edges are too short to be measured.")
    contrast = _median(edges.contrast[inner]) * (1.0 if light_gap else -1.0)
    if contrast < CONTRAST_TO_NOISE * edges.noise or contrast < 0.02 * full_scale:
        return NoGap(Status.LOW_CONTRAST, "The fingers hardly differ from their ground.")
    if edges.is_clipped[inner].mean() > 0.5:
        return NoGap(Status.SATURATED, "The flank of the edges is cut off at the end of the grey scale.")
    blur = float(np.sqrt(edges.blur_px[:, 0].max() ** 2 + PIXEL_VARIANCE))
    if blur > BLUR_LIMIT_PX:
        return NoGap(Status.BLURRED, f"The edges are spread over {blur:.1f} px (standard deviation).")
    return None


def _median(a: Floats) -> float:
    """Middle value; NumPy's own costs five times as much on so few."""
    return float(np.sort(a)[len(a) // 2])


def _squared(ends: FingerEnds) -> FingerEnds:
    """The same ends, their tops square to their flanks wherever the points do not speak against it.

    A finger that is cut straight has its top square to its flanks, which are long and know the tilt far better than a
    short top does. Where the two agree within their uncertainty they are joined (a Kalman update); a slanted tip stays
    slanted.
    """
    p, covariance = ends.parameters, ends.covariance
    off_square = p @ _SQUARENESS
    toward = covariance @ _SQUARENESS
    variance = (toward @ _SQUARENESS) * ends.misfit**2
    is_square = off_square**2 < (SQUARE_IN_SIGMAS**2) * variance
    gain = toward * (is_square * ends.misfit**2 / (variance + U_SQUARE**2))[:, None]
    return replace(
        ends,
        parameters=p - gain * off_square[:, None],
        covariance=covariance - gain[:, :, None] * toward[:, None, :],
    )


# Slope of the top plus the mean slope of the flanks is zero where they are square.
_SQUARENESS = np.zeros(PARAMETERS)
_SQUARENESS[[TOP_M, INNER_M, OUTER_M]] = 1.0, 0.5, 0.5


def _evaluate(ends: FingerEnds, below_tip_px: float) -> MeasuringPoints:
    """Tips and inner edges of the fitted shapes, with their covariance by the parameters' own.

    The tip is the higher of the two corners. Where noise alone decides which that is, the higher of two would be too
    high on average: a top that is level within twice its uncertainty counts as level.
    """
    count = len(ends.parameters)
    every = (ends.parameters[:, None, :] + _MOVES).reshape(-1, PARAMETERS)
    origin = np.repeat(ends.origin, len(_MOVES), axis=0)
    corner_x, corner_y = corner_tops(every, origin)
    inner, outer = corner_y.reshape(count, -1, 2).transpose(2, 0, 1)
    gradient = _gradient(outer - inner)
    u_lean = np.sqrt(np.einsum("ki,kij,kj->k", gradient, ends.covariance, gradient)) * ends.misfit
    lean = (outer - inner)[:, 0]
    is_level = np.abs(lean) < np.minimum(LEVEL_IN_SIGMAS * u_lean, LEVEL_LIMIT_PX)
    inner_share = np.where(is_level, 0.5, lean > 0)[:, None]
    tip = inner_share * inner + (1.0 - inner_share) * outer
    edge, slope = (a.reshape(count, -1) for a in inner_edge(every, origin, (tip + below_tip_px).reshape(-1)))
    gradients = np.stack([_gradient(tip), _gradient(edge)], axis=1)
    covariance = gradients @ ends.covariance @ np.swapaxes(gradients, 1, 2)
    apex = corner_x.reshape(count, -1, 2)[np.arange(count), 0, (inner_share[:, 0] == 0.0).astype(int)]
    return MeasuringPoints(tip[:, 0], apex, edge[:, 0], slope[:, 0], covariance)


# The parameters as they are, and each moved up and down by a thousandth.
_MOVES = 1e-3 * np.concatenate((np.zeros((1, PARAMETERS)), np.eye(PARAMETERS), -np.eye(PARAMETERS)))


def _gradient(moved: Floats) -> Floats:
    """Central differences of what was evaluated at the parameters, then at each moved up, then down by 1e-3."""
    return np.asarray((moved[:, 1 : PARAMETERS + 1] - moved[:, PARAMETERS + 1 :]) / 2e-3)


def _inflation(points: OutlinePoints, ends: FingerEnds, coding: Coding) -> Floats:
    """What multiplies the variances: the residuals' own spread, and how far neighbours share them (Newey-West)."""
    weight = ends.robust * points.weight
    spread = (weight * ends.residual**2).sum(axis=1) / np.maximum(weight.sum(axis=1) - PARAMETERS, 1.0)
    sequence = np.where(points.weight > 0, np.sqrt(weight) * ends.residual, 0.0)
    # With Bartlett's weights the sum over lags is the mean square of the moving sums over that many neighbours.
    padded = np.cumsum(np.pad(sequence, ((0, 0), (LAGS + 2, LAGS + 1))), axis=1)
    moving = padded[:, LAGS + 1 :] - padded[:, : -LAGS - 1]
    power = np.maximum((sequence**2).sum(axis=1), 1e-12)
    shared = (moving**2).sum(axis=1) / ((LAGS + 1.0) * power)
    # What a codec does to a whole block the fit takes for shape: the residuals do not show it, the block's side does.
    return np.asarray(np.maximum(spread / BIWEIGHT_SPREAD, 0.5)) * max(float(shared.mean()), SHARED_POINTS[coding])


def _shape_holds(points: OutlinePoints, ends: FingerEnds, k: int, tip: float, edge: float, below_tip_px: float) -> bool:
    """Whether the three-sided shape leaves nothing systematic near the measuring point and near the tip."""
    weight = points.weight[k] * ends.robust[k]
    real = points.weight[k] > 0
    if not _is_on_outline(points.x[k][real], points.y[k][real], edge, tip + below_tip_px):
        return False
    near_edge = np.abs(points.y[k] - tip - below_tip_px) < SHAPE_REACH_PX
    near_edge &= np.abs(points.x[k] - edge) < 2.0 * SHAPE_REACH_PX
    near_tip = points.y[k] - tip < 0.5 * SHAPE_REACH_PX
    counted = weight > 0
    if counted.sum() < PARAMETERS:
        return False
    # Noise differs from point to point, a wrong shape from one end to the other.
    roughness = 1.4826 * _median(np.abs(np.diff(ends.residual[k][counted]))) / np.sqrt(2.0)
    for near in (near_edge, near_tip):
        total = float((weight * near).sum())
        if total < 3.0:
            continue
        mean = float((weight * near * ends.residual[k]).sum()) / total
        if abs(mean) * np.sqrt(total) > SHAPE_LIMIT * max(roughness, 1.0):
            return False
    return bool(ends.misfit[k] < MISFIT_LIMIT * max(roughness, 1.0))


def _is_on_outline(x: Floats, y: Floats, edge: float, height: float) -> bool:
    """Whether a measuring point has points of the outline beside it: nothing is ever extrapolated."""
    if not len(x):
        return False
    # A large finger's outline is thinned out: its points stand farther apart.
    spacing = (np.ptp(x) + np.ptp(y)) / len(x)
    return float(np.hypot(x - edge, y - height).min()) < FARTHEST_POINT_PX * max(1.0, spacing)


def _measure_locally(points: OutlinePoints, k: int, below_tip_px: float, coding: Coding) -> MeasuredFinger | None:
    """Tip and edge of a finger of any smooth shape."""
    real = points.weight[k] > 0
    own = FingerPoints(
        points.x[k][real], points.y[k][real], points.u[k][real], points.is_row[k][real], points.blur[k][real]
    )
    blur = float(np.median(own.blur))
    top = int(np.argmin(own.y))
    tip = local_tip(own, float(own.x[top]), float(own.y[top]), blur)
    if tip is None:
        return None
    height = tip.y + below_tip_px
    inner = own.x > tip.x
    if not inner.any():
        return None
    nearest = np.flatnonzero(inner)[np.argmin(np.abs(own.y[inner] - height))]
    first_slope = _slope_near(own, inner, height)
    found = local_edge(own, float(own.x[nearest]), height, first_slope, blur)
    if found is None:
        return None
    edge, slope = found
    if not _is_on_outline(own.x, own.y, edge.x, height):
        return None
    shared = np.sqrt(SHARED_POINTS[coding])
    var_tip = (shared * tip.u_normal) ** 2
    var_edge = (shared * edge.u_normal / abs(edge.nx)) ** 2
    if var_edge + slope**2 * var_tip > LOCAL_LIMIT_PX**2:
        return None
    covariance = np.array([[var_tip, slope * var_tip], [slope * var_tip, var_edge + slope**2 * var_tip]])
    return MeasuredFinger(tip.y, edge.x, slope, covariance)


def _slope_near(points: FingerPoints, inner: NDArray[np.bool_], height: float) -> float:
    near = inner & (np.abs(points.y - height) < SHAPE_REACH_PX)
    if near.sum() < 3:
        return 0.0
    return float(np.clip(line(points.y[near] - height, points.x[near])[1], -3.0, 3.0))


def _assemble(
    fingers: CoarseFingers,
    edges: EdgePoints,
    origin: Floats,
    measured: list[MeasuredFinger],
    below_tip_px: float,
    light_gap: bool,
) -> GapMeasurement | NoGap:
    """From the fingers' own axes back to the picture."""
    orientation = fingers.orientation
    across, along, found = [], [], []
    for k, (finger, m) in enumerate(zip((fingers.left, fingers.right), measured, strict=True)):
        across.append(origin[k, 0] + finger.inner_sign * m.edge)
        along.append(origin[k, 1] + m.tip + below_tip_px)
        x, y = orientation.to_pixels(across[k], along[k])
        found.append(_finger_edge(finger, m, edges, k, (x, y), orientation.along_to_pixels(along[k] - below_tip_px)))
    dx, dy = across[1] - across[0], along[1] - along[0]
    if dx <= 0:
        return NoGap(Status.TOUCHING, "The fingers touch at the measuring height.")
    gap = float(np.hypot(dx, dy))
    variance = 0.0
    for m, end in zip(measured, (-1.0, 1.0), strict=True):
        # Either edge closes the gap as it grows, each seen from its own finger; the tips move the points' heights.
        gradient = np.array([end * dy / gap, -dx / gap])
        variance += float(gradient @ m.covariance @ gradient)
    return GapMeasurement(found[0], found[1], orientation.direction, float(np.sqrt(variance)), light_gap)


def _finger_edge(
    finger: CoarseFinger, m: MeasuredFinger, edges: EdgePoints, k: int, point: tuple[float, float], tip: float
) -> FingerEdge:
    mine = (edges.lines.weight[k] > 0) & IS_INNER
    return FingerEdge(
        x_px=point[0],
        y_px=point[1],
        tip_px=tip,
        u_across_px=float(np.sqrt(m.covariance[1, 1])),
        u_tip_px=float(np.sqrt(m.covariance[0, 0])),
        slope=finger.inner_sign * m.slope,
        blur_px=float(np.sqrt(edges.blur_px[k, 0] ** 2 + PIXEL_VARIANCE)),
        contrast=_median(edges.contrast[k, mine]) if mine.any() else 0.0,
    )
