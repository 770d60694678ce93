"""Poses of a mechanism's bodies in every frame of a recording."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.body_poses import COVERED, DAMAGED, OK, OUT_OF_VIEW, FramePoses, SeenPose
from fingervision.domain.errors import DataError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.source import FrameSource
from fingervision.measuring.body_outlines import BodyOutline, Placement, outlines_of
from fingervision.measuring.drawing_placement import (
    LEVELS,
    GivenPoint,
    Placed,
    by_points,
    by_silhouette,
    darkness,
    refined,
)
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_bodies import column_name
from fingervision.storage.bodies_csv import add_channels, write_bodies
from fingervision.vision.grey import to_grey
from fingervision.vision.rigid_outline import (
    LEAST_IN_VIEW,
    Chunks,
    RigidFit,
    capture_rigid,
    fit_rigid,
    halved,
)

Array = NDArray[np.float64]

BODIES, GAPS = "bodies.csv", "gaps.csv"


@dataclass(frozen=True, slots=True, eq=False)
class BodiesMeasured:
    """What following the bodies of a recording left behind.

    Parameters
    ----------
    path : Path
        bodies.csv.
    poses : list of FramePoses
        Of every frame.
    counts : mapping of str to Counter
        Statuses of every body and hinge.
    placed : Placed or None
        Where the drawing lies; None where no frame could be read.
    """

    path: Path
    poses: list[FramePoses]
    counts: Mapping[str, Counter[str]]
    placed: Placed | None


class BodyTracker:
    """Follows the bodies of a mechanism from frame to frame.

    Parameters
    ----------
    mechanism : Mechanism
        The drawing.
    px_per_mm : float
        Scale.
    points : sequence of GivenPoint
        Where points of the drawing lie in the first picture; none to find it by its silhouette.
    """

    def __init__(self, mechanism: Mechanism, px_per_mm: float, points: Sequence[GivenPoint] = ()) -> None:
        self.mechanism, self.px_per_mm, self._points = mechanism, px_per_mm, tuple(points)
        self.outlines = outlines_of(mechanism)
        self.placed: Placed | None = None

    def poses(self, frames: Iterable[Frame | LostFrame]) -> Iterator[FramePoses]:
        """Follow them; the first frame that can be read tells where the drawing lies.

        Raises
        ------
        FingervisionError
            The drawing cannot be laid on that frame.
        """
        for item in frames:
            if isinstance(item, LostFrame):
                yield FramePoses(item.index, item.time_s, {n: SeenPose(DAMAGED) for n in self._names()})
                continue
            grey = to_grey(item.pixels).astype(np.float64)
            if self.placed is None:
                self._place(grey, item.index)
            yield FramePoses(item.index, item.time_s, self._seen(grey))

    def _names(self) -> list[str]:
        bodies = [outline.body.name for outline in self.outlines]
        return [*bodies, *(flexure.name for flexure in self.mechanism.flexures)]

    def _place(self, grey: Array, index: int) -> None:
        if self._points:
            place = by_points(self._points, self.px_per_mm)
            placed = Placed(place, darkness(grey, self.mechanism, place), ())
        else:
            placed = by_silhouette(grey, self.mechanism, self.px_per_mm)
        exact = refined(grey, self.outlines, placed.place, placed.body_is_dark)
        if exact is None:
            raise DataError(
                f"The edges of {self.mechanism.name} must be seen where it is laid on frame {index}, but are not: "
                "check the scale and the drawing, or give --at X,Y=XMM,YMM for three points."
            )
        self.placed = Placed(exact, placed.body_is_dark, placed.notes)
        self._chunks = [outline.chunks(exact) for outline in self.outlines]
        self._about = [outline.about_px(exact) for outline in self.outlines]
        self._last: list[tuple[Array, float]] = [(np.zeros(2), 0.0)] * len(self.outlines)

    def _fit(
        self, grey: Array, pyramid: list[Array], chunks: Chunks, about: Array, last: tuple[Array, float]
    ) -> RigidFit | None:
        """Fit near where it was last; else from farther away."""
        dark = self.placed is not None and self.placed.body_is_dark
        found = fit_rigid(grey, chunks, about, dark, last)
        if found is None or found.seen < 0.8 * found.in_view:
            if not pyramid:
                pyramid += halved(grey, LEVELS)
            wider = capture_rigid(grey, pyramid, chunks, about, dark, last)
            if found is None or (wider is not None and wider.seen > found.seen):
                found = wider
        return found

    def _seen(self, grey: Array) -> dict[str, SeenPose]:
        if self.placed is None:
            raise AssertionError("no drawing was laid")
        place, pyramid = self.placed.place, list[Array]()
        found: dict[str, SeenPose] = {}
        for number, outline in enumerate(self.outlines):
            name = outline.body.name
            chunks, about = self._chunks[number], self._about[number]
            fit = self._fit(grey, pyramid, chunks, about, self._last[number]) if chunks.middles.shape[1] >= 3 else None
            if fit is None:
                found[name] = SeenPose(self._why(grey, chunks, about, self._last[number]))
                continue
            self._last[number] = (fit.shift_px, fit.angle_rad)
            if fit.in_view < LEAST_IN_VIEW * fit.all:
                found[name] = SeenPose(OUT_OF_VIEW)
                continue
            found[name] = _pose(fit, place)
        return found | self._hinges(found)

    def _why(self, grey: Array, chunks: Chunks, about: Array, last: tuple[Array, float]) -> str:
        height, width = grey.shape
        x, y = chunks.moved(last[0], last[1], about).middles
        inside = (x > 0.0) & (x < width) & (y > 0.0) & (y < height)
        return COVERED if inside.size and inside.mean() >= LEAST_IN_VIEW else OUT_OF_VIEW

    def _hinges(self, poses: Mapping[str, SeenPose]) -> dict[str, SeenPose]:
        """Angles of hinges: how far the body beyond turned against the one before."""
        found = {}
        for flexure in self.mechanism.flexures:
            ends = [self._joined(flexure.name, side) for side in (-1.0, 1.0)]
            seen = [poses[outline.body.name] for outline in ends]
            lost = [pose.status for pose in seen if pose.status != OK]
            if lost:
                found[flexure.name] = SeenPose(lost[0])
                continue
            angle, variance = 0.0, 0.0
            for sign, pose in zip((-1.0, 1.0), seen, strict=True):
                if pose.angle_mrad is not None and pose.covariance is not None:
                    angle += sign * pose.angle_mrad
                    variance += float(pose.covariance[2, 2])
            covariance = np.zeros((3, 3))
            covariance[2, 2] = variance
            found[flexure.name] = SeenPose(OK, None, None, angle, covariance)
        return found

    def _joined(self, flexure: str, side: float) -> BodyOutline:
        own = next(each for each in self.mechanism.flexures if each.name == flexure)
        at = np.array(own.point_mm(side * 1.3 * own.half_length_mm, 0.0))
        held = [o for o in self.outlines if o.body.holds(at[:, None])[0]]
        return held[0] if held else min(self.outlines, key=lambda o: float(np.hypot(*(o.body.centroid_mm - at))))


def _pose(fit: RigidFit, place: Placement) -> SeenPose:
    """Turn a motion in the picture into the drawing's axes."""
    x, y = place.axes.T @ fit.shift_px / place.px_per_mm
    into = np.zeros((3, 3))
    into[:2, :2] = place.axes.T / place.px_per_mm
    into[2, 2] = 1e3 * place.turn_sign
    angle = 1e3 * place.turn_sign * fit.angle_rad
    return SeenPose(OK, float(x), float(y), angle, into @ fit.covariance @ into.T)


