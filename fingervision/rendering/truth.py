"""The true gap between two fingers, from their outline before blurring."""

from dataclasses import dataclass
from functools import lru_cache
from math import hypot

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from fingervision.domain.direction import Direction
from fingervision.domain.errors import DataError
from fingervision.domain.gap import NoGap
from fingervision.domain.status import Status
from fingervision.rendering.camera import Camera
from fingervision.rendering.finger import AXES
from fingervision.rendering.outline import SAME_POINT_PX, Line, Motion, Outline, Piece
from fingervision.rendering.scene import Scene

# Number of points on each piece that bracket its extremum before the refinement.
BRACKET_POINTS = 17
# Points at most this far behind the outermost point belong to the tip.
FLAT_PX = 1e-6
# Fingers whose measuring point is kept: all frames of a film have the same two.
_MOST_KEPT = 64


@dataclass(frozen=True, slots=True)
class TrueEdge:
    """True measuring point and tip of a finger.

    Parameters
    ----------
    x_px, y_px : float
        Point where the inner edge crosses the line at the measuring height below the tip.
    tip_px : float
        The tip's coordinate along the fingers' axis.
    """

    x_px: float
    y_px: float
    tip_px: float


@dataclass(frozen=True, slots=True)
class TrueGap:
    """Both true measuring points; `left` has the smaller coordinate across the fingers."""

    left: TrueEdge
    right: TrueEdge

    @property
    def gap_px(self) -> float:
        """Distance between the two measuring points."""
        return hypot(self.right.x_px - self.left.x_px, self.right.y_px - self.left.y_px)


def truth(scene: Scene, camera: Camera, below_tip_px: float) -> TrueGap | NoGap:
    """Compute the true gap of a scene, or the reason why there is none.

    Parameters
    ----------
    scene : Scene
        Scene with two fingers that point in the same direction.
    camera : Camera
        Camera; only lens and tilt change the outline and thus the true gap. For the true gap in the ideal picture, give
        `IDEAL_CAMERA`.
    below_tip_px : float
        Distance of each measuring point from its own finger's tip, along the axis of the picture.

    Returns
    -------
    TrueGap or NoGap
        True gap, exact to 1e-6 px, in picture coordinates.

    Raises
    ------
    DataError
        If there are more than two fingers, or two that point in different directions.
    """
    if len(scene.fingers) < 2:
        status = Status.ONE_FINGER if scene.fingers else Status.NO_FINGERS
        return NoGap(status, f"The scene must have two fingers, but has {len(scene.fingers)}.")
    first, second, *others = scene.fingers
    if others or first.direction is not second.direction:
        ways = ", ".join(finger.direction for finger in scene.fingers)
        raise DataError(
            f"A scene must have two fingers that point in the same direction, but the directions are {ways}."
        )
    direction, axes = first.direction, AXES[first.direction]
    shapes = list(camera.sees((first.outline, second.outline), scene.width_px, scene.height_px))
    ends = [_tip(shape, axes) for shape in shapes]
    across_size = scene.width_px if direction.is_vertical else scene.height_px
    if any(end.last_px < -0.5 or end.first_px > across_size - 0.5 for end in ends):
        return NoGap(Status.TIP_OUT_OF_VIEW, "The outermost point of a finger lies outside the frame.")
    tips = [end.along_px for end in ends]
    spans = [_crossings(shape, axes, tip + below_tip_px) for shape, tip in zip(shapes, tips, strict=True)]
    if not all(spans):
        return NoGap(Status.NO_FINGERS, f"A finger ends less than {below_tip_px:g} px below its tip.")
    if sum(spans[0]) > sum(spans[1]):
        shapes, tips, spans = shapes[::-1], tips[::-1], spans[::-1]
    inner = (max(spans[0]), min(spans[1]))
    points = [axes.place(across, tip + below_tip_px) for across, tip in zip(inner, tips, strict=True)]
    for x_px, y_px in points:
        if not (-0.5 <= x_px <= scene.width_px - 0.5 and -0.5 <= y_px <= scene.height_px - 0.5):
            return NoGap(
                Status.TIP_OUT_OF_VIEW, f"The measuring point ({x_px:.1f}, {y_px:.1f}) lies outside the frame."
            )
    covered = [shapes[1 - i].winding(np.array([points[i]]))[0] > 0.0 for i in range(2)]
    if inner[0] >= inner[1] or any(covered):
        return NoGap(Status.TOUCHING, "The fingers overlap at the measuring height.")
    edges = [
        TrueEdge(*point, axes.place(0.0, tip)[1 if direction.is_vertical else 0])
        for point, tip in zip(points, tips, strict=True)
    ]
    return TrueGap(edges[0], edges[1])


