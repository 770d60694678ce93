"""Record of a run: one row and one picture per frame, in order, written as soon as the position is known."""

from collections import deque
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from typing import Any

from fingervision.domain.camera import CameraModel
from fingervision.domain.effect import REZEROED
from fingervision.domain.frame import Frame
from fingervision.measuring.camera_learning import WANTED
from fingervision.measuring.run_table import Measured
from fingervision.storage.drive_csv import MM_PLACES, SampleRow, row_with
from fingervision.storage.gaps_csv import GapRow
from fingervision.testbed.run.run_folder import BedRunFolder
from fingervision.testbed.run.synchronised_acquisition import Look

# Smallest times between the last row of an earlier run and the start of a run that follows it, or that continues it
# after an interruption.
PAUSE_S, GAP_S = 5.0, 1.0
# A camera may send fewer frames than the rounded rate that it states (30 for 29.97), without having lost any.
RATE_ERROR = 0.02
# Word in the label of a run in which the part is turned by 180 degrees.
TURNED = "turned"
# Columns that are those of gaps.csv.
OF_GAP = ("gap_mm", "left_mm", "right_mm", "u_gap_mm", "u_random_mm")

PlaceAt = Callable[[float, bool], float | None]
"""Function that returns the stage's position at a time of the test bed; None if later readings will determine it, and
it is not needed at once."""
OnRow = Callable[[SampleRow, Frame], None]
"""Function that is called with every row once its position is known, with its picture; its gap is measured later."""


@dataclass(frozen=True, slots=True)
class Counts:
    """Numbers of frames of a run by their status; `lost`: unreadable, or missing between the recorded ones."""

    recorded: int
    with_gap: int
    lost: int