def measure_bodies(
    source: FrameSource, mechanism: Mechanism, px_per_mm: float, points: Sequence[GivenPoint], out: Path
) -> BodiesMeasured:
    """Follow the bodies of a recording into bodies.csv, and add them to the rows of its gaps.csv where there is one.

    Parameters
    ----------
    source : FrameSource
        The recording; read once.
    mechanism : Mechanism
        The drawing.
    px_per_mm : float
        Scale.
    points : sequence of GivenPoint
        Where points of the drawing lie in the first picture; none to find it by its silhouette.
    out : Path
        Folder of the results.
    """
    tracker = BodyTracker(mechanism, px_per_mm, points)
    poses = list(tracker.poses(source))
    write_bodies(out / BODIES, poses)
    gaps = out / GAPS
    if gaps.is_file():
        moving = [outline.body.name for outline in tracker.outlines if not outline.body.is_fixed]
        hinges = [flexure.name for flexure in mechanism.flexures]
        add_channels(gaps, poses, {name: column_name(name) for name in (*moving, *hinges)})
    counts = {name: Counter(frame.poses[name].status for frame in poses if name in frame.poses)
              for name in (poses[0].poses if poses else {})}  # fmt: skip
    return BodiesMeasured(out / BODIES, poses, counts, tracker.placed)
