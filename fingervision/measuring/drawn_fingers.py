"""Where the drawing of a mechanism says that its fingers and its pairs of faces are seen in a recording."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, degrees, floor

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.body_poses import FramePoses, SeenPose
from fingervision.domain.direction import Direction
from fingervision.domain.frame import Region
from fingervision.gauges.gauge_file import Gauge
from fingervision.gauges.kinds.pair import FollowedPair, PairSpec
from fingervision.gauges.picture import Picture
from fingervision.gauges.reading import GaugeStatus, Reading
from fingervision.measuring.body_outlines import Placement
from fingervision.measuring.body_poses import FollowedBodies
from fingervision.measuring.drawing_placement import Placed
from fingervision.measuring.task import Task
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_bodies import LinkBody, bodies_of
from fingervision.models.physical_gripper import GAP

Array = NDArray[np.float64]

FINENESS_PX = 0.25
"""Step of the search along a line for the outline of a body."""
MARGIN_PX = 24
"""Ground that is shown beside the fingers: their level and blur are found there."""
DEPTHS_PER_WIDTH = (1.0, 3.0)
"""Least and greatest length of a finger that is shown, in widths of the finger: its sides then give a direction, and
other parts of the mechanism remain outside.
"""
SHOWN = 0.9
"""Share that is shown of the straight face, and of the length along which the ground is seen between the fingers."""
CAMERA_TILT = 0.18
"""Inclination of a camera that was set up by eye: ten degrees."""
SHORTEST_FACE_PX, LONGEST_FACE_PX, FROM_CORNER_PX = 8.0, 24.0, 4.0
"""Length of a face that is fitted, and its distance from corners, where the blur of the adjoining edge matters."""
LEAST_DISTANCE_PX = 3.0
"""Least distance of a pair gauge."""


@dataclass(frozen=True, slots=True)
class DrawnFingers:
    """The part of the picture in which two fingers stay during a recording, and how they lie there.

    Parameters
    ----------
    region : Region
        Part of the frame with both fingers and without the other parts of the mechanism.
    direction : Direction
        Direction in which the tips point.
    below_tip_mm : float
        Where the gap is measured: distance of the pair's points from the ends of the fingers, or more, where fingers
        that are turned in the picture have no inner face so near to their outermost points.
    steepest : float
        Largest inclination of their flanks against the fingers' axis, with that of the camera.
    """

    region: Region
    direction: Direction
    below_tip_mm: float
    steepest: float


@dataclass(frozen=True, slots=True, eq=False)
class FacingPair:
    """A pair of points on the outlines of two bodies that face each other, in the coordinates of the drawing.

    Parameters
    ----------
    name : str
        Name of the pair.
    bodies : (LinkBody, LinkBody)
        The bodies.
    points_mm : ndarray of float, shape (2, 2)
        The points, as columns.
    step_mm, most_mm : float
        Step and range of the search for outlines.
    """

    name: str
    bodies: tuple[LinkBody, LinkBody]
    points_mm: Array
    step_mm: float
    most_mm: float

    @property
    def across(self) -> Array:
        """Unit vector from the first point to the second one."""
        apart = self.points_mm[:, 1] - self.points_mm[:, 0]
        return np.asarray(apart / np.hypot(*apart))

    @property
    def along(self) -> Array:
        """Unit vector along the faces."""
        return np.array([-self.across[1], self.across[0]])

    @property
    def behind_mm(self) -> Array:
        """Points in the material behind each face, as columns."""
        return np.asarray(self.points_mm + 2.0 * self.step_mm * np.outer(self.across, (-1.0, 1.0)))

    def extent_mm(self, way: Array) -> tuple[float, float]:
        """How far each body reaches from its point along its face."""
        first, last = self.behind_mm.T
        return self.until_mm(self.bodies[0].holds, first, way), self.until_mm(self.bodies[1].holds, last, way)

    def until_mm(self, holds: Callable[[Array], NDArray[np.bool_]], start_mm: Array, way: Array) -> float:
        """Distance along a straight line to where material begins or ends; infinite if it does so nowhere."""
        at = np.arange(0.0, self.most_mm, self.step_mm)
        inside = holds(start_mm[:, None] + way[:, None] * at)
        changed = np.flatnonzero(inside != inside[0])
        return float(at[changed[0]]) if changed.size else np.inf


def facing_pairs(mechanism: Mechanism, px_per_mm: float) -> Iterator[FacingPair]:
    """Find the pairs of the drawing whose points lie on faces with ground between them."""
    bodies, search_mm = bodies_of(mechanism), (FINENESS_PX / px_per_mm, 1.5 * mechanism.region.size_mm)
    for name, (first, last) in mechanism.pairs.items():
        points = np.array([mechanism.probes[first], mechanism.probes[last]]).T
        behind = FacingPair(name, (bodies[0], bodies[0]), points, *search_mm).behind_mm
        held = [next((body for body in bodies if body.holds(at[:, None])[0]), None) for at in behind.T]
        before = 2.0 * points - behind
        if held[0] is not None and held[1] is not None and not mechanism.region.holds(before).any():
            yield FacingPair(name, (held[0], held[1]), points, *search_mm)


def moved_mm(body: LinkBody, pose: SeenPose | None, points_mm: Array) -> Array:
    """Move points of a body, shape (2, n), by its pose; without a pose they stay where they are drawn."""
    if pose is None or pose.x_mm is None or pose.y_mm is None or pose.angle_mrad is None:
        return points_mm
    turn = 1e-3 * pose.angle_mrad
    about = body.centroid_mm[:, None]
    turned = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ (points_mm - about)
    return np.asarray(about + turned + np.array([[pose.x_mm], [pose.y_mm]]))


def drawn_fingers(
    mechanism: Mechanism, place: Placement, poses: Sequence[FramePoses], size_px: tuple[int, int]
) -> DrawnFingers | None:
    """Find the part of the picture in which the fingers of the pair `gap` stay.

    Parameters
    ----------
    mechanism : Mechanism
        The drawing.
    place : Placement
        Where it lies in the first picture.
    poses : sequence of FramePoses
        Poses of its bodies in every frame.
    size_px : (int, int)
        Width and height of the frames.

    Returns
    -------
    DrawnFingers or None
        None if the drawing has no such pair, if its points are not on faces that face each other, or if the bodies
        have no ends beside them, as the sides of a slot.
    """
    pair = next((each for each in facing_pairs(mechanism, place.px_per_mm) if each.name == GAP), None)
    if pair is None:
        return None
    up = min((pair.along, -pair.along), key=lambda way: sum(pair.extent_mm(way)))
    to_tips, middle = pair.extent_mm(up), pair.points_mm.mean(axis=1)
    if not np.isfinite(to_tips).all() or np.isfinite(pair.until_mm(mechanism.region.holds, middle, up)):
        return None
    widths = [pair.until_mm(body.holds, at, way) for body, at, way
              in zip(pair.bodies, pair.behind_mm.T, (-pair.across, pair.across), strict=True)]  # fmt: skip
    open_mm = pair.until_mm(mechanism.region.holds, middle, -up)
    least_mm, most_mm = (share * max(widths) for share in DEPTHS_PER_WIDTH)
    face_mm = min(max(SHOWN * min(pair.extent_mm(-up)), least_mm), most_mm)
    depth_mm = min(SHOWN * open_mm, face_mm)
    x, y = place.axes @ up
    pointing = {Direction.RIGHT: x, Direction.LEFT: -x, Direction.DOWN: y, Direction.UP: -y}
    direction = max(pointing, key=lambda way: pointing[way])
    axis, sign = (1 if direction.is_vertical else 0), (1.0 if direction in (Direction.DOWN, Direction.RIGHT) else -1.0)
    shown, ends, steepest, below_px = [], [], 0.0, sum(to_tips) / 2.0 * place.px_per_mm
    for body, at, tip_mm in zip(pair.bodies, pair.points_mm.T, to_tips, strict=True):
        corners = body.outline.corners_mm
        below_mm = up @ (at[:, None] - corners)
        part = np.concatenate([corners[:, below_mm <= depth_mm], _crossings(corners, below_mm - depth_mm)], axis=1)
        corner, end = (at + tip_mm * up)[:, None], (at - depth_mm * up)[:, None]
        steepest = max(steepest, _steepest(corners, below_mm <= depth_mm, pair.across, up))
        for each in poses:
            seen = place.to_px(moved_mm(body, each.poses.get(body.name), np.concatenate([corner, end, part], axis=1)))
            heights = sign * seen[axis]
            # Below the outermost point by so much that the inner face begins, beyond the blur of its corner.
            below_px = max(below_px, float(heights.max() - heights[0]) + FROM_CORNER_PX)
            shown.append(seen[:, [0, *range(2, seen.shape[1])]])
            ends.append(seen[axis, 1])
    region = _region(np.concatenate(shown, axis=1), np.array(ends), axis, sign, size_px)
    return None if region is None else DrawnFingers(region, direction, below_px / place.px_per_mm, steepest)


def _steepest(corners_mm: Array, is_shown: NDArray[np.bool_], across: Array, up: Array) -> float:
    """Largest inclination of the sides that lead along the finger from a corner that is shown, with the camera's."""
    side = np.roll(corners_mm, -1, axis=1) - corners_mm
    along, aside = np.abs(up @ side), np.abs(across @ side)
    flank = (is_shown | np.roll(is_shown, -1)) & (aside < along)
    return CAMERA_TILT + float(np.max(aside[flank] / along[flank], initial=0.0))


