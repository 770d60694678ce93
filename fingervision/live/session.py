"""The live measurement: every frame is measured on arrival, and the results are kept for the browser pages."""

from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, replace
from operator import attrgetter
from pathlib import Path
from threading import Event, Lock, Thread
from time import monotonic
from typing import Any

import numpy as np

from fingervision.domain.errors import StateError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.status import Status
from fingervision.frames.source import Driven
from fingervision.live.cadence import Cadence
from fingervision.live.capture import Arrival, Capture, Ended, Happening, OverflowReport
from fingervision.live.choices import MOVES_ZERO, Choices
from fingervision.live.frame_measurement import FrameMeasurement, Seen
from fingervision.live.recorder import Recorder
from fingervision.live.run_folder import RecordedFrame, RunFolder
from fingervision.live.view import View
from fingervision.measuring.scale import other_camera
from fingervision.storage.gaps_csv import GapRow
from fingervision.vision.grey import full_scale, to_grey

# Measured rows of the last minutes, in a fixed amount of memory.


# Number of rows: ten minutes at 25 frames per second.
ROWS_KEPT = 15_000
STATUSES = tuple(Status)
FINGERS = ("", "dark", "light")
# All columns but the name of the run; status and fingers are numbers of a list.
NAMES = tuple(each.name for each in fields(GapRow) if each.name != "run")
STATUS, OF_FINGERS = NAMES.index("status"), NAMES.index("fingers")
OF_DRIVE = NAMES.index("input_mm")
GAPS = np.array([NAMES.index(name) for name in ("gap_px", "gap_mm")])
UNSURE = np.array([NAMES.index(name) for name in ("u_shift_px", "u_gap_mm")])
_cells_of = attrgetter(*NAMES)  # `dataclasses.astuple` copies every value, which takes half a millisecond


class History:
    """Ring buffer of measured rows.

    Parameters
    ----------
    kept : int
        Number of rows that are kept.
    """

    def __init__(self, kept: int = ROWS_KEPT) -> None:
        # Filling the array makes the operating system allocate its memory now. NaN represents an empty cell, only here.
        self._cells = np.full((kept, len(NAMES)), np.nan)
        self.count = 0
        self._lock = Lock()

    def add(self, row: GapRow) -> None:
        """Add a row; if the buffer is full, the oldest row is dropped."""
        with self._lock:
            self._cells[self.count % len(self._cells)] = _cells(row)
            self.count += 1

    def replace(self, rows: Sequence[GapRow], others: range) -> None:
        """Replace the rows of some frames; their input and force stay.

        The greatest change of a gap is added to the uncertainty of other frames, which cannot be measured again.
        """
        with self._lock:
            change = np.zeros(len(GAPS))
            for row in rows:
                here, now = self._cells[:, 0] == row.frame, np.array(_cells(row))
                changed = np.abs(self._cells[here][:, GAPS] - now[GAPS])
                change = np.fmax(change, np.fmax.reduce(changed, axis=0, initial=0.0))
                self._cells[here, :OF_DRIVE] = now[:OF_DRIVE]
            among = (self._cells[:, 0] >= others.start) & (self._cells[:, 0] < others.stop)
            self._cells[np.ix_(among, UNSURE)] = np.hypot(self._cells[np.ix_(among, UNSURE)], change)

    @property
    def oldest(self) -> int:
        """Number of the oldest row in the buffer, counted from the first row of the measurement."""
        return max(0, self.count - len(self._cells))

    def rows(self, after: int = 0, before: int | None = None) -> Iterator[GapRow]:
        """Rows in the buffer with numbers from `after` to `before` - 1, counted since the start of the measurement."""
        with self._lock:
            last = self.count if before is None else min(before, self.count)
            asked = np.arange(max(after, self.count - len(self._cells)), last)
            kept = self._cells[asked % len(self._cells)].tolist()
        for numbers in kept:
            cells: list[Any] = [None if cell != cell else cell for cell in numbers]
            cells[0], cells[STATUS] = int(cells[0]), STATUSES[int(cells[STATUS])]
            cells[OF_FINGERS] = FINGERS[int(cells[OF_FINGERS])]
            yield GapRow(**dict(zip(NAMES, cells, strict=True)))


