"""What the bed sees: frame by frame, where the stage was and how hard it pushed when the camera looked."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from fingervision.domain.errors import FingervisionError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.gap import NoGap
from fingervision.measuring.rows import Result, RowMaker
from fingervision.storage.gaps_csv import GapRow
from fingervision.testbed.actuator import Actuator
from fingervision.testbed.arrival_clock import ArrivalClock
from fingervision.testbed.bed import Bed
from fingervision.testbed.board.clock_join import ClockJoin
from fingervision.testbed.camera import BedCamera, Shot
from fingervision.testbed.force_sensor import ForceSensor
from fingervision.vision.pipeline import Settings, measure_frame

# Readings that are kept: a frame looks back over its own latency, which is far less at 200 readings a second.
READINGS_KEPT = 2000


class Instrument:
    """Readings of an actuator or a force sensor, at any time of the bed.

    Parameters
    ----------
    source : Actuator or ForceSensor
        Where they come from.
    """

    def __init__(self, source: Actuator | ForceSensor) -> None:
        self._source = source
        self.clock = ClockJoin()
        self._device_s: deque[float] = deque(maxlen=READINGS_KEPT)
        self._values: deque[float] = deque(maxlen=READINGS_KEPT)
        self.newest = 0.0

    def read(self) -> None:
        """Take what came since the last time."""
        readings = self._source.readings()
        for reading in readings:
            if not self._device_s or reading.device_s > self._device_s[-1]:
                self._device_s.append(reading.device_s)
                self._values.append(reading.value)
        asked = readings[-1]
        self.clock.add(asked.device_s, asked.asked_s, asked.got_s)
        self.newest = asked.value

    def at(self, bed_s: float) -> float:
        """Interpolate between the readings about a time of the bed."""
        joined = self.clock.joined()
        if joined is None:
            return self.newest
        device_s = joined.board_s + (bed_s - joined.host_s) / joined.rate
        return float(np.interp(device_s, self._device_s, self._values))


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """One frame, and the bed when it was exposed.

    Parameters
    ----------
    shot : Shot
        The frame, perhaps not yet drawn.
    input_mm : float
        Position of the stage, as read by the actuator.
    force_n : float or None
        Force at the drive.
    force_now_n : float or None
        The newest force.
    """

    shot: Shot
    input_mm: float
    force_n: float | None
    force_now_n: float | None


class Sight:
    """Looks and measures.

    Parameters
    ----------
    bed : Bed
        With a camera and a scale.

    Raises
    ------
    FingervisionError
        There is no camera, or no scale for its frames.
    """

    def __init__(self, bed: Bed) -> None:
        if bed.camera is None:
            raise FingervisionError("A run must be seen, but the bed has no camera: add a [camera].")
        if bed.scale is None:
            raise FingervisionError(
                "A run must have a scale, but the bed has none: add a [scale] with px_per_mm or a calibration."
            )
        description = bed.camera.description
        bed.scale.check_frame_size(description.width_px, description.height_px)
        self.camera: BedCamera = bed.camera
        self.rate_hz = description.rate_hz or 25.0
        self.position = Instrument(bed.actuator)
        self.force = None if bed.force_sensor is None else Instrument(bed.force_sensor)
        self.camera_clock = ArrivalClock(bed.camera.latency)
        self._settings = Settings(bed.below_tip_mm * bed.scale.px_per_mm)
        self._rows = RowMaker(bed.scale, (description.width_px, description.height_px))

    def look(self) -> Look:
        """Wait for the next frame, and read the instruments after it."""
        shot = self.camera.next()
        self.camera_clock.add(shot.device_s, shot.arrived_s)
        self.position.read()
        if self.force is not None:
            self.force.read()
        exposed_s = self.camera_clock.joined().bed_at(shot.device_s)
        force_n = None if self.force is None else self.force.at(exposed_s)
        return Look(shot, self.position.at(exposed_s), force_n, None if self.force is None else self.force.newest)

    def measure(self, item: Frame | LostFrame) -> tuple[GapRow, str]:
        """Measure a picture: its row, and where there is no number the reason in a sentence."""
        outcome = item if isinstance(item, LostFrame) else measure_frame(item, self._settings)
        (row,) = self._rows.rows((Result(item.index, item.time_s, outcome),))
        return row, outcome.words if isinstance(outcome, NoGap | LostFrame) else ""
