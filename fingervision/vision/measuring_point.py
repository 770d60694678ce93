"""Step 7, the measuring point: the tip and the inner edge below it, read off the fitted end of a finger."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled
from fingervision.vision.finger_end import FingerEnd
from fingervision.vision.finger_shape import (
    INNER_M,
    INNER_R,
    OUTER_M,
    OUTER_R,
    PARAMETERS,
    TOP_M,
    corner_tops,
    inner_edge,
)

Floats = NDArray[np.float64]

# A top is square to its flanks where it is so within this many sigma; it then is to this (slope).
SQUARE_IN_SIGMAS, U_SQUARE = 2.5, 3e-4
# A top whose two corners differ in height by less than so many sigma is level
# (a corner that is not in view says nothing: never by more than this).
LEVEL_IN_SIGMAS, LEVEL_LIMIT_PX = 2.0, 0.5
# A corner that is blurred out, or nearly so, has its radius to so many sigma (standard uncertainty); nothing of it is
# hidden from so many sigma on.
U_CORNER_IN_BLURS, HIDDEN_IN_BLURS = 0.8, 8.0
# Derivatives are taken over so much of each parameter to either side.
STEP = 1e-3
# For a radius that is its own uncertainty, up to so many pixels.
LARGEST_STEP_PX = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class MeasuringPoint:
    """One finger's measuring point in the finger's own axes, relative to its origin.

    Parameters
    ----------
    tip, apex : float
        Height of the tip, and where across it lies.
    edge, slope : float
        Inner edge at the measuring height, and its change per pixel to the root.
    covariance : ndarray of float, shape (2, 2)
        Of (tip, edge).
    """

    tip: float
    apex: float
    edge: float
    slope: float
    covariance: Floats


def squared(end: FingerEnd) -> FingerEnd:
    """The same end, its top square to its flanks wherever the points do not speak against it.

    A finger that is cut straight has its top square to its flanks, which are long and know the tilt far better than a
    short top does. Where the two agree within their uncertainty they are joined (a Kalman update); a slanted tip stays
    slanted.
    """
    parameters, covariance = _squared(end.parameters, end.covariance, end.misfit)
    return FingerEnd(parameters, covariance, end.origin, end.misfit, end.residual, end.robust)


@compiled
def _squared(p: Floats, covariance: Floats, misfit: float) -> tuple[Floats, Floats]:
    # Slope of the top plus the mean slope of the flanks is zero where they are square.
    off_square = p[TOP_M] + 0.5 * (p[INNER_M] + p[OUTER_M])
    toward = covariance[:, TOP_M] + 0.5 * (covariance[:, INNER_M] + covariance[:, OUTER_M])
    variance = (toward[TOP_M] + 0.5 * (toward[INNER_M] + toward[OUTER_M])) * misfit**2
    if off_square**2 >= SQUARE_IN_SIGMAS**2 * variance:
        return p, covariance
    gain = toward * (misfit**2 / (variance + U_SQUARE**2))
    return p - gain * off_square, covariance - gain.reshape(-1, 1) * toward


def measuring_point(end: FingerEnd, below_tip_px: float, blur_px: float) -> MeasuringPoint:
    """Tip and inner edge of a fitted shape, with their covariance by the parameters' own.

    The tip is the higher of the two corners. Where noise alone decides which that is, the higher of two would be too
    high on average: a top that is level within twice its uncertainty counts as level.
    """
    wider = _with_corners(end.parameters, end.covariance, blur_px)
    return MeasuringPoint(*_read_off(end.parameters, end.covariance, wider, end.misfit, end.origin, below_tip_px))


@compiled
def _with_corners(p: Floats, covariance: Floats, blur: float) -> Floats:
    """The covariance with what blur hides of small corners: their radius, in both fingers alike."""
    wider = covariance.copy()
    for a in (INNER_R, OUTER_R):
        hidden = max(1.0 - p[a] / (HIDDEN_IN_BLURS * blur), 0.0)
        wider[a, a] += 2.0 * (U_CORNER_IN_BLURS * blur * hidden) ** 2
    return wider


@compiled
def _read_off(
    p: Floats, covariance: Floats, wider: Floats, misfit: float, origin: Floats, below_tip: float
) -> tuple[float, float, float, float, Floats]:
    by_lean = np.empty(PARAMETERS)
    inner_x, inner_y, outer_x, outer_y = corner_tops(p, origin)
    lean = outer_y - inner_y
    for a in range(PARAMETERS):
        up, down = corner_tops(_moved(p, a, STEP), origin), corner_tops(_moved(p, a, -STEP), origin)
        by_lean[a] = (up[3] - up[1] - down[3] + down[1]) / (2.0 * STEP)
    u_lean = np.sqrt(max(_product(by_lean, covariance, by_lean), 0.0)) * misfit
    is_level = abs(lean) < min(LEVEL_IN_SIGMAS * u_lean, LEVEL_LIMIT_PX)
    inner_share = 0.5 if is_level else (1.0 if lean > 0.0 else 0.0)
    tip, edge, slope = _tip_and_edge(p, origin, inner_share, below_tip)
    by_tip, by_edge = np.empty(PARAMETERS), np.empty(PARAMETERS)
    for a in range(PARAMETERS):
        # A radius is not below zero, and may be so much larger that the measuring point comes to lie on the fillet.
        is_radius = a in (INNER_R, OUTER_R)
        more, less = (min(np.sqrt(wider[a, a]), LARGEST_STEP_PX), 0.0) if is_radius else (STEP, STEP)
        up_tip, up_edge, _ = _tip_and_edge(_moved(p, a, more), origin, inner_share, below_tip)
        down_tip, down_edge, _ = _tip_and_edge(_moved(p, a, -less), origin, inner_share, below_tip)
        by_tip[a], by_edge[a] = (up_tip - down_tip) / (more + less), (up_edge - down_edge) / (more + less)
    found = np.empty((2, 2))
    found[0, 0], found[1, 1] = _product(by_tip, wider, by_tip), _product(by_edge, wider, by_edge)
    found[0, 1] = found[1, 0] = _product(by_tip, wider, by_edge)
    return tip, outer_x if inner_share == 0.0 else inner_x, edge, slope, found


@compiled
def _tip_and_edge(p: Floats, origin: Floats, inner_share: float, below_tip: float) -> tuple[float, float, float]:
    """Height of the tip, the edge at the measuring height, and its slope."""
    _, inner, _, outer = corner_tops(p, origin)
    tip = inner_share * inner + (1.0 - inner_share) * outer
    edge, slope = inner_edge(p, origin, tip + below_tip)
    return tip, edge, slope


@compiled
def _moved(p: Floats, parameter: int, by: float) -> Floats:
    moved = p.copy()
    moved[parameter] += by
    return moved


@compiled
def _product(a: Floats, matrix: Floats, b: Floats) -> float:
    total = 0.0
    for i in range(a.size):
        for j in range(b.size):
            total += a[i] * matrix[i, j] * b[j]
    return total