def _cells(row: GapRow) -> list[float]:
    cells = [*_cells_of(row)]
    cells[STATUS], cells[OF_FINGERS] = STATUSES.index(row.status), FINGERS.index(row.fingers)
    return [np.nan if cell is None else cell for cell in cells]


# Check of the illumination in the picture: overexposed, too dark, or fluctuating.


# Every eighth pixel along both axes is sufficient.
STEP_PX = 8
# A white background is usual, but a picture of which a larger share is white shows no fingers.
WHITE_SHARE = 0.99
# If the 99th percentile of the grey levels is below this share of full scale, the contrast is low.
DARK_SHARE, BRIGHTEST_PERCENT = 0.25, 99.0
# The brightest parts are the background; it may change by at most this share of full scale over 50 frames.
CHANGE_SHARE, FRAMES_LOOKED_AT = 0.05, 50


class Exposure:
    """Checks the illumination from frame to frame."""

    def __init__(self) -> None:
        self._ground: deque[float] = deque(maxlen=FRAMES_LOOKED_AT)
        self.words = ""

    def add(self, frame: Frame) -> None:
        """Add a frame to the check; afterwards `words` states the problem, or is empty."""
        sparse: Any = np.ascontiguousarray(frame.pixels[::STEP_PX, ::STEP_PX])
        grey = to_grey(sparse)
        scale = full_scale(grey)
        brightest = int((grey.size - 1) * BRIGHTEST_PERCENT / 100.0)
        ground = float(np.partition(grey, brightest, axis=None)[brightest]) / scale
        self._ground.append(ground)
        if np.count_nonzero(grey == scale) > WHITE_SHARE * grey.size:
            self.words = "The picture is saturated: lower the exposure or the light."
        elif ground < DARK_SHARE:
            self.words = "The picture is too dark: raise the exposure or the light."
        elif max(self._ground) - min(self._ground) > CHANGE_SHARE:
            self.words = "The light is changing: switch off automatic exposure, or shield the set-up from other light."
        else:
            self.words = ""


# The source counts as silent after this time without a frame, or after this number of frame periods if that is longer.
SILENT_S, SILENT_PERIODS = 0.5, 5.0
# With more waiting frames than this number, the measurement is too slow, and the preview is slowed down.
FRAMES_UNTIL_HURRY = 1


ROWS_SHOWN = 3000
"""Number of rows that are sent to a new page: two minutes at 25 frames per second."""

DrivenAt = Callable[[float | None], Driven | None]
RowListener = Callable[[GapRow, float], None]
PictureListener = Callable[[Frame | LostFrame, GapRow | None], None]