def _crossings(corners_mm: Array, level: Array) -> Array:
    """Points at which an outline crosses a level, shape (2, n)."""
    after, beyond = np.roll(corners_mm, -1, axis=1), np.roll(level, -1)
    cut = (level < 0.0) != (beyond < 0.0)
    share = level[cut] / (level[cut] - beyond[cut])
    return np.asarray(corners_mm[:, cut] + share * (after - corners_mm)[:, cut])


def _region(shown_px: Array, ends_px: Array, axis: int, sign: float, size_px: tuple[int, int]) -> Region | None:
    """Box around the fingers with a margin, cut off where both still reach its border in every frame."""
    low, high = shown_px.min(axis=1) - MARGIN_PX, shown_px.max(axis=1) + MARGIN_PX
    if sign > 0.0:
        low[axis] = ends_px.max()
    else:
        high[axis] = ends_px.min()
    x0, y0 = (max(floor(each), 0) for each in low)
    x1, y1 = (min(ceil(each), size) for each, size in zip(high, size_px, strict=True))
    return Region(x0, y0, x1 - x0, y1 - y0) if min(x1 - x0, y1 - y0) > MARGIN_PX else None


@dataclass(frozen=True, slots=True)
class CarriedPair:
    """A gauge of two faces of a drawing, measured where the poses of their bodies carry them.

    Parameters
    ----------
    middle_px : (float, float)
        Middle between the faces in the first picture in which both are seen.
    by_frame : mapping of int to (PairSpec, float)
        By frame: what is fitted, and how far along the faces from its middle their distance is taken.
    """

    middle_px: tuple[float, float]
    by_frame: Mapping[int, tuple[PairSpec, float]]

    def follower(self) -> "CarriedPair":
        """Return the gauge itself: the poses follow its faces."""
        return self

    def lost(self) -> None:
        """A frame that was not read changes nothing: the poses follow its faces."""

    def measured(self, picture: Picture) -> Reading:
        """Measure the pair in a frame."""
        carried = self.by_frame.get(picture.frame.index)
        if carried is None:
            return Reading(GaugeStatus.NOT_FOUND, words="One of its bodies is not seen.")
        return FollowedPair(*carried).measured(picture)


