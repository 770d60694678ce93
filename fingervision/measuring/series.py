"""Series of gaps over time, with few numbers per frame, so that an hour of video needs only some megabytes."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from calib.budget import Budget
from fingervision.domain.camera import ASSUMED_CAMERA, CameraModel
from fingervision.domain.gap import GapMeasurement
from fingervision.domain.status import Status
from fingervision.measuring.rows import Result
from fingervision.storage.gaps_csv import GapRow

# Distance (pixels) between a finger in even rows and in odd rows above which the rows are interlaced fields; colour
# sensors cause smaller distances.
COMB_PX = 0.2
# Share of the frames below which the gaps stand for some moments of a recording only (the majority of its frames have
# none), and share of the pictures with fingers below which the objects found are no fingers: a picture without fingers
# that looks like one with them is rare, but not absent (`tests/benchmarks/scenes`, set `empty`).
MAJORITY, RARELY = 0.5, 0.1
# Number of decimals (mm) of a contribution to the uncertainty, so that sums do not depend on how many frames are
# processed at once.
PLACES = 9


@dataclass(frozen=True, slots=True)
class FirstBad:
    """The first frame that could not be read.

    Parameters
    ----------
    frame : int
        Number of the frame in the recording.
    time_s : float or None
        Presentation time, where it is known.
    words : str
        Sentence that states the reason.
    """

    frame: int
    time_s: float | None
    words: str


@dataclass(slots=True)
class GapSeries:
    """The gap over time, extended while a recording is measured.

    Parameters
    ----------
    counts : Counter of Status
        Number of frames with each status.
    first_without : dict of Status to FirstBad
        First frame with each status other than ok, and the reason.
    fingers : Counter of str
        Number of frames with dark and with light fingers.
    beside : Counter of str
        Number of frames with a disturbance of the edges, by kind of disturbance; kinds include rough edges and
        interlaced fields.
    votes : Counter of str
        Number of dark and light results among the first frames, before the polarity was decided.
    has_budget : bool
        Whether the scale has an uncertainty budget.
    camera : CameraModel
        The camera, as learnt from the first frames.
    """

    counts: Counter[Status] = field(default_factory=Counter)
    first_without: dict[Status, FirstBad] = field(default_factory=dict)
    fingers: Counter[str] = field(default_factory=Counter)
    beside: Counter[str] = field(default_factory=Counter)
    votes: Counter[str] = field(default_factory=Counter)
    has_budget: bool = False
    camera: CameraModel = ASSUMED_CAMERA
    _squares: dict[tuple[str, str, str], float] = field(default_factory=dict)
    _frame: array[int] = field(default_factory=lambda: array("q"))
    _time_s: array[float] = field(default_factory=lambda: array("d"))
    _gap_mm: array[float] = field(default_factory=lambda: array("d"))
    _u_mm: array[float] = field(default_factory=lambda: array("d"))
    _u_random_mm: array[float] = field(default_factory=lambda: array("d"))
    _u_gap_px: array[float] = field(default_factory=lambda: array("d"))
    _response_px: array[float] = field(default_factory=lambda: array("d"))
    _contrast: array[float] = field(default_factory=lambda: array("d"))
    _bad_frame: array[int] = field(default_factory=lambda: array("q"))
    _bad_time_s: array[float] = field(default_factory=lambda: array("d"))

    def add_budget(self, budget: Budget) -> None:
        """Add the uncertainty budgets of more gaps."""
        for line in budget.lines:
            kind = "shared" if line.shared else "random"
            part = (line.source, kind, line.supplied)
            self._squares[part] = self._squares.get(part, 0.0) + float(np.sum(line.u_mm**2))

    @property
    def budget(self) -> list[dict[str, str | float]]:
        """Each part of the gaps' uncertainty, largest first: its source, kind, root mean square in mm, and origin."""
        count = len(self._gap_mm)
        rms_mm = {line: (square / count) ** 0.5 for line, square in self._squares.items() if count}
        return [
            {"source": source, "kind": kind, "rms_u_mm": round(u_mm, PLACES), "from": supplied}
            for (source, kind, supplied), u_mm in sorted(rms_mm.items(), key=lambda each: -each[1])
        ]

    def add(self, results: Sequence[Result], rows: Sequence[GapRow]) -> None:
        """Add the rows of more frames."""
        for result, row in zip(results, rows, strict=True):
            self.counts[row.status] += 1
            # NaN is used in memory only; a frame without a time is plotted at its number.
            time_s = float("nan") if row.time_s is None else row.time_s
            if row.gap_mm is None or row.u_random_mm is None or row.u_gap_px is None:
                self._bad_frame.append(row.frame)
                self._bad_time_s.append(time_s)
                if row.status not in self.first_without:
                    words = getattr(result.outcome, "words", "")
                    self.first_without[row.status] = FirstBad(row.frame, row.time_s, words)
                continue
            self.fingers[row.fingers] += 1
            self.beside.update(_beside(result.outcome))
            self._frame.append(row.frame)
            self._time_s.append(time_s)
            self._gap_mm.append(row.gap_mm)
            self._u_random_mm.append(row.u_random_mm)
            self._u_gap_px.append(row.u_gap_px)
            self._response_px.append(abs(getattr(result.outcome, "u_response_px", 0.0)))
            if isinstance(result.outcome, GapMeasurement):
                edges = (result.outcome.left, result.outcome.right)
                self._contrast.append(0.5 * sum(abs(edge.contrast) for edge in edges))
            self.has_budget = row.u_gap_mm is not None
            self._u_mm.append(row.u_random_mm if row.u_gap_mm is None else row.u_gap_mm)

    @property
    def frames(self) -> int:
        """Number of frames so far, including those without a gap."""
        return sum(self.counts.values())

    @property
    def is_minority(self) -> bool:
        """Whether less than half of the frames have a gap; frames that the source repeats do not count."""
        return self.counts[Status.OK] < MAJORITY * (self.frames - self.counts[Status.DUPLICATE])

    @property
    def is_chance(self) -> bool:
        """Whether fewer than a tenth of the pictures show fingers, apart from damaged and repeated ones."""
        shown = sum(self.counts[status] for status in (Status.OK, Status.TOUCHING, Status.GRIPPING))
        return shown < RARELY * (self.frames - self.counts[Status.DUPLICATE] - self.counts[Status.DAMAGED])

    @property
    def first_damaged(self) -> FirstBad | None:
        """The first damaged frame."""
        return self.first_without.get(Status.DAMAGED)

    @property
    def gap_mm(self) -> NDArray[np.float64]:
        """Gaps of the frames that have one (mm)."""
        return np.array(self._gap_mm)

    @property
    def u_mm(self) -> NDArray[np.float64]:
        """Standard uncertainty of each gap (mm): all contributions, or the random part if no budget is known."""
        return np.array(self._u_mm)

    @property
    def u_random_mm(self) -> NDArray[np.float64]:
        """Random part of each gap's standard uncertainty (mm)."""
        return np.array(self._u_random_mm)

    @property
    def u_gap_px(self) -> NDArray[np.float64]:
        """Random part of each gap's standard uncertainty (pixels)."""
        return np.array(self._u_gap_px)

    @property
    def response_px(self) -> NDArray[np.float64]:
        """Standard uncertainty of each gap (px) due to the camera's response; 0 if the response is known."""
        return np.array(self._response_px)

    @property
    def contrast(self) -> NDArray[np.float64]:
        """Mean contrast of each gap's two edges (light)."""
        return np.array(self._contrast)

    def times_s(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Times of the frames with, and of those without, a gap; None if frames have no times."""
        times, bad = np.array(self._time_s), np.array(self._bad_time_s)
        if np.isnan(times).any() or times.size + np.count_nonzero(~np.isnan(bad)) == 0:
            return None
        return times, bad[~np.isnan(bad)]

    def frame_numbers(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Numbers of the frames with, and of those without, a gap."""
        return np.array(self._frame, dtype=np.int64), np.array(self._bad_frame, dtype=np.int64)


def _beside(outcome: object) -> list[str]:
    """Names of the disturbances found at the edges of a measurement."""
    if not isinstance(outcome, GapMeasurement):
        return []
    seen = outcome.beside.split(" and ") if outcome.beside else []
    if outcome.roughness_px:
        seen.append("roughness")
    if outcome.fields_apart_px > COMB_PX:
        seen.append("interlaced")
    return seen