class Session(View):
    """Measures the frames of a source in a separate thread.

    Parameters
    ----------
    capture : Capture
        Capture of the source, not yet started.
    choices : Choices
        Settings chosen by the user.
    out : Path
        Folder for runs and snapshots.
    """

    def __init__(self, capture: Capture, choices: Choices, out: Path) -> None:
        super().__init__(capture.source.description, choices, out)
        self.capture = capture
        self.history = History()
        self.cadence, self.exposure = Cadence(), Exposure()
        self.counts: Counter[Status] = Counter()
        self.ended = Event()
        self.on_row: list[RowListener] = []
        self.on_picture: list[PictureListener] = []
        """Functions that the measuring thread calls with every frame, to measure more than the gap."""
        self.driven_at: DrivenAt = lambda time_s: None
        """Function that returns the gripper's input at a time of this view, if the source gives no input."""
        self._measurement = FrameMeasurement(
            (self.description.width_px, self.description.height_px),
            tell=lambda words: self.say("camera", words),
            again=self._replace,
        )
        self._frame_at_s = monotonic()
        self._interrupted, self._run = False, ""
        self._recorder: Recorder | None = None
        self._failed: Recorder | None = None
        self._beginning = False
        self._overflow = OverflowReport(capture, self.say)
        self._lock = Lock()
        self._stopped = Event()
        self._thread: Thread | None = None
        for note in (*self.description.notes, other_camera(choices.scale, self.description.camera)):
            if note:
                self.say("camera", note)

    def start(self) -> None:
        """Start the measurement as soon as the source is ready."""
        from fingervision.measuring.rehearsal import rehearse  # with the renderer, which no recording needs

        self.capture.start(self.supervisor)
        rehearse()
        self.capture.begin()
        self._frame_at_s = monotonic()
        self._thread = self.supervisor.start("Measuring", self._measure, lambda why: self.ended.set())

    def stop(self) -> None:
        """End the measurement; a running recording is completed properly."""
        self.capture.stop()
        self._stopped.set()
        if self._thread is not None:
            self._thread.join()
        if self._failed is not None:
            self._failed.join()
        if self._recorder is not None:
            self.stop_recording()

    def say(self, name: str, words: str) -> None:
        """Send a message to all users, and record it."""
        recorder = self._recorder
        if recorder is not None:
            recorder.add((name, words))
        super().say(name, words)

    @property
    def row_count(self) -> int:
        """Number of rows so far."""
        return self.history.count

    @property
    def oldest_row(self) -> int:
        """Number of the oldest row that is still stored."""
        return self.history.oldest

    @property
    def shown_from(self) -> int:
        """Number of the first row that is sent to a newly opened browser page, about two minutes old."""
        return max(self.oldest_row, self.history.count - ROWS_SHOWN)

    def rows(self, first: int, last: int) -> Iterator[GapRow]:
        """Rows with numbers from `first` to `last` - 1."""
        return self.history.rows(first, last)

    def state(self) -> dict[str, Any]:
        """Return the state of source and measurement, for the browser page."""
        cadence, recorder = self.cadence, self.recording
        jitter_s = cadence.jitter_s
        return {
            **super().state(),
            "whole": False,
            "rate_hz": cadence.rate_hz,
            "camera": ", ".join(f"{name} {value}" for name, value in self.capture.source.description.camera.items()),
            "jitter_ms": None if jitter_s is None else 1e3 * jitter_s,
            "dropped": cadence.missing + self.capture.overflowed,
            "duplicates": self.counts[Status.DUPLICATE],
            "damaged": self.counts[Status.DAMAGED],
            "exposure": self.exposure.words,
            "silent_s": self.silent_s,
            "ended": self.ended.is_set(),
            "recording": None
            if recorder is None
            else {
                "path": str(recorder.run.path),
                "frames": recorder.run.frames,
                "minutes_left": recorder.minutes_left,
            },
        }

    def choose(self, **changes: Any) -> None:
        """Change settings of measurement or display.

        Raises
        ------
        StateError
            The choice does not fit the source's frames, or would change a recording in progress.
        """
        with self._lock:
            if MOVES_ZERO & set(changes) and (self._recorder is not None or self._beginning):
                raise StateError(
                    "The settings of the measurement cannot be changed while a run is recorded: stop recording first."
                )
            super().choose(**changes)

    def record(self) -> Path:
        """Begin a recording.

        Raises
        ------
        StateError
            A recording is in progress already, the source has ended, or the scale is not known.
        OutputError
            The folder cannot be written.
        """
        with self._lock:
            task = self.choices.task
            if self.ended.is_set():
                raise StateError("The source has ended, so nothing can be recorded: start the live view again.")
            if self._recorder is not None and not self._recorder.failure:
                raise StateError(f"A run is being recorded already, in {self._recorder.run.path}.")
            if self._beginning:
                raise StateError("A recording is already being started.")
            if task is None:
                raise StateError("The scale is not known: give the scale before recording, so that the run has gaps.")
            if not self.description.has_times:
                raise StateError(
                    "These images have no times, which a recording needs: start the live view with their frame rate."
                )
            self._beginning = True
        try:
            # The folder is made without the lock, because a slow disk would otherwise delay the measurement.
            run = RunFolder(self.out, self.capture.source.description, task, self.capture.source.template)
            self._recorder = Recorder(run, self.supervisor)
        finally:
            self._beginning = False
        self.say("recording", f"Recording to {run.path}.")
        return run.path

    def stop_recording(self) -> Path:
        """End the recording; return its folder.

        Raises
        ------
        StateError
            No recording is in progress, or its file could not be completed.
        """
        with self._lock:
            recorder, self._recorder = self._recorder, None
        if recorder is None:
            raise StateError("Nothing is being recorded.")
        recorder.stop()
        self.say("stopped", f"Recorded {recorder.run.frames} frames to {recorder.run.path}.")
        return recorder.run.path

    @property
    def recording(self) -> Recorder | None:
        """The running recording; None without a recording."""
        return self._recorder

    @property
    def silent_s(self) -> float:
        """Time without a frame (s); 0 while frames arrive regularly."""
        if self.ended.is_set():
            return 0.0
        since_s = monotonic() - self._frame_at_s
        usual_s = max(SILENT_S, SILENT_PERIODS * (self.cadence.period_s or 0.0))
        return since_s if self._interrupted or since_s > usual_s else 0.0

    @property
    def in_a_hurry(self) -> bool:
        """Whether measurement or disk is too slow, so that previews should not be rendered."""
        recorder = self._recorder
        lags = self.capture.waiting.qsize() > FRAMES_UNTIL_HURRY
        return lags or (recorder is not None and recorder.in_a_hurry)

    def _replace(self, rows: Sequence[GapRow], left_out: range) -> None:
        """Replace rows that were measured before the camera was known; pages read all rows again."""
        self.history.replace(rows, left_out)
        self.renew()

    def _measure(self) -> None:
        while not self._stopped.is_set():
            what = self.capture.next(0.1)
            if isinstance(what, Arrival):
                self._take(what)
            elif isinstance(what, Happening):
                self._interrupted = what.name in ("interrupted", "changed")
                if what.name in ("interrupted", "time_jumped"):
                    self.cadence.restart()
                self.say(what.name, what.words)
            elif isinstance(what, Ended):
                self._interrupted = False
                self.say("ended", "The source has ended.")
                self.ended.set()
                return

    def _take(self, arrival: Arrival) -> None:
        with self._lock:
            self._frame_at_s = monotonic()
            self._interrupted = False
            came = arrival.item
            recorder = self._recorder
            run = None if recorder is None else recorder.run
            item, outcome, row = self._measurement.measured(came, self.choices, run)
            driven = arrival.driven or self.driven_at(came.time_s)
            if driven is not None and driven.run != self._run:
                # The test bed takes no frames between two runs; this interruption is not counted as missing frames.
                self._run = driven.run
                self.cadence.restart()
            if row is not None and driven is not None:
                row = replace(row, run=driven.run, input_mm=driven.input_mm, force_n=driven.force_n)
            for look in self.on_picture:
                look(item, row)
            if isinstance(came, Frame):
                if came.time_s is not None:
                    self.cadence.add(came.time_s)
                self.exposure.add(came)
                self.seen = Seen(came, outcome, row)
            if row is None:
                return
            self.history.add(row)
            self.counts[row.status] += 1
            if recorder is not None:
                settings = self._measurement.settings
                seen = None if outcome is None or settings is None else (settings, outcome)
                recorder.add(RecordedFrame(item, arrival.packets, seen))
                if recorder.failure:
                    self._recorder, self._failed = None, recorder
        self._overflow.say()
        for listener in self.on_row:
            listener(row, arrival.arrived_s)