class RunRecord:
    """Numbers runs and frames, and writes each frame once.

    Parameters
    ----------
    folder : BedRunFolder
        Folder to which the frames are written.
    place_at : callable
        Position of the stage as a function of time.
    continuous : collection of int
        Recipe steps in which every frame of the camera is recorded.
    rate_hz : float
        Frame rate that the camera states; it tells, with the frames' times, how many are missing in these steps.
    on_row : callable, optional
        Called with every row as soon as its position is known, and its picture.
    """

    def __init__(
        self, folder: BedRunFolder, place_at: PlaceAt, continuous: Collection[int], rate_hz: float,
        on_row: OnRow = lambda row, picture: None,
    ) -> None:  # fmt: skip
        self.folder = folder
        self._place_at, self._on_row = place_at, on_row
        self._continuous, self._rate_hz = continuous, rate_hz
        self._run, self.turned, self._rezeroed = 1, False, False
        self._rows = self._with_gap = self._unreadable = self._events = 0
        # Intervals between the frames of continuous steps, and their sum in periods of the camera, exact and rounded.
        self._intervals, self._whole_periods, self._periods = 0, 0, 0.0
        self._last: SampleRow | None = None
        # Camera time at which the time in the folder is zero (None before the first frame), and the folder's time at
        # the start of this run.
        self._zero_s: float | None = None
        self._base_s = 0.0
        # Rows that wait for their position, and those that wait for their gap.
        self._waiting: deque[tuple[SampleRow, float, Frame]] = deque()
        self._placed: deque[SampleRow] = deque()

    @property
    def counts(self) -> Counts:
        """Number of frames so far by status."""
        expected = max(self._whole_periods, (1.0 - RATE_ERROR) * self._periods)
        return Counts(self._rows, self._with_gap, self._unreadable + max(0, int(expected) - self._intervals))

    # Start of a run.

    def follow_replayed(self, last: SampleRow) -> None:
        """Continue after the last row of an earlier run, on a test bed whose camera clock continues from there."""
        self._run = _run_number(last) + 1
        self._zero_s = last.camera_s - last.time_s

    def follow(self, last: SampleRow, now_s: float) -> None:
        """Continue after the last row of an earlier run, on a test bed whose camera clock has restarted.

        The duration of the interruption is known to the accuracy of the computer's clock, which suffices.
        """
        self._run = _run_number(last) + 1
        self._base_s = last.time_s + max(PAUSE_S, now_s - last.arrived_s)

    def go_on(self, since_began_s: float) -> None:
        """Continue after all existing rows and events, as a new run."""
        self._events = len(self.folder.events_done)
        self._rows = len(self.folder.rows)
        self._with_gap = sum(row.gap_mm is not None for row in self.folder.rows)
        for row in self.folder.rows:
            self._count_missing(row)
        if self.folder.rows:
            last = self.folder.rows[-1]
            self._run, how = _run_number(last) + 1, last.run.split()
            self.turned, self._rezeroed = TURNED in how, REZEROED in how
            self._base_s = max(last.time_s + GAP_S, since_began_s)

    @property
    def label(self) -> str:
        """Label of the run: its number, and words for the diagnosis (re-zeroed, turned)."""
        words = [str(self._run), *([TURNED] if self.turned else []), *([REZEROED] if self._rezeroed else [])]
        return " ".join(words)

    def new_run(self, *, turned: bool, rezeroed: bool = False) -> None:
        """Begin another run in the same folder; the label of a re-zeroing is kept."""
        self._run, self.turned, self._rezeroed = self._run + 1, turned, self._rezeroed or rezeroed

    # Frames.

    def there_already(self) -> GapRow | None:
        """Return the next frame's row from the folder if it was recorded before; None if it must be recorded now."""
        if self._rows >= len(self.folder.rows):
            return None
        row = self.folder.rows[self._rows]
        self._zero_s = row.camera_s - row.time_s
        self._rows += 1
        self._with_gap += row.gap_mm is not None
        self._count_missing(row)
        return GapRow(0, row.time_s, row.status, gap_mm=row.gap_mm, u_random_mm=row.u_random_mm)

    def camera(self, *, wait: bool) -> CameraModel | None:
        """Camera learnt from the first frames of the folder; None before.

        A simulation waits for it once there are enough frames, so that the same frames are measured by it in every run.
        """
        table = self.folder.table
        if not wait:
            return table.camera
        return table.camera_once_learnt() if self._rows >= WANTED else None

    def add(self, look: Look, picture: Frame, seen: Measured, step: int) -> None:
        """Add a frame, and what was measured in it at once; its row is written once position and gap are known."""
        if self._zero_s is None:
            self._zero_s = look.shot.device_s - self._base_s
        row = row_with(tuple(look.channels))(
            run=self.label,
            time_s=round(look.shot.device_s - self._zero_s, 6),
            input_mm=None,
            gap_mm=None,
            left_mm=None,
            right_mm=None,
            u_gap_mm=None,
            u_random_mm=None,
            force_n=look.force_n,
            status=seen[1].status,
            frame=self._rows,
            step=step,
            encoder_mm=_rounded(look.encoder_mm),
            camera_s=round(look.shot.device_s, 6),
            arrived_s=round(look.shot.arrived_s, 6),
            **look.channels,
        )
        self.folder.add_picture(picture, row.time_s, row.frame, seen)
        self._waiting.append((row, look.exposed_s, picture))
        self._rows += 1
        self._count_missing(row)

    def lose(self, step: int) -> None:
        """Count a frame that could not be read; in a continuous step, the frames beside it show that it is missing."""
        self._unreadable += step not in self._continuous

    def _count_missing(self, row: SampleRow) -> None:
        last, self._last = self._last, row
        # Between two runs, and in a step that records no frame, nobody wanted the frames.
        if last and row.run == last.run and row.step in self._continuous and row.step - last.step <= 1:
            periods = (row.camera_s - last.camera_s) * self._rate_hz
            self._intervals += 1
            self._whole_periods += round(periods)
            self._periods += periods

    def write(self, *, at_once: bool = False) -> None:
        """Write the rows whose interpolated stage position (`at_once`: that of all frames) and gap are known by now."""
        while self._waiting:
            row, exposed_s, picture = self._waiting[0]
            input_mm = self._place_at(exposed_s, at_once)
            if input_mm is None:
                break
            row = replace(row, input_mm=round(input_mm, MM_PLACES))
            self._placed.append(row)
            self.folder.last_s = row.time_s
            self._waiting.popleft()
            self._on_row(row, picture)
        while self._placed and self.folder.measured:
            row, measured = self._placed.popleft(), self.folder.measured.popleft()
            values: dict[str, Any] = {name: _rounded(getattr(measured, name)) for name in OF_GAP}
            self.folder.add_row(replace(row, status=measured.status, **values))
            self._with_gap += measured.gap_mm is not None

    def close(self, *, with_last: bool = True) -> None:
        """End the measurement, and write the rows of frames with a position.

        `with_last` includes the last frames, which are then judged without those that would have followed.
        """
        self.write()
        self.folder.end_pictures()
        if with_last:
            self.write()

    # Events.

    def event(self, name: str, words: str, **more: object) -> None:
        """Write an event, once."""
        self.folder.event(self._events, name, words, **more)
        self._events += 1


def _run_number(row: SampleRow) -> int:
    """Number of a row's run: the label's first word."""
    return int(row.run.split()[0])


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, MM_PLACES)
