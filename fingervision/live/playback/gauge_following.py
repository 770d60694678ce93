"""Gauges of a recording in the page: measured from the first to the displayed frame, as by `measure --gauges`."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from threading import Event, Thread
from typing import TYPE_CHECKING, Any

from fingervision.domain.camera import CameraModel
from fingervision.domain.errors import StateError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.status import Status
from fingervision.gauges.gauge_file import Gauge
from fingervision.gauges.kinds import measured_together, unread
from fingervision.gauges.picture import picture_of
from fingervision.gauges.plane_scale import PlaneScale
from fingervision.gauges.reading import Reading
from fingervision.live.frame_measurement import Seen
from fingervision.live.gauge_course import GaugeCourse, told
from fingervision.live.playback.gauge_board import GaugeBoard
from fingervision.live.playback.playback import Playback
from fingervision.measuring.camera_learning import camera_beside, camera_of, learnt_first
from fingervision.measuring.frame_loop import Prepared, coded, prepared
from fingervision.measuring.marked import marked
from fingervision.measuring.scale import Scale
from fingervision.measuring.task import Task
from fingervision.storage.gauge_files import GaugeRow
from fingervision.storage.run_files import lost_frames
from fingervision.vision.defect_pixels import repaired
from fingervision.vision.pipeline import Settings

if TYPE_CHECKING:
    from fingervision.live.live_gauges import LiveGauges

GAUGES = "gauges"
"""Name of the gauges in the features of a view."""
LOOK_EVERY_S = 0.02
# Number of frames ahead of the displayed one that are measured without a pause, so that their readings are ready at
# once; after each further frame, the processor is left to the page for a moment.
AHEAD_FRAMES, PAUSE_S = 25, 0.001
FOLLOWING = "Reading the gauges"
NO_SCALE = "The scale is not known: gauges can be drawn, and have readings as soon as the scale is given."


class GaugeFollowing:
    """Measures the gauges of a gauge board in a separate thread.

    A gauge tracks its object from frame to frame, and a patch gauge measures the displacement since the first frame;
    the reading in a frame therefore requires that all earlier frames were measured. The table of the recording states,
    as in `measure`, whether a frame is damaged or repeated. Any change of gauges, scale or settings restarts the
    measurement.

    Parameters
    ----------
    playback : Playback
        The recording.
    board : GaugeBoard
        The board with the gauges.
    """

    def __init__(self, playback: Playback, board: GaugeBoard) -> None:
        self._playback, self._board = playback, board
        self._stopped = Event()
        self._key: tuple[int, str] | None = None
        self._camera: tuple[str, CameraModel] | None = None
        self.course = GaugeCourse()
        self.gauges: Mapping[int, Gauge] = {}
        """The gauges that are followed, by the numbers of their readings."""
        self.first: int | None = None
        """Number of the first frame that has a picture; None until it is known."""
        self._thread: Thread | None = None

    @property
    def trouble(self) -> str:
        """Reason why there are no readings; empty if there are."""
        return NO_SCALE if self._playback.choices.task is None else self._playback.supervisor.trouble_of(FOLLOWING)

    def start(self) -> None:
        """Start the measuring thread."""
        self._thread = self._playback.supervisor.start("Following the gauges", self._follow)

    def stop(self) -> None:
        """Stop the measuring thread."""
        self._stopped.set()
        if self._thread is not None:
            self._thread.join()

    @property
    def frames(self) -> int:
        """Number of frames measured so far."""
        return self.course.frames

    @property
    def is_whole(self) -> bool:
        """Whether the present gauges are measured in every frame of the recording."""
        return self._key == self._now() and self._playback.table is not None and self.frames >= self._playback.row_count

    def readings(self, frame: int, version: int) -> list[dict[str, Any]] | None:
        """Readings in a frame of a given version of the gauges; None until they are measured."""
        found = self.course.find(frame)
        if self._key != (version, self._playback.identity) or found is None or found.version != version:
            return None
        return found.readings

    def _follow(self) -> None:
        while not self._stopped.is_set():
            version, gauges = self._board.snapshot()
            key = (version, self._playback.identity)
            if key == self._key:
                self._stopped.wait(LOOK_EVERY_S)
                continue
            task = self._playback.choices.task
            self.course.begin()
            self.gauges, self._key = dict(enumerate(gauges)), key
            if task is not None:
                with self._playback.supervisor.watching(FOLLOWING):
                    self._read_all(key, gauges, task)

    def _now(self) -> tuple[int, str]:
        return self._board.version, self._playback.identity

    def _read_all(self, key: tuple[int, str], gauges: Sequence[Gauge], task: Task) -> None:
        source = self._playback.recorded.source
        how: Prepared = prepared(source.description, task)
        plane = PlaneScale(task.scale, (how.description.width_px, how.description.height_px))
        followers = [gauge.spec.follower() for gauge in gauges]
        marks = lost_frames(source.description.files)
        items, camera = learnt_first(
            coded(iter(marked(source, marks) if marks else source), how.description.coding),
            how.settings,
            task.scale,
            lambda: self._stopped.is_set() or key != self._now(),
            self._learn,
        )
        settings = replace(how.settings, camera=camera)
        for item in items:
            status = self._status(item.index, key)
            if status is None:
                return
            readings: Sequence[Reading]
            if isinstance(item, LostFrame) or status in (Status.DAMAGED, Status.DUPLICATE):
                readings = unread(item, status, followers)
            else:
                if self.first is None:
                    self.first = item.index
                readings = measured_together(followers, picture_of(repaired(item, camera), settings))
            if key != self._now():
                return
            self.course.add(item.index, item.time_s, key[0], told(self.gauges, readings, plane))
            if item.index > self._playback.frame + AHEAD_FRAMES:
                self._stopped.wait(PAUSE_S)

    def _learn(self, frames: Sequence[Frame], settings: Settings, scale: Scale | None) -> CameraModel:
        """Learn the camera as `measure` does, once for each way of measuring."""
        if self._camera is None or self._camera[0] != self._playback.identity:
            learn = camera_beside if settings.has_fingers else camera_of
            self._camera = self._playback.identity, learn(frames, settings, scale)
        return self._camera[1]

    def _status(self, frame: int, key: tuple[int, str]) -> Status | None:
        """Wait until a frame is present in the table, and return the frame's status.

        None means that the measuring thread was stopped, or that gauges or settings have changed.
        """
        playback = self._playback
        while not self._stopped.is_set() and key == self._now():
            row = next(playback.rows(frame, frame + 1), None)
            if row is not None:
                return row.status
            if playback.failure:
                raise StateError(playback.failure)
            self._stopped.wait(LOOK_EVERY_S)
        return None


class GaugesBeside:
    """Data for the gauge panel in the browser page.

    Parameters
    ----------
    board : GaugeBoard
        The gauges and their file.
    following : GaugeFollowing or LiveGauges
        Measurement of the gauges in the frames of a recording or a camera.
    is_asked_for : bool
        Whether the user requested gauges on the command line, so that the panel is open from the beginning.
    is_live : bool
        Whether the frames come from a continuous source, in which gauges can be drawn in any frame.
    """

    def __init__(
        self, board: GaugeBoard, following: "GaugeFollowing | LiveGauges", *, is_asked_for: bool, is_live: bool = False
    ) -> None:
        self.board, self.following = board, following
        self.is_asked_for, self.is_live = is_asked_for, is_live
        self.is_changed_meanwhile = False
        """Whether the last request to save failed because another program had changed the file."""

    def readings_in(self, seen: Seen | None, version: int) -> dict[str, Any]:
        """Readings of a version of the gauges in the frame of a picture, for the page."""
        frame = None if seen is None else seen.frame.index
        return {"frame": frame, "readings": None if frame is None else self.following.readings(frame, version)}

    @property
    def rows(self) -> list[GaugeRow]:
        """Rows of gauges.csv with the present gauges, as `measure --gauges` writes them for a recording."""
        return self.following.course.rows(self.following.gauges)

    def refuse_part(self) -> None:
        """Refuse what needs all frames as long as some are to be measured.

        Raises
        ------
        StateError
            The gauges are not measured in all frames yet.
        """
        if self.board.gauges and not self.following.is_whole:
            raise StateError(
                self.following.trouble
                or f"The gauges must be measured in all frames, but are measured in {self.following.frames} until now: "
                "save again in a moment."
            )


def put_gauges_beside(playback: Playback, path: Path, *, is_asked_for: bool = False) -> GaugesBeside:
    """Add gauges to the playback of a recording, and start to measure them.

    Raises
    ------
    DataError, InputFileError
        The file exists but cannot be read, or its gauges do not fit these frames.
    """
    description = playback.description
    board = GaugeBoard(path, (description.width_px, description.height_px))
    following = GaugeFollowing(playback, board)
    beside = GaugesBeside(board, following, is_asked_for=is_asked_for)
    playback.features[GAUGES] = beside
    playback.on_stop.append(following.stop)
    following.start()
    return beside
