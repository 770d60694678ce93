"""Stage position and force at the time of each camera frame."""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fingervision.domain.camera import CameraModel
from fingervision.domain.errors import DataError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.measuring.frame_loop import MeasureFrame
from fingervision.measuring.rows import Result, RowMaker
from fingervision.measuring.task import Task, task_for_frames
from fingervision.motion.encoder_interpolation import StageTrack
from fingervision.storage.gaps_csv import GapRow
from fingervision.testbed.actuator import Actuator
from fingervision.testbed.bed import Bed
from fingervision.testbed.camera import BedCamera, Shot
from fingervision.testbed.clocks.clock import ArrivalClock, ClockJoin
from fingervision.testbed.force_sensor import ForceSensor, Reading
from fingervision.testbed.text_protocol.sensor import TextSensor
from fingervision.vision.pipeline import measure_frame

# Number of readings that are kept: at 200 readings per second they cover far more than the latency of a frame.
READINGS_KEPT = 2000
# Interval of the position's readings: between two of them, a stage that starts or arrives does not move evenly. Read
# once in a frame of 40 ms, its position was up to 3 um wrong at 0.5 mm/s, and a healthy stage was diagnosed as faulty.
READ_EVERY_S = 0.01
# A camera that sends no frame is waited for by its own patience.
LONGEST_WAIT_S = 1.0


class JoinedInstrument:
    """An instrument whose clock is synchronised with the test bed's clock by every response.

    Parameters
    ----------
    source : Actuator or ForceSensor
        Source of the readings.
    note : callable
        Stores a reading.
    """

    def __init__(self, source: Actuator | ForceSensor, note: Callable[[Reading], None]) -> None:
        self._source, self._note = source, note
        self.clock = ClockJoin()
        self.newest = 0.0

    def read(self) -> tuple[Reading, ...]:
        """Store and return the readings since the last call, and synchronise the clocks with them."""
        readings = self._source.readings()
        asked = readings[-1]
        self.clock.add(asked.device_s, asked.asked_s, asked.got_s)
        self.newest = asked.value
        for reading in readings:
            self._note(reading)
        return readings

    def device_at(self, bed_s: float) -> float:
        """Convert a time of the test bed to the instrument's clock; before synchronisation, return it unchanged."""
        joined = self.clock.joined()
        return bed_s if joined is None else joined.board_s + (bed_s - joined.host_s) / joined.rate


class Position(JoinedInstrument):
    """Position of the stage over time, interpolated between the steps of its encoder."""

    def __init__(self, actuator: Actuator) -> None:
        self._track = StageTrack(actuator.limits.encoder_step_mm)
        super().__init__(actuator, self._track.add)

    def at(self, bed_s: float, *, at_once: bool = False) -> float | None:
        """Position (mm) at a time of the test bed; None until later readings determine it (see `StageTrack`)."""
        return self._track.at_mm(self.device_at(bed_s), at_once=at_once)


class History:
    """The newest readings of a quantity, between which it is interpolated linearly."""

    def __init__(self) -> None:
        self._readings: deque[tuple[float, float]] = deque(maxlen=READINGS_KEPT)

    def add(self, reading: Reading) -> None:
        """Store a reading; one that is no newer than the last one is left out."""
        if not self._readings or reading.device_s > self._readings[-1][0]:
            self._readings.append((reading.device_s, reading.value))

    def at(self, device_s: float) -> float | None:
        """Value at a time of the instrument's clock, held after the newest reading; None before the first reading."""
        return float(np.interp(device_s, *np.array(self._readings).T)) if self._readings else None


class Force(JoinedInstrument):
    """Force at the drive over time."""

    def __init__(self, sensor: ForceSensor) -> None:
        self._history = History()
        super().__init__(sensor, self._history.add)

    def at(self, bed_s: float) -> float | None:
        """Force at a time of the test bed, interpolated linearly between readings (N)."""
        return self._history.at(self.device_at(bed_s))


