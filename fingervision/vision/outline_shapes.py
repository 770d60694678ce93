"""Which shape a finger's end has: rounded, square or chamfered on either side, weighed by evidence.

Every shape is a chain of sides (`chain`). Where roughness, noise or a codec hide which it is, the measuring point is
the mean over the shapes, each weighted by its probability (Bayesian model averaging: Hoeting et al., Statistical
Science 14, 1999, 382, doi:10.1214/ss/1009212519), and the variance between them is part of its uncertainty. The two
fingers of one gripper usually have the same shape.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import atan2, cos, pi, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.chain import (
    SETTLING,
    U_PLACE_PX,
    U_SHARP_PX,
    Chain,
    Start,
    chain_point,
    fit_chain,
    three_sides,
    with_small_radii,
)
from fingervision.vision.finger_end import FingerEnd
from fingervision.vision.measuring_point import MeasuringPoint
from fingervision.vision.outline_points import OutlinePoints
from fingervision.vision.polygon import Side
from fingervision.vision.residuals import shape_holds

Floats = NDArray[np.float64]

# Prior probability of the shapes of a finger: corners as they are, the inner, the outer, or both cut off; and that both
# fingers have the same shape.
SHAPES, ALIKE = np.array([0.45, 0.05, 0.05, 0.45]), 0.9
# Least number of points that a shape leaves at a corner for a line through them; else legs of the cut with which a fit
# begins, in radii of the fillet of the same area, which is at least so large (pixels).
FEWEST_OF_CUT, LEGS_IN_RADII, SHARP_PX = 4, 0.655, 6.0
# Radius of the fillets of a round end with which a fit begins, in half widths of the finger.
ROUND_END = 0.95
# Distance of a cut from its corner, in radii of the fillet of the same area.
CUT_IN_RADII = 0.463
# Probability below which a shape is left out, and below which this is certain before the radii are integrated over.
NEGLIGIBLE, HOPELESS = 1e-3, 1e-6
# Largest mean squared residual of a shape, in units of the points' variances.
STRAIGHTEST = 3.0
# Largest share of the points that may be dust; with more, the outline has another shape.
MOST_DUST = 0.04
# Logarithm of the evidence by which the fit of fillets may fall behind the same shape's chain and still be taken: its
# contour is another approximation.
LOST = 2.0
# Factor on the variance between shapes, because both fingers have corners of the same kind and hence equal errors.
BOTH_ALIKE = 2.0

Shapes = list[Chain | None]


class LikelyPoints(NamedTuple):
    """Measuring point of each finger, averaged over its shapes, and the misfit that its likeliest shape leaves.

    Parameters
    ----------
    points : list of MeasuringPoint or None
        None for a finger that no shape describes.
    misfit : float
        Largest ratio of the residuals' spread to the points' uncertainties, at least 1.
    """

    points: list[MeasuringPoint | None]
    misfit: float


def likely_points(
    points: Sequence[OutlinePoints],
    ends: Sequence[FingerEnd],
    fitted: Sequence[MeasuringPoint | None],
    below_tip_px: float,
    shared: float,
) -> LikelyPoints:
    """Measuring point of each finger, averaged over the shapes that its end may have.

    Parameters
    ----------
    points : sequence of OutlinePoints
        Sub-pixel outlines of both fingers.
    ends : sequence of FingerEnd
        Sides with fillets that were fitted to them.
    fitted : sequence of MeasuringPoint or None
        Measuring points of these; None where they do not describe the outline.
    below_tip_px : float
        Distance of the measuring point below the tip.
    shared : float
        Number of neighbouring points that share an error.
    """
    shapes = [_shapes(p, _starts(p, end), shared) for p, end in zip(points, ends, strict=True)]
    spreads = [min((chain.spread for chain in own if chain is not None), default=1.0) for own in shapes]
    variance = shared * max(1.0, *spreads)
    if variance > shared:  # errors beyond the stated ones are none of a shape's
        shapes = [
            [None if chain is None else fit_chain(p, _again(chain), variance, SETTLING) for chain in own]
            for p, own in zip(points, shapes, strict=True)
        ]
    own_fits = [
        None if known is None else fit_chain(p, _starts(p, end)[0], variance, ())
        for p, end, known in zip(points, ends, fitted, strict=True)
    ]
    is_own = []
    for own, same in zip(shapes, own_fits, strict=True):
        is_own.append(same is not None and (own[0] is None or same.log_evidence > own[0].log_evidence - LOST))
        own[0] = same if is_own[-1] else own[0]
    for p, own, shares in zip(points, shapes, _probabilities(shapes), strict=True):
        for k, (chain, share) in enumerate(zip(own, shares.tolist(), strict=True)):
            own[k] = None if chain is None or share < HOPELESS else with_small_radii(p, chain, variance)
    found = [
        _averaged(p, own, shares, known if is_same else None, below_tip_px, variance)
        for p, own, shares, known, is_same in zip(points, shapes, _probabilities(shapes), fitted, is_own, strict=True)
    ]
    return LikelyPoints(found, sqrt(variance / shared))


def _starts(points: OutlinePoints, end: FingerEnd) -> list[Start]:
    """Beginnings of the fits: the shape with fillets, the same with sharp corners, a round end, and a square one."""
    sides, radii = three_sides(end)
    wide = 0.5 * abs(sides[2].x - sides[0].x)
    angle = 0.5 * (sides[0].angle + sides[2].angle)
    outermost = int(np.argmax(points.x * sin(angle) - points.y * cos(angle)))
    top = Side(float(points.x[outermost]), float(points.y[outermost]), angle)
    places = [U_PLACE_PX] * 3
    sharp = ([1.0, 1.0], places, [U_SHARP_PX, U_SHARP_PX])
    round_end = Start([sides[0], top, sides[2]], [ROUND_END * wide] * 2, places, [wide, wide])
    square_end = Start([sides[0], top, sides[2]], *sharp)
    return [Start(sides, radii, places, [wide, wide]), Start(sides, *sharp), round_end, square_end]


def _shapes(points: OutlinePoints, starts: list[Start], variance: float) -> Shapes:
    """Fit every shape to the outline of one finger; None for a shape that it cannot have."""
    whole = _best(points, starts, variance)
    square = fit_chain(points, starts[-1], variance, ())
    bases = [base for base in (whole, square) if base is not None]
    inner, outer = (_best(points, [_cut(points, base, corner) for base in bases], variance) for corner in (1, 0))
    square = None if square is None else fit_chain(points, _cut(points, square, 1), variance, ())
    starts = [_cut(points, base, corner) for base, corner in ((inner, 0), (square, 0), (outer, 2)) if base is not None]
    return [whole, inner, outer, _best(points, starts, variance)]


def _best(points: OutlinePoints, starts: list[Start], variance: float) -> Chain | None:
    """The chain of greatest evidence to which fits lead from several beginnings."""
    chains = [fit_chain(points, start, variance) for start in starts]
    return max((chain for chain in chains if chain is not None), key=lambda chain: chain.log_evidence, default=None)


def _again(chain: Chain) -> Start:
    """Beginning of a fit at the result of another."""
    return Start(chain.polygon.sides, chain.polygon.radii, chain.u_places, chain.u_radii)


def _cut(points: OutlinePoints, base: Chain, corner: int) -> Start:
    """Beginning of a fit with a corner cut off: along the points that the shape leaves there, or like its fillet."""
    sides, radii, _ = base.polygon
    one, two, radius = sides[corner], sides[corner + 1], radii[corner]
    vertices = np.array([found.vertex for found in base.polygon.corners() or ()])
    nearest = np.hypot(points.x - vertices[:, :1], points.y - vertices[:, 1:]).argmin(axis=0)
    left = (base.robust < 0.5) & (nearest == corner)
    if np.count_nonzero(left) >= FEWEST_OF_CUT:
        x, y = points.x[left], points.y[left]
        middle = (float(np.median(x)), float(np.median(y)))
        (xx, xy), (_, yy) = np.cov(x, y)
        angle = 0.5 * atan2(2.0 * xy, xx - yy)
        angle += pi * round((0.5 * (one.angle + two.angle) - angle) / pi)
        cut = Side(*middle, angle)
    else:
        x, y = vertices[corner].tolist()
        leg = LEGS_IN_RADII * max(radius, SHARP_PX)
        ax, ay = x - leg * cos(one.angle), y - leg * sin(one.angle)
        bx, by = x + leg * cos(two.angle), y + leg * sin(two.angle)
        cut = Side(0.5 * (ax + bx), 0.5 * (ay + by), atan2(by - ay, bx - ax))
    u_cut = CUT_IN_RADII * 0.5 * abs(sides[-1].x - sides[0].x)
    return Start(
        [*sides[: corner + 1], cut, *sides[corner + 1 :]],
        [*radii[:corner], 1.0, 1.0, *radii[corner + 1 :]],
        [*base.u_places[: corner + 1], u_cut, *base.u_places[corner + 1 :]],
        [*base.u_radii[:corner], U_SHARP_PX, U_SHARP_PX, *base.u_radii[corner + 1 :]],
    )


def _probabilities(shapes: list[Shapes]) -> tuple[Floats, Floats]:
    """Probability of every shape of each finger, shape (4,), if both are usually alike."""
    left, right = (np.array([-np.inf if chain is None else chain.log_evidence for chain in own]) for own in shapes)
    prior = (1.0 - ALIKE) * np.outer(SHAPES, SHAPES) + ALIKE * np.diag(SHAPES)
    log = left[:, None] + right + np.log(prior)
    if not np.isfinite(log.max()):
        return np.zeros(SHAPES.size), np.zeros(SHAPES.size)
    both = np.exp(log - log.max())
    both /= both.sum()
    return both.sum(axis=1), both.sum(axis=0)


def _averaged(
    points: OutlinePoints,
    shapes: Shapes,
    shares: Floats,
    fitted: MeasuringPoint | None,
    below_tip_px: float,
    variance: float,
) -> MeasuringPoint | None:
    """Mean of the measuring points of the shapes that describe the outline; None if the likeliest does not."""
    found = []
    for k, (chain, share) in enumerate(zip(shapes, shares.tolist(), strict=True)):
        if chain is None or share < NEGLIGIBLE:
            continue
        own = fitted if k == 0 and fitted is not None else chain_point(chain, below_tip_px)
        is_described = chain.spread <= STRAIGHTEST and float(np.mean(chain.robust < 0.5)) < MOST_DUST
        if own is None or not is_described or not shape_holds(points, chain, own, below_tip_px, variance):
            if share > 0.5:
                return None
            continue
        found.append((share, own))
    if not found:
        return None
    weights = np.array([share for share, _ in found])
    weights /= weights.sum()
    read = np.array([(own.tip, own.edge) for _, own in found])
    mean = weights @ read
    between = (read - mean).T @ (weights[:, None] * (read - mean))
    within = sum(weight * own.covariance for weight, (_, own) in zip(weights, found, strict=True))
    likeliest = found[int(weights.argmax())][1]
    return replace(likeliest, tip=float(mean[0]), edge=float(mean[1]), covariance=within + BOTH_ALIKE * between)
