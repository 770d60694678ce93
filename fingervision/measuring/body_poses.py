"""Poses of a mechanism's bodies in every frame of a recording."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calib.measured_scale import Calibration
from fingervision.domain.body_poses import COVERED, DAMAGED, NOT_FOUND, OK, OUT_OF_VIEW, FramePoses, SeenPose
from fingervision.domain.errors import DataError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.numbers import with_uncertainty
from fingervision.gauges.picture import Picture, picture_of
from fingervision.gauges.plane_scale import PlaneScale
from fingervision.measuring.body_outlines import BodyOutline, outlines_of
from fingervision.measuring.drawing_placement import (
    LEVELS,
    GivenPoint,
    Placed,
    by_points,
    by_silhouette,
    levels_of,
    refined,
)
from fingervision.measuring.flexure_outlines import StillPicture, flexures_at_rest
from fingervision.measuring.joined_bodies import Joint, torn_off
from fingervision.measuring.pose_uncertainty import SharedErrors, SharedPose, in_drawing
from fingervision.measuring.scale import Scale
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_bodies import column_name
from fingervision.storage.bodies_csv import FLEXURES, PARTS, add_channels, write_bodies, write_flexures
from fingervision.vision.outline_chunks import Chunks, EdgeView, FlatMap
from fingervision.vision.pipeline import Settings
from fingervision.vision.response_shift import u_edge_px
from fingervision.vision.rigid_outline import LEAST_IN_VIEW, RigidFit, capture_rigid, fit_rigid, halved

Array = NDArray[np.float64]

# Lens and plane of a calibration as a map between the picture and the plane without perspective and distortion.

FOLDED_PX = 0.5
"""Largest error of mapping a point forth and back; with a larger error, the lens's distortion polynomial is not
invertible at this point, which then cannot appear in a picture.
"""
NOWHERE_PX = -1e6


@dataclass(frozen=True, slots=True, eq=False)
class FlatPicture:
    """Converts pixels of the picture to pixels of the plane without perspective and distortion, and back.

    Parameters
    ----------
    calibration : Calibration
        Calibration that includes a lens, a plane or both.
    """

    calibration: Calibration

    def to_flat(self, points: Array) -> Array:
        """Remove lens distortion and perspective from points, shape (2, n)."""
        return self.calibration.flatten(points.T).T

    def to_picture(self, points: Array) -> Array:
        """Apply lens distortion and perspective; points that the lens cannot image are mapped far outside."""
        seen = self.calibration.unflatten(points.T).T
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            apart = np.hypot(*(self.to_flat(seen) - points))
        return np.where(apart < FOLDED_PX, seen, NOWHERE_PX)


def flat_map_of(scale: Scale) -> FlatMap | None:
    """Return the map of a calibration; None where the picture needs no correction."""
    if isinstance(scale, Calibration) and (scale.lens is not None or scale.plane is not None):
        return FlatPicture(scale)
    return None


LEAST_SIZE_ERROR, MOST_SIZE_ERROR, SURE = 1e-3, 0.01, 4.0
"""Smallest relative size error that is reported, largest size error that is accepted, and number of standard
uncertainties above which a size error is significant. Printed parts and scales have errors of about 0.2 %; above 1 %,
the scale or the drawing is wrong.
"""
AT_REST: tuple[Array, float] = (np.zeros(2), 0.0)
"""Motion of a body that is where it is drawn."""
BODIES, GAPS = "bodies.csv", "gaps.csv"
STILL_FRAMES = 8
"""Largest number of frames from which the flexures are measured at rest: noise then adds little to the uncertainty that
all still frames share."""
LAID_BY_ALL = (
    "no fixed body is in view, so that the drawing was placed by all bodies together: poses are relative to the "
    "bodies' mean position in the first frame instead of the ground, and only their changes and the angles of hinges "
    "are meaningful."
)


class BodyTracker:
    """Tracks the bodies of a mechanism from frame to frame.

    Parameters
    ----------
    mechanism : Mechanism
        The drawing.
    scale : Scale
        Conversion from pixels to millimetres, for pictures of this size; lens distortion and perspective of a
        calibration are removed from the outlines' points.
    points : sequence of GivenPoint
        Points of the drawing and their positions in the first picture; if empty, the silhouette is used.
    settings : Settings
        Settings of the measurement, such as the camera response.
    """

    def __init__(
        self, mechanism: Mechanism, scale: Scale, points: Sequence[GivenPoint] = (), settings: Settings | None = None
    ) -> None:
        self.mechanism, self.scale, self._points = mechanism, scale, tuple(points)
        self.settings = Settings(below_tip_px=1.0) if settings is None else settings
        self.outlines = outlines_of(mechanism)
        self._joints = [Joint(flexure, (self._joined(flexure.name, -1.0).body, self._joined(flexure.name, 1.0).body))
                        for flexure in mechanism.flexures]  # fmt: skip
        self.placed: Placed | None = None
        self.first: list[StillPicture] = []
        self._starts: dict[str, tuple[tuple[SharedPose, ...], Array]] = {}

    def poses(self, frames: Iterable[Frame | LostFrame]) -> Iterator[FramePoses]:
        """Yield the poses for each frame; the first readable frame determines the position of the drawing.

        Raises
        ------
        DataError, UsageError
            If the drawing cannot be placed on that frame, or the scale is for frames of another size.
        """
        for item in frames:
            if isinstance(item, LostFrame):
                yield FramePoses(item.index, item.time_s, {n: SeenPose(DAMAGED) for n in self._names()})
                continue
            picture = picture_of(item, self.settings)
            grey = np.asarray(picture.grey if picture.light is None else picture.light[picture.grey], dtype=np.float64)
            if self.placed is None:
                self._place(grey, item.index, self._view(picture), picture)
            view = self._view(picture)
            if len(self.first) < STILL_FRAMES and self.placed is not None:
                body, contrast = self._levels
                self.first.append(StillPicture(grey, self.placed.place, body, body + contrast, view.outward_px))
            yield FramePoses(item.index, item.time_s, self._seen(grey, view))

    def _names(self) -> list[str]:
        bodies = [outline.body.name for outline in self.outlines]
        return [*bodies, *(flexure.name for flexure in self.mechanism.flexures)]

    def _view(self, picture: Picture) -> EdgeView:
        """How edges appear in the picture: the edge bias widens a dark body by half of the bias on each side."""
        dark = self.placed is None or self.placed.body_is_dark
        outward_px = (0.5 if dark else -0.5) * self.scale.edge_bias_px
        flat, shared_pixels = flat_map_of(self.scale), picture.shared_pixels
        if self.placed is None:
            return EdgeView(flat, outward_px, shared_pixels)
        return EdgeView(flat, outward_px, shared_pixels, *self._levels, *self._shared.at(picture.size_px))

    def _place(self, grey: Array, index: int, view: EdgeView, picture: Picture) -> None:
        height, width = grey.shape
        self.scale.check_frame_size(width, height)
        px_per_mm, flat = self.scale.px_per_mm, view.flat
        if self._points:
            place = by_points(self._points, px_per_mm, flat)
            inside, ground = levels_of(grey, self.mechanism, place)
            placed = Placed(place, inside < ground, ())
        else:
            placed = by_silhouette(grey, self.mechanism, px_per_mm, flat)
            inside, ground = levels_of(grey, self.mechanism, placed.place)
        if not placed.body_is_dark:
            view = replace(view, outward_px=-view.outward_px)
        self._levels = inside, ground - inside
        plane = PlaneScale(self.scale, (width, height)) if isinstance(self.scale, Calibration) else None
        u_outward_px, u_size = SharedErrors(None, np.zeros(2), plane).at((width, height))
        view = replace(
            view, body_level=inside, contrast=ground - inside, u_outward_px=u_outward_px, u_size=u_size
        )  # fmt: skip
        laid = refined(grey, self.outlines, placed.place, placed.body_is_dark, view)
        if laid is None:
            raise DataError(
                f"The edges of {self.mechanism.name} must be visible where the drawing was placed on frame {index}, "
                "but are not: "
                "check the scale and the drawing, or give --at X,Y=XMM,YMM for three points."
            )
        notes = placed.notes if laid.by_fixed else (*placed.notes, LAID_BY_ALL)
        self.placed = Placed(laid.place, placed.body_is_dark, notes)
        shares = (inside / picture.top, ground / picture.top)
        u_px = u_edge_px(self.settings.camera.response, *shares, laid.fit.blur_px)
        self._shared = SharedErrors(laid.fit, laid.about_px, plane, u_px)
        self._chunks = [outline.chunks(laid.place) for outline in self.outlines]
        self._about = [outline.about_px(laid.place) for outline in self.outlines]
        self._last: list[tuple[Array, float]] = [(np.zeros(2), 0.0)] * len(self.outlines)
        self._check_size(grey, index, self._view(picture))

    def _check_size(self, grey: Array, index: int, view: EdgeView) -> None:
        """Compare the sizes of the bodies with the drawing; a difference means a wrong scale or another mechanism."""
        fits = [self._fit(grey, [], number, view) for number in range(len(self.outlines))]
        self._note_shadows([o.body.name for o, fit in zip(self.outlines, fits, strict=True)
                            if fit is not None and fit.by_shadows.any()], index)  # fmt: skip
        told = [(fit.size_error, fit.u_size_error) for fit in fits if fit is not None]
        weight = sum(u**-2 for _, u in told)
        if self.placed is None or weight == 0.0:
            return
        error, u = sum(size * u**-2 for size, u in told) / weight, weight**-0.5
        if abs(error) < SURE * u or abs(error) < LEAST_SIZE_ERROR:
            return
        words = (
            f"the bodies of {self.mechanism.name} appear {with_uncertainty(100.0 * abs(error), 200.0 * u)} % (95 %) "
            f"{'larger' if error > 0.0 else 'smaller'} than in the drawing at {self.scale.px_per_mm:.5g} px/mm"
        )
        if abs(error) > MOST_SIZE_ERROR:
            raise DataError(
                f"The drawing must have the size of the mechanism in the picture, but in frame {index} {words}: check "
                "the scale and the lengths of the drawing."
            )
        self._shared = replace(self._shared, size_error=abs(error))
        self.placed = replace(
            self.placed, notes=(*self.placed.notes, f"{words}; the uncertainty of the poses includes this.")
        )

    def _note_shadows(self, names: Sequence[str], index: int) -> None:
        if self.placed is None or not names:
            return
        words = (
            f"in frame {index}, one side of {' and of '.join(names)} has a different blur than the other sides: a "
            "shadow or glare may lie along this side, or the body moved. The uncertainty of the poses includes this "
            "effect; uniform light removes it."
        )
        self.placed = replace(self.placed, notes=(*self.placed.notes, words))

    def _fit(self, grey: Array, pyramid: list[Array], number: int, view: EdgeView) -> RigidFit | None:
        """Fit a body's motion from its pose in the last frame, or else by a search over a larger distance."""
        dark = self.placed is not None and self.placed.body_is_dark
        chunks, about, last = self._chunks[number], self._about[number], self._last[number]
        found = fit_rigid(grey, chunks, about, dark, last, view)
        # A body that is not near its last pose is searched farther from there, and from the drawn place, about which it
        # swings: beside another body that has moved too, the way from the last pose may lead to that one's edges.
        for start in (last, AT_REST):
            if found is not None and found.seen >= 0.8 * found.in_view:
                break
            if not pyramid:
                pyramid += halved(grey, LEVELS)
            wider = capture_rigid(grey, pyramid, chunks, about, dark, start, view)
            if found is None or (wider is not None and wider.seen > found.seen):
                found = wider
        return found

    def _seen(self, grey: Array, view: EdgeView) -> dict[str, SeenPose]:
        if self.placed is None:
            raise AssertionError("no drawing was placed on the picture")
        into, pyramid, before = in_drawing(self.placed.place), list[Array](), list(self._last)
        found: dict[str, SeenPose] = {}
        shared: dict[str, SharedPose] = {}
        for number, outline in enumerate(self.outlines):
            name = outline.body.name
            chunks, about = self._chunks[number], self._about[number]
            fit = self._fit(grey, pyramid, number, view) if chunks.middles.shape[1] >= 3 else None
            if fit is None:
                found[name] = SeenPose(self._why(grey, chunks, about, self._last[number], view.flat))
                continue
            self._last[number] = (fit.shift_px, fit.angle_rad)
            if fit.in_view < LEAST_IN_VIEW * fit.all:
                found[name] = SeenPose(OUT_OF_VIEW)
                continue
            at = (about + fit.shift_px)[:, None]
            at = at if view.flat is None else view.flat.to_picture(at)
            shared[name] = self._shared.of_pose(fit, about, at[:, 0])
            pose = into @ np.array([*fit.shift_px, fit.angle_rad])
            random = into @ fit.covariance @ into.T
            whole = random + _shared_covariance((shared[name],), into)
            found[name] = SeenPose(OK, float(pose[0]), float(pose[1]), float(pose[2]), whole, random)
        for name in torn_off(self._joints, found):
            # The body was mistaken for something similar, so that the search in the next frame starts from its last
            # valid pose.
            number = next(k for k, outline in enumerate(self.outlines) if outline.body.name == name)
            found[name], self._last[number] = SeenPose(NOT_FOUND), before[number]
        for name, pose in found.items():
            if pose.random is not None:
                motion = self._motion(name, pose.random, (shared[name],), into)
                found[name] = replace(pose, motion=motion)
        return found | self._hinges(found, shared, into)

    def _why(self, grey: Array, chunks: Chunks, about: Array, last: tuple[Array, float], flat: FlatMap | None) -> str:
        height, width = grey.shape
        middles = chunks.moved(last[0], last[1], about).middles
        x, y = middles if flat is None else flat.to_picture(middles)
        inside = (x > 0.0) & (x < width) & (y > 0.0) & (y < height)
        return COVERED if inside.size and inside.mean() >= LEAST_IN_VIEW else OUT_OF_VIEW

    def _hinges(
        self, poses: Mapping[str, SeenPose], shared: Mapping[str, SharedPose], into: Array
    ) -> dict[str, SeenPose]:
        """Angles of hinges: rotation of the body on one side of a hinge relative to the body on the other side."""
        found = {}
        for joint in self._joints:
            flexure, (first, last) = joint.flexure, (body.name for body in joint.bodies)
            seen = [poses[first], poses[last]]
            lost = [pose.status for pose in seen if pose.status != OK]
            if lost:
                found[flexure.name] = SeenPose(lost[0])
                continue
            angle, random = 0.0, np.zeros((3, 3))
            for sign, pose in zip((-1.0, 1.0), seen, strict=True):
                if pose.angle_mrad is not None and pose.random is not None:
                    angle += sign * pose.angle_mrad
                    random[2, 2] += float(pose.random[2, 2])
            ends = shared[last], shared[first]
            whole, motion = random + _shared_covariance(ends, into), self._motion(flexure.name, random, ends, into)
            found[flexure.name] = SeenPose(OK, None, None, angle, whole, random, motion)
        return found

    def _motion(self, name: str, random: Array, shared: tuple[SharedPose, ...], into: Array) -> Array:
        """Covariance of the difference from the first measured pose of a body (or angle of a hinge)."""
        start, start_random = self._starts.setdefault(name, (shared, random))
        if start is shared:
            return np.zeros((3, 3))
        since = tuple(one.since(first) for one, first in zip(shared, start, strict=True))
        return random + start_random + _shared_covariance(since, into)

    def _joined(self, flexure: str, side: float) -> BodyOutline:
        own = next(each for each in self.mechanism.flexures if each.name == flexure)
        at = np.array(own.point_mm(side * 1.3 * own.half_length_mm, 0.0))
        held = [o for o in self.outlines if o.body.holds(at[:, None])[0]]
        return held[0] if held else min(self.outlines, key=lambda o: float(np.hypot(*(o.body.centroid_mm - at))))