def pair_gauges(bodies: FollowedBodies, placed: Placed) -> Iterator[Gauge]:
    """Make a gauge of every pair of the drawing whose faces are long enough to be fitted."""
    place, polarity = placed.place, "light" if placed.body_is_dark else "dark"
    for pair in facing_pairs(bodies.tracker.mechanism, place.px_per_mm):
        extents = {1.0: min(pair.extent_mm(pair.along)), -1.0: min(pair.extent_mm(-pair.along))}
        down = max(extents, key=lambda sign: extents[sign]) * pair.along
        above_px, below_px = (min(pair.extent_mm(way)) * place.px_per_mm - FROM_CORNER_PX for way in (-down, down))
        length_px = min(above_px + below_px, LONGEST_FACE_PX)
        if length_px < SHORTEST_FACE_PX:
            continue
        shift_px = max(0.5 * length_px - above_px, 0.0)
        points = np.concatenate([pair.points_mm, pair.points_mm + (shift_px / place.px_per_mm * down)[:, None]], axis=1)
        by_frame: dict[int, tuple[PairSpec, float]] = {}
        for each in bodies.poses:
            poses = [each.poses.get(body.name) for body in pair.bodies]
            if all(pose is not None and pose.x_mm is not None for pose in poses):
                first, last = (place.to_px(moved_mm(body, pose, points[:, k::2]))
                               for k, (body, pose) in enumerate(zip(pair.bodies, poses, strict=True)))  # fmt: skip
                by_frame[each.frame] = _carried(first, last, length_px, polarity)
        if by_frame:
            yield Gauge(pair.name, "pair", CarriedPair(next(iter(by_frame.values()))[0].middle_px, by_frame))


