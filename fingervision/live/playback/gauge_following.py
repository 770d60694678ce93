"""Gauges of a recording in the page: measured from the first to the displayed frame, as by `measure --gauges`."""

import json
import zlib
from collections.abc import Sequence
from pathlib import Path
from threading import Event, Thread
from typing import TYPE_CHECKING, Any

from fingervision.domain.errors import StateError
from fingervision.domain.frame import LostFrame
from fingervision.domain.status import Status
from fingervision.gauges.gauge_file import Gauge
from fingervision.gauges.kinds import measured_together, unread
from fingervision.gauges.picture import picture_of
from fingervision.gauges.plane_scale import PlaneScale
from fingervision.gauges.reading import MEANING, Mark, Reading
from fingervision.gauges.recording import cells_of
from fingervision.live.playback.gauge_board import GaugeBoard
from fingervision.live.playback.playback import Playback
from fingervision.measuring.frame_loop import Prepared, coded, prepared
from fingervision.measuring.marked import marked
from fingervision.measuring.task import Task
from fingervision.storage.run_files import lost_frames

if TYPE_CHECKING:
    from fingervision.live.live_gauges import LiveGauges

GAUGES = "gauges"
"""Name of the gauges in the features of a view."""
LOOK_EVERY_S = 0.02
# Number of frames that are measured ahead of the displayed frame, so that the next readings are ready at once.
AHEAD_FRAMES = 25
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
        self._told: list[bytes] = []
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
        return len(self._told)

    def readings(self, frame: int, version: int) -> list[dict[str, Any]] | None:
        """Readings in a frame of a given version of the gauges; None until they are measured."""
        key, told = self._key, self._told
        if key != (version, self._playback.identity) or not 0 <= frame < len(told):
            return None
        found: list[dict[str, Any]] = json.loads(zlib.decompress(told[frame]))
        return found

    def _follow(self) -> None:
        while not self._stopped.is_set():
            version, gauges = self._board.snapshot()
            key = (version, self._playback.identity)
            if key == self._key:
                self._stopped.wait(LOOK_EVERY_S)
                continue
            task = self._playback.choices.task
            self._told, self._key = [], key
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
        for item in coded(iter(marked(source, marks) if marks else source), how.description.coding):
            status = self._status(item.index, key)
            if status is None:
                return
            readings: Sequence[Reading]
            if isinstance(item, LostFrame) or status in (Status.DAMAGED, Status.DUPLICATE):
                readings = unread(item, status, followers)
            else:
                if self.first is None:
                    self.first = item.index
                readings = measured_together(followers, picture_of(item, how.settings))
            if key != self._now():
                return
            self._told.append(_packed(gauges, readings, plane))

    def _status(self, frame: int, key: tuple[int, str]) -> Status | None:
        """Wait until a frame is requested and present in the table, and return the frame's status.

        None means that the measuring thread was stopped, or that gauges or settings have changed.
        """
        playback = self._playback
        while not self._stopped.is_set() and key == self._now():
            if frame <= playback.frame + AHEAD_FRAMES:
                row = next(playback.rows(frame, frame + 1), None)
                if row is not None:
                    return row.status
                if playback.failure:
                    raise StateError(playback.failure)
            self._stopped.wait(LOOK_EVERY_S)
        return None


def _packed(gauges: Sequence[Gauge], readings: Sequence[Reading], plane: PlaneScale) -> bytes:
    """Convert readings to a compact form for storage, because a recording has many frames."""
    return zlib.compress(json.dumps(told(gauges, readings, plane)).encode())


def told(gauges: Sequence[Gauge], readings: Sequence[Reading], plane: PlaneScale) -> list[dict[str, Any]]:
    """Convert the readings in one frame to the form that the browser page displays."""
    found: list[dict[str, Any]] = []
    for gauge, reading in zip(gauges, readings, strict=True):
        cells = cells_of(reading.quantities, plane)
        found.append(
            {
                "name": gauge.name,
                "status": reading.status.value,
                "words": reading.words or MEANING.get(reading.status, ""),
                "cells": [[name, *cell] for (name, _), cell in zip(gauge.quantities, cells, strict=False)],
                "zone": _points(reading.zone),
                "marks": [_points(mark) for mark in reading.marks],
            }
        )
    return found


def _points(mark: Mark | None) -> list[tuple[float, float]]:
    return [] if mark is None else [(round(float(x), 2), round(float(y), 2)) for x, y in mark.points_px]


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