@dataclass(frozen=True, slots=True)
class _Tip:
    """Smallest coordinate of a finger along its axis, and the range across the finger in which a flat tip has it."""

    along_px: float
    first_px: float
    last_px: float


def _tip(outline: Outline, axes: Motion) -> _Tip:
    grid = np.linspace(0.0, 1.0, BRACKET_POINTS)
    starts = [axes.before(piece.start)[1] for piece in outline.pieces]
    outermost_px = min(starts)
    found = []
    for piece, start_px in zip(outline.pieces, starts, strict=True):
        # No point of a piece is further from the piece's start than the piece's length.
        if start_px - piece.length_px > outermost_px:
            continue
        points = axes.before(piece.points(grid))
        place = int(np.argmin(points[:, 1]))
        found.append(points)
        if isinstance(piece, Line):
            continue  # its outermost point is an end, which is a point of the grid

        def height_px(t: float, piece: Piece = piece) -> float:
            return float(axes.before(piece.points(t))[1])

        # The outermost point may lie between the last two points of the grid, so that the grid's ends can be limits of
        # the bracket too.
        bounds = (float(grid[max(place - 1, 0)]), float(grid[min(place + 1, BRACKET_POINTS - 1)]))
        best = float(minimize_scalar(height_px, bounds=bounds, options={"xatol": 1e-10}).x)
        found.append(axes.before(piece.points(np.array([best]))))
    everything = np.concatenate(found)
    along_px = float(everything[:, 1].min())
    across = everything[everything[:, 1] <= along_px + FLAT_PX, 0]
    return _Tip(along_px, float(across.min()), float(across.max()))


def _crossings(outline: Outline, axes: Motion, along_px: float) -> list[float]:
    """Coordinates across the finger at which the outline crosses the height `along_px`."""
    grid = np.linspace(0.0, 1.0, BRACKET_POINTS)
    crossings = []
    for piece, follower in zip(outline.pieces, outline.pieces[1:] + outline.pieces[:1], strict=True):
        if abs(axes.before(piece.start)[1] - along_px) > piece.length_px + SAME_POINT_PX:
            continue

        def beyond_px(t: float, piece: Piece = piece) -> float:
            return float(axes.before(piece.points(t))[1] - along_px)

        beyond = axes.before(piece.points(grid))[:, 1] >= along_px
        # Both pieces at a joint use the same point, so that rounding cannot place the joint on different sides of the
        # line.
        beyond[0] = axes.before(piece.start)[1] >= along_px
        beyond[-1] = axes.before(follower.start)[1] >= along_px
        for k in np.flatnonzero(beyond[:-1] != beyond[1:]):
            low, high = float(grid[k]), float(grid[k + 1])
            at_joint = (beyond_px(low) >= 0.0) == (beyond_px(high) >= 0.0)
            nearer = min(low, high, key=lambda t: abs(beyond_px(t)))
            t = nearer if at_joint else brentq(beyond_px, low, high, xtol=1e-14)
            crossings.append(float(axes.before(piece.points(t))[0]))
    return crossings


@lru_cache(maxsize=_MOST_KEPT)
def measuring_point(shape: Outline, below_tip_px: float, side: int) -> tuple[float, float]:
    """Inner edge and tip of one finger in its own axes: x across, y towards the root.

    Parameters
    ----------
    shape : Outline
        Outline of the finger, which points towards negative y.
    below_tip_px : float
        Distance of the measuring point from the tip.
    side : int
        -1 for the left finger, whose inner edge is on its right; 1 for the right finger.

    Returns
    -------
    across_px, tip_px : float
        Coordinate of the edge across, and of the tip along the finger.

    Raises
    ------
    DataError
        If the finger does not extend to the measuring height.
    """
    tip = _tip(shape, AXES[Direction.UP]).along_px
    crossings = _crossings(shape, AXES[Direction.UP], tip + below_tip_px)
    if not crossings:
        raise DataError(f"below_tip_px must lie between 0 and the finger's length, but is {below_tip_px:g}.")
    return (max(crossings) if side < 0 else min(crossings)), tip