class Channel:
    """A further quantity over time, whose times are those of the test bed."""

    def __init__(self, source: TextSensor) -> None:
        self._source, self._history = source, History()

    def at(self, bed_s: float) -> float | None:
        """Value at a time, linear between readings and held after the newest; None before the first reading."""
        for reading in self._source.samples():
            self._history.add(reading)
        return self._history.at(bed_s)


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """One frame, with stage position and force at its exposure.

    Parameters
    ----------
    shot : Shot
        The frame, possibly not yet rendered.
    exposed_s : float
        Time of the exposure on the test bed's clock, as far as the camera's clock is synchronised.
    encoder_mm : float
        Latest reading of the stage's position.
    force_n : float or None
        Force at the drive at the exposure.
    force_now_n : float or None
        Latest reading of the force.
    channels : mapping of str to float or None
        Values of the channels at the exposure.
    """

    shot: Shot
    exposed_s: float
    encoder_mm: float
    force_n: float | None
    force_now_n: float | None
    channels: Mapping[str, float | None] = field(default_factory=dict)


class Sight:
    """Acquires frames with instrument readings at their exposures, and measures the frames.

    Parameters
    ----------
    bed : Bed
        Test bed with a camera and a scale.

    Raises
    ------
    FingervisionError
        The test bed has no camera, or no scale for the camera's frames.
    """

    def __init__(self, bed: Bed) -> None:
        if bed.camera is None:
            raise DataError("A run needs a camera, but the test bed has none: add a [camera] section.")
        if bed.scale is None:
            raise DataError(
                "A run must have a scale, but the test bed has none: add a [scale] with px_per_mm or a calibration."
            )
        description = bed.camera.description
        self.camera: BedCamera = bed.camera
        self.task = task_for_frames(Task(bed.scale, below_tip_mm=bed.below_tip_mm), description)
        """Settings of the measurement, as those of a recording."""
        self.settings = self.task.settings
        """Settings for the image processing, with the camera as it is assumed until `know` states another."""
        self.rate_hz = description.rate_hz or 25.0
        self.width_mm = description.width_px / bed.scale.px_per_mm
        self.position = Position(bed.actuator)
        self.force = None if bed.force_sensor is None else Force(bed.force_sensor)
        self.channels = {name: Channel(sensor) for name, sensor in bed.channels.items()}
        self.camera_clock = ArrivalClock(bed.camera.latency)
        # A test bed that replays has the position at all times.
        self._ready = None if bed.replays else getattr(bed.camera, "ready", None)
        self._rows = RowMaker(self.task.scale, (description.width_px, description.height_px))

    def is_behind(self) -> bool:
        """Whether a frame waits to be looked at."""
        return self._ready is not None and self._ready(0.0)

    def look(self) -> Look:
        """Wait for the next frame, read the position meanwhile, and all instruments after its arrival."""
        waited_s = 0.0
        while self._ready is not None and waited_s < LONGEST_WAIT_S and not self._ready(READ_EVERY_S):
            self.position.read()
            waited_s += READ_EVERY_S
        shot = self.camera.next()
        self.camera_clock.add(shot.device_s, shot.arrived_s)
        self.position.read()
        if self.force is not None:
            self.force.read()
        exposed_s = self.camera_clock.joined().host_at(shot.device_s)
        force_n = None if self.force is None else self.force.at(exposed_s)
        force_now_n = None if self.force is None else self.force.newest
        channels = {name: channel.at(exposed_s) for name, channel in self.channels.items()}
        return Look(shot, exposed_s, self.position.newest, force_n, force_now_n, channels)

    def clocks(self) -> dict[str, dict[str, float]]:
        """Relation of each instrument's clock to the test bed's, for run.json."""
        joined = {"camera": self.camera_clock.joined(), "actuator": self.position.clock.joined()}
        if self.force is not None:
            joined["force_sensor"] = self.force.clock.joined()
        return {
            name: {"offset_s": one.host_s - one.board_s, "rate": one.rate, "u_s": one.u_at(one.board_s)}
            for name, one in joined.items()
            if one is not None
        }

    def know(self, camera: CameraModel | None) -> None:
        """Measure the following pictures by a camera that was learnt; None changes nothing."""
        if camera is not None:
            self.settings = replace(self.settings, camera=camera)

    def measure(
        self, item: Frame | LostFrame, how: MeasureFrame = measure_frame
    ) -> tuple[GapRow, GapMeasurement | NoGap | LostFrame]:
        """Measure a picture at once: return its row, and the result from which the row was made.

        A stage in motion cannot wait until something else beside the edges is learnt; others give `ChangingEdges`.
        """
        outcome = item if isinstance(item, LostFrame) else how(item, self.settings)
        (row,) = self._rows.rows((Result(item.index, item.time_s, outcome),))
        return row, outcome