def _carried(first_px: Array, last_px: Array, length_px: float, polarity: str) -> tuple[PairSpec, float]:
    """What is fitted in a frame: at each face the drawn point and the middle of the stretch, as columns."""
    (x, y), apart = 0.5 * (first_px + last_px), last_px[:, 0] - first_px[:, 0]
    direction = float(np.arctan2(apart[1], apart[0]))
    spec = PairSpec(
        x_px=float(x[1]),
        y_px=float(y[1]),
        direction_deg=degrees(direction),
        distance_px=max(float(np.hypot(*apart)), LEAST_DISTANCE_PX),
        length_px=length_px,
        polarity=polarity,
    )
    return spec, float(np.cos(direction) * (y[0] - y[1]) - np.sin(direction) * (x[0] - x[1]))


def located(task: Task, bodies: FollowedBodies, size_px: tuple[int, int], *, at_drawn_height: bool) -> Task:
    """Complete a task by where the drawing says that fingers and pairs are seen; what the user states stays.

    Parameters
    ----------
    task : Task
        Settings of the measurement.
    bodies : FollowedBodies
        The drawing's bodies in the recording.
    size_px : (int, int)
        Width and height of the frames.
    at_drawn_height : bool
        Whether the drawing states the measuring height, because the user stated none.
    """
    placed, mechanism = bodies.tracker.placed, bodies.tracker.mechanism
    if placed is None:
        return task
    own = {gauge.name for gauge in task.gauges}
    pairs = tuple(each for each in pair_gauges(bodies, placed) if each.name not in own)
    task = replace(task, gauges=(*task.gauges, *pairs), mechanism=bodies.in_words())
    fingers = drawn_fingers(mechanism, placed.place, bodies.poses, size_px)
    if fingers is None or task.region is not None:
        return task
    return replace(
        task,
        region=fingers.region,
        steepest=max(task.steepest, fingers.steepest),
        direction=task.direction or fingers.direction,
        below_tip_mm=fingers.below_tip_mm if at_drawn_height else task.below_tip_mm,
    )
