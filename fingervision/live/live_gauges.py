"""Gauges on a live source: measured in every frame and tracked from the position at which they were drawn."""

from collections import deque
from collections.abc import Mapping
from itertools import count
from pathlib import Path
from typing import Any

from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.status import Status
from fingervision.gauges.gauge_file import Gauge
from fingervision.gauges.kinds import measured_together, unread
from fingervision.gauges.picture import picture_of
from fingervision.gauges.plane_scale import PlaneScale
from fingervision.live.gauge_course import GaugeCourse, told
from fingervision.live.playback.gauge_board import GaugeBoard
from fingervision.live.playback.gauge_following import FOLLOWING, GAUGES, NO_SCALE, GaugesBeside
from fingervision.live.session import Session
from fingervision.storage.gaps_csv import GapRow

FRAMES_KEPT = 15_000
"""Number of frames whose readings are stored: ten minutes at 25 frames per second, as in the page's charts."""
FRAMES_COUNTED = 100
"""Number of the most recent frames among which those measured without gauges are counted for the page."""


class LiveGauges:
    """Measures, in the measuring thread, the gauges that were drawn on the live picture.

    An unchanged gauge continues from its present position; a new or changed gauge starts in the next frame at the
    position at which it was drawn. If the measurement is too slow, some frames are measured without gauges, and the
    browser page states their number.

    Parameters
    ----------
    session : Session
        The live measurement.
    board : GaugeBoard
        The board with the gauges.
    """

    def __init__(self, session: Session, board: GaugeBoard) -> None:
        self._session, self._board = session, board
        self._followers: dict[str, tuple[Mapping[str, Any], Any, int]] = {}
        self._numbers = count()
        self.course = GaugeCourse(FRAMES_KEPT)
        self.gauges: Mapping[int, Gauge] = {}
        """The gauges that are followed, by the numbers of their readings; a changed gauge has a new number."""
        self._scale: object = None
        self._left_out: deque[bool] = deque(maxlen=FRAMES_COUNTED)

    @property
    def frames(self) -> int:
        """Number of frames measured so far."""
        return self.course.frames

    @property
    def is_whole(self) -> bool:
        """Whether the readings are those of all frames: of a live source, those until now."""
        return True

    @property
    def first(self) -> int | None:
        """Number of the frame in which gauges are drawn: the displayed frame, as a live source admits any frame."""
        seen = self._session.seen
        return None if seen is None else seen.frame.index

    @property
    def trouble(self) -> str:
        """Reason why there are no readings, or fewer readings than frames."""
        if self._session.choices.task is None:
            return NO_SCALE
        if failure := self._session.supervisor.trouble_of(FOLLOWING):
            return failure
        if left_out := sum(self._left_out):
            return (
                f"{left_out} of the last {len(self._left_out)} frames were measured without the gauges, because the "
                "measurement is slower than the source."
            )
        return ""

    def readings(self, frame: int, version: int) -> list[dict[str, Any]] | None:
        """Readings in one frame for a given version of the gauges; None if there are no readings."""
        found = self.course.find(frame)
        return found.readings if found is not None and found.version == version else None

    def see(self, item: Frame | LostFrame, row: GapRow | None) -> None:
        """Measure the gauges in the next frame; an error of a gauge does not end the measurement of the gap."""
        task = self._session.choices.task
        if task is None or not self._board.gauges:
            return
        is_left_out = self._session.in_a_hurry
        self._left_out.append(is_left_out)
        if is_left_out:
            for _, follower, _ in self._followers.values():
                follower.lost()
            return
        with self._session.supervisor.watching(FOLLOWING):
            self._read_all(item, row)

    def _read_all(self, item: Frame | LostFrame, row: GapRow | None) -> None:
        task = self._session.choices.task
        assert task is not None  # noqa: S101 - asked before
        version, gauges = self._board.snapshot()
        tables = {table["name"]: dict(table) for table in self._board.tables}
        if task.scale is not self._scale:
            # A patch gauge measures from its first frame; after a change of scale every gauge starts again.
            self._scale, self._followers = task.scale, {}
        kept = self._followers
        self._followers = {
            gauge.name: kept[gauge.name]
            if gauge.name in kept and kept[gauge.name][0] == tables.get(gauge.name)
            else (tables.get(gauge.name, {}), gauge.spec.follower(), next(self._numbers))
            for gauge in gauges
        }
        self.gauges = {self._followers[gauge.name][2]: gauge for gauge in gauges}
        status = row.status if row is not None else None
        followers = [self._followers[gauge.name][1] for gauge in gauges]
        if isinstance(item, LostFrame):
            readings = unread(item, item.status, followers)
        elif status in (Status.DAMAGED, Status.DUPLICATE):
            readings = unread(item, status, followers)
        else:
            settings, _ = task.settings_for(())
            readings = list(measured_together(followers, picture_of(item, settings)))
        description = self._session.description
        plane = PlaneScale(task.scale, (description.width_px, description.height_px))
        self.course.add(item.index, item.time_s, version, told(self.gauges, readings, plane))


def put_live_gauges(session: Session, path: Path, *, is_asked_for: bool = False) -> GaugesBeside:
    """Add gauges to a live measurement, and begin to measure them.

    Raises
    ------
    DataError, InputFileError
        The file exists but cannot be read, or its gauges do not fit these frames.
    """
    description = session.description
    board = GaugeBoard(path, (description.width_px, description.height_px))
    gauges = LiveGauges(session, board)
    beside = GaugesBeside(board, gauges, is_asked_for=is_asked_for, is_live=True)
    session.features[GAUGES] = beside
    session.on_picture.append(gauges.see)
    return beside