def _coordinate(poses: Sequence[SeenPose], number: int, part: str) -> dict[str, float]:
    """Range of one coordinate of a body, and medians of its standard uncertainty and of that of its motion."""
    values = [value for pose in poses if (value := getattr(pose, part)) is not None]
    whole, motion = (
        [float(covariance[number, number]) ** 0.5 for covariance in covariances if covariance is not None]
        for covariances in ((pose.covariance for pose in poses), (pose.motion for pose in poses[1:]))
    )
    u_motion = {"median_u_motion": float(np.median(motion))} if motion else {}
    return {"least": min(values), "greatest": max(values), "median_u": float(np.median(whole)), **u_motion}


def _shared_covariance(shared: tuple[SharedPose, ...], into: Array) -> Array:
    """Covariance, in the drawing's units, of the errors that all frames share: of a body, or of a hinge's angle."""
    if len(shared) == 1:
        return np.asarray(into @ shared[0].covariance @ into.T)
    return np.diag([0.0, 0.0, (1e3 * shared[0].u_turn_against(shared[1])) ** 2])


@dataclass(frozen=True, slots=True, eq=False)
class FollowedBodies:
    """The bodies of a mechanism in all frames of a recording.

    Parameters
    ----------
    tracker : BodyTracker
        What followed them.
    poses : list of FramePoses
        Poses of all bodies, for every frame.
    """

    tracker: BodyTracker
    poses: list[FramePoses]

    @property
    def counts(self) -> Mapping[str, Counter[str]]:
        """Number of frames with each status, for every body and hinge."""
        names = self.poses[0].poses if self.poses else {}
        return {name: Counter(frame.poses[name].status for frame in self.poses) for name in names}

    def in_words(self) -> dict[str, Any]:
        """Summary of the poses, for summary.json: of every coordinate of the bodies, and every hinge's angle."""
        names = self.poses[0].poses if self.poses else {}
        seen = {name: [frame.poses[name] for frame in self.poses] for name in names}
        return {
            "name": self.tracker.mechanism.name,
            "notes": list(self.tracker.placed.notes) if self.tracker.placed is not None else [],
            "bodies": {
                name: {
                    "counts": dict(self.counts[name]),
                    **{part: _coordinate(poses, number, part) for number, part in enumerate(PARTS)
                       if any(getattr(pose, part) is not None for pose in poses)},
                }
                for name, poses in seen.items()
            },
        }  # fmt: skip

    def write(self, out: Path) -> Path:
        """Write bodies.csv and flexures.csv, and add columns to an existing gaps.csv; give the path of bodies.csv."""
        flexures = self.tracker.mechanism.flexures
        write_bodies(out / BODIES, self.poses)
        write_flexures(out / FLEXURES, flexures_at_rest(self.tracker.first, flexures))
        gaps = out / GAPS
        if gaps.is_file():
            moving = [outline.body.name for outline in self.tracker.outlines if not outline.body.is_fixed]
            names = (*moving, *(flexure.name for flexure in flexures))
            add_channels(gaps, self.poses, {name: column_name(name) for name in names})
        return out / BODIES
