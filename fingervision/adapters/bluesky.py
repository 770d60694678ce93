"""A test bed for bluesky: stage, force sensor and camera as devices of the RunEngine of bluesky.

In bluesky's terms, the stage is movable, readable, stoppable and flyable; the force sensor is readable. The camera is
readable and flyable: each measured frame is one event, with stage position and force at its exposure. `bluesky_agent`
suggests the next run.

The adapter is tested with a RunEngine of bluesky 1.15 on the simulated test bed (tests/adapters/test_bluesky.py); on
hardware, only the devices of the test bed are tested. A simulated test bed must be opened with `real_time=True`, so
that its time advances in the same way for every device. Protocols: bluesky.protocols,
https://blueskyproject.io/bluesky/main/hardware.html. The adapter needs the extra `bluesky`.
"""

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

from fingervision.domain.errors import ArgumentError, ArgumentTypeError, DeviceError, LimitError, StateError
from fingervision.domain.frame import Frame
from fingervision.measuring.camera_learning import WANTED, camera_beside
from fingervision.measuring.changed_edges import ChangingEdges
from fingervision.testbed.bed import Bed
from fingervision.testbed.clocks.clock import VirtualClock
from fingervision.testbed.force_sensor import Reading
from fingervision.testbed.run.synchronised_acquisition import Look, Sight

# Status of work in a thread, following bluesky.protocols.Status: done, callbacks, exception.


class ThreadStatus:
    """Status of work in a thread; done when the thread has ended.

    Parameters
    ----------
    work : callable
        Function that does the work; the status reports an exception that it raises.
    """

    def __init__(self, work: Callable[[], None]) -> None:
        self._ended, self._lock = threading.Event(), threading.Lock()
        self._callbacks: list[Callable[[ThreadStatus], None]] = []
        self._error: BaseException | None = None

        def run() -> None:
            try:
                work()
            except BaseException as error:
                self._error = error
            with self._lock:
                self._ended.set()
                callbacks = list(self._callbacks)
            for callback in callbacks:
                callback(self)

        threading.Thread(target=run, name="fingervision-bluesky", daemon=True).start()

    @property
    def done(self) -> bool:
        """Whether the work in the thread has ended."""
        return self._ended.is_set()

    @property
    def success(self) -> bool:
        """Whether the work in the thread has ended without an error."""
        return self.done and self._error is None

    def exception(self, timeout: float | None = 0.0) -> BaseException | None:
        """Wait until the thread has ended; return the exception that it raised, if any, or raise TimeoutError."""
        if not self._ended.wait(timeout):
            raise TimeoutError
        return self._error

    def add_callback(self, callback: Callable[["ThreadStatus"], None]) -> None:
        """Call `callback` when the thread has ended; immediately if it already has."""
        with self._lock:
            if not self._ended.is_set():
                self._callbacks.append(callback)
                return
        callback(self)


POLL_S = 0.005
FRAMES_TO_JOIN = 5
"""Number of frames to wait for after the last motion, because the stage's position is interpolated between readings
before and after a frame."""
JOINED_WITHIN_S = 5.0
"""Longest time for the synchronisation of the clocks: twenty answers over a slow serial line. Before synchronisation,
readings cannot be assigned to frames."""


class _Shared:
    """An actuator whose readings are distributed to several readers, because each reading is returned only once."""

    def __init__(self, actuator: Any, lock: threading.RLock) -> None:
        self._actuator, self._lock = actuator, lock
        self._waiting: list[deque[Reading]] = []

    def consumer(self) -> "_Consumer":
        self._waiting.append(deque(maxlen=100_000))
        return _Consumer(self, self._waiting[-1])

    def drawn(self, own: deque[Reading]) -> tuple[Reading, ...]:
        with self._lock:
            for reading in self._actuator.readings():
                for each in self._waiting:
                    each.append(reading)
            taken = tuple(own)
            own.clear()
        return taken

    def __getattr__(self, name: str) -> Any:
        return getattr(self._actuator, name)


class _Consumer:
    def __init__(self, shared: _Shared, own: deque[Reading]) -> None:
        self._shared, self._own = shared, own

    def readings(self) -> tuple[Reading, ...]:
        return self._shared.drawn(self._own)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._shared, name)


class StageDevice:
    """The stage as a bluesky device: `set(mm)` moves it, `stop` stops it; `prepare` and `kickoff` start a flight."""

    parent = None

    def __init__(self, name: str, bed: Bed, actuator: Any, unix_s: float) -> None:
        self.name, self._bed, self._actuator, self._unix_s = name, bed, actuator, unix_s
        self._consumer = actuator.consumer()
        self.speed_mm_s = min(1.0, bed.limits.speed_mm_s)
        self._flight: tuple[float, float] | None = None
        self._flown: list[Reading] = []

    @property
    def hints(self) -> dict[str, list[str]]:
        """Names of the fields that bluesky plots by default."""
        return {"fields": [self.name]}

    def set(self, value: float) -> ThreadStatus:
        """Move to a position in mm at `speed_mm_s`; the status is done when the stage is at rest at this position."""
        self._within(value)
        self._actuator.move(float(value), self.speed_mm_s)
        return ThreadStatus(self._until_rest)

    def stop(self, success: bool = True) -> None:
        """Stop the motor at once, during any command."""
        self._actuator.stop()

    def read(self) -> dict[str, dict[str, Any]]:
        """Return the present position."""
        newest = self._consumer.readings()[-1]
        return {self.name: {"value": newest.value, "timestamp": self._unix_s + newest.got_s}}

    def describe(self) -> dict[str, dict[str, Any]]:
        """Return unit and source of the position."""
        return {self.name: {"source": self._actuator.name, "dtype": "number", "shape": [], "units": "mm"}}

    def read_configuration(self) -> dict[str, dict[str, Any]]:
        """Return the speed of motions."""
        return {f"{self.name}_speed": {"value": self.speed_mm_s, "timestamp": time.time()}}

    def describe_configuration(self) -> dict[str, dict[str, Any]]:
        """Return the unit of the stage's speed."""
        return {f"{self.name}_speed": {"source": "settings", "dtype": "number", "shape": [], "units": "mm/s"}}

    def prepare(self, value: tuple[float, float]) -> ThreadStatus:
        """Set target (mm) and speed (mm/s) of a flight."""
        self._within(value[0])
        self._flight = value
        return ThreadStatus(lambda: None)

    def kickoff(self) -> ThreadStatus:
        """Start the motion of the flight."""
        if self._flight is None:
            raise StateError(
                f"{self.name} must be prepared with (to_mm, speed_mm_s) before kickoff (Bluesky's fly scan)."
            )
        self._flown = []
        self._consumer.readings()
        self._actuator.move(*map(float, self._flight))
        return ThreadStatus(lambda: None)

    def complete(self) -> ThreadStatus:
        """Wait until the flight (a motion with continuous readings) has ended."""

        def work() -> None:
            self._until_rest()
            self._flown += self._consumer.readings()

        return ThreadStatus(work)

    def describe_collect(self) -> dict[str, dict[str, dict[str, Any]]]:
        """Describe the data stream of a flight: positions."""
        return {f"{self.name}_flight": self.describe()}

    def collect(self) -> Iterator[dict[str, Any]]:
        """Yield every position reading of the flight."""
        for one in self._flown:
            at_s = self._unix_s + one.got_s
            yield {"time": at_s, "data": {self.name: one.value}, "timestamps": {self.name: at_s}}
        self._flown = []

    def _within(self, to_mm: float) -> None:
        limits = self._bed.limits
        if not limits.lower_mm <= float(to_mm) <= limits.upper_mm:
            raise LimitError(
                f"{self.name} must stay between {limits.lower_mm:g} and {limits.upper_mm:g} mm, but {float(to_mm):g} "
                "mm is requested: nothing was moved."
            )

    def _until_rest(self) -> None:
        clock = self._bed.clock
        while self._actuator.busy:
            clock.wait_until(clock.now_s() + POLL_S)
        if self._actuator.alarm is not None:
            raise DeviceError(f"{self.name} stopped with an alarm: {self._actuator.alarm.words}.")


class ForceDevice:
    """The force sensor, a readable device."""

    parent = None

    def __init__(self, name: str, bed: Bed, lock: threading.RLock, unix_s: float) -> None:
        assert bed.force_sensor is not None  # noqa: S101 - looked at by whoever makes it
        self.name, self._sensor, self._lock, self._unix_s = name, bed.force_sensor, lock, unix_s

    def read(self) -> dict[str, dict[str, Any]]:
        """Return the present force."""
        with self._lock:
            newest = self._sensor.readings()[-1]
        return {self.name: {"value": newest.value, "timestamp": self._unix_s + newest.got_s}}

    def describe(self) -> dict[str, dict[str, Any]]:
        """Return unit and source of the force."""
        return {self.name: {"source": self._sensor.name, "dtype": "number", "shape": [], "units": "N"}}


class GapDevice:
    """The camera as a bluesky device that measures the gap: readable after `trigger`; a flight yields all frames."""

    parent = None

    def __init__(self, name: str, bed: Bed, actuator: Any, lock: threading.RLock, unix_s: float) -> None:
        self.name, self._lock, self._unix_s = name, lock, unix_s
        self._clock = bed.clock
        self._sight = Sight(replace(bed, actuator=actuator.consumer()))
        self._edges = ChangingEdges()
        self._source = self._sight.camera.description.name
        self._newest: dict[str, Any] | None = None
        self._at_s = 0.0
        self._is_known = False
        self._stop_flight, self._flight = threading.Event(), ThreadStatus(lambda: None)
        self._flown: list[tuple[float, dict[str, Any]]] = []

    @property
    def hints(self) -> dict[str, list[str]]:
        """Names of the fields that bluesky plots by default."""
        return {"fields": [f"{self.name}_gap_mm"]}

    def trigger(self) -> ThreadStatus:
        """Acquire a frame whose exposure begins after this call, and measure the frame."""

        def work() -> None:
            with self._lock:
                began_s = self._begin()
                if not self._is_known:
                    self._learn([self._sight.look() for _ in range(WANTED)])
                    began_s = self._clock.now_s()
                look = self._sight.look()
                while look.exposed_s < began_s:
                    look = self._sight.look()
                input_mm = self._sight.position.at(look.exposed_s, at_once=True)
                self._at_s, self._newest = look.exposed_s, self._measured(look, input_mm)

        return ThreadStatus(work)

    def read(self) -> dict[str, dict[str, Any]]:
        """Return gap, edges, stage position and force of the last triggered frame; None for a missing gap."""
        if self._newest is None:
            raise StateError(f"{self.name} must be triggered before it is read: no frame has been measured yet.")
        at_s = self._unix_s + self._at_s
        return {key: {"value": value, "timestamp": at_s} for key, value in self._newest.items()}

    def describe(self) -> dict[str, dict[str, Any]]:
        """Return the units of the columns."""
        units = {"gap_mm": "mm", "u_gap_mm": "mm", "left_mm": "mm", "right_mm": "mm", "input_mm": "mm", "force_n": "N"}
        keys = {
            f"{self.name}_{key}": {"source": self._source, "dtype": "number", "shape": [], "units": unit}
            for key, unit in units.items()
        }
        return {**keys, f"{self.name}_status": {"source": self._source, "dtype": "string", "shape": []}}

    def kickoff(self) -> ThreadStatus:
        """Start to measure every frame."""
        self._stop_flight.clear()
        self._flown = []
        self._flight = ThreadStatus(self._fly)
        return ThreadStatus(lambda: None)

    def complete(self) -> ThreadStatus:
        """End the measurement after the next few frames."""
        self._stop_flight.set()
        flight = self._flight

        def work() -> None:
            error = flight.exception(None)
            if error is not None:
                raise error

        return ThreadStatus(work)

    def describe_collect(self) -> dict[str, dict[str, dict[str, Any]]]:
        """Describe the data stream of a flight: the columns of a measured frame."""
        return {f"{self.name}_flight": self.describe()}

    def collect(self) -> Iterator[dict[str, Any]]:
        """Yield every measured frame of the flight."""
        for exposed_s, data in self._flown:
            at_s = self._unix_s + exposed_s
            yield {"time": at_s, "data": data, "timestamps": dict.fromkeys(data, at_s)}
        self._flown = []

    def _begin(self) -> float:
        """Read the stage position before the first frame to be used, and return the time from which frames are used.

        The returned time is in seconds, on the test bed's clock.
        """
        instruments = [one for one in (self._sight.position, self._sight.force) if one is not None]
        until_s = self._clock.now_s() + JOINED_WITHIN_S
        for one in instruments:
            one.read()
        while any(one.clock.joined() is None for one in instruments):
            if self._clock.now_s() > until_s:
                raise DeviceError(
                    "The clocks of stage and force sensor must be synchronised with the test bed's clock within "
                    f"{JOINED_WITHIN_S:g} s, "
                    "but are not: check that both devices respond."
                )
            self._clock.wait_until(self._clock.now_s() + POLL_S)
            for one in instruments:
                one.read()
        # The position of the stage is interpolated between two readings, so that the frame must be later than the first
        # reading.
        self._clock.wait_until(self._clock.now_s() + POLL_S)
        return self._clock.now_s()

    def _learn(self, looks: Sequence[Look]) -> None:
        """Learn the camera from the first frames, as for the table of a run: all events are measured by it."""
        frames = [item for look in looks if isinstance(item := look.shot.item(), Frame)]
        self._sight.know(camera_beside(frames, self._sight.settings, self._sight.task.scale))
        self._is_known = True

    def _fly(self) -> None:
        looks: deque[Look] = deque()
        placed: list[tuple[Look, float | None]] = []
        left = FRAMES_TO_JOIN
        learning: ThreadStatus | None = None
        with self._lock:
            began_s = self._begin()
        while left:
            left -= self._stop_flight.is_set()
            with self._lock:
                look = self._sight.look()
                if look.exposed_s >= began_s:
                    looks.append(look)
                while looks and (self._sight.position.at(looks[0].exposed_s) is not None or not left):
                    look = looks.popleft()
                    placed.append((look, self._sight.position.at(look.exposed_s, at_once=not left)))
            # Frames wait until the camera is learnt from the first of them.
            if not self._is_known and learning is None and (len(placed) >= WANTED or not left):
                learning = ThreadStatus(partial(self._learn, [look for look, _ in placed[:WANTED]]))
            if learning is not None and (learning.done or not left) and (error := learning.exception(None)) is not None:
                raise error
            if self._is_known:
                self._flown += [(look.exposed_s, self._measured(look, input_mm)) for look, input_mm in placed]
                placed.clear()

    def _measured(self, look: Look, input_mm: float | None) -> dict[str, Any]:
        row, _ = self._sight.measure(look.shot.item(), self._edges.measure)
        values = {
            "gap_mm": row.gap_mm,
            "u_gap_mm": row.u_gap_mm,
            "left_mm": row.left_mm,
            "right_mm": row.right_mm,
            "input_mm": input_mm,
            "force_n": look.force_n,
            "status": str(row.status),
        }
        return {f"{self.name}_{key}": value for key, value in values.items()}


class Devices(NamedTuple):
    """The bluesky devices of a test bed; an attribute is None if the test bed has no such part."""

    stage: StageDevice
    force: ForceDevice | None
    gap: GapDevice | None


def devices(bed: "Bed | Any", *, prefix: str = "") -> Devices:
    """Make the bluesky devices `stage`, `force` and `gap` of an open test bed; each name begins with `prefix`.

    Parameters
    ----------
    bed : OpenBed or Bed
        What `fingervision.bed` opened; a simulated test bed with `real_time=True`.
    prefix : str
        Beginning of the devices' names.

    Raises
    ------
    ArgumentError
        The argument is no open test bed, or its simulated time does not keep pace with that of bluesky.
    """
    bed = getattr(bed, "bed", bed)
    if not isinstance(bed, Bed):
        raise ArgumentTypeError("bed", "be an open test bed (fingervision.bed)", f"is a {type(bed).__name__}")
    if isinstance(bed.clock, VirtualClock) and bed.clock.pace == 0.0:
        advice = "open it with fingervision.bed(..., real_time=True)"
        raise ArgumentError("bed", "run in real time for bluesky", "is not paced", advice)
    lock, unix_s = threading.RLock(), time.time() - bed.clock.now_s()
    shared = _Shared(bed.actuator, lock)
    return Devices(
        StageDevice(f"{prefix}stage", bed, shared, unix_s),
        None if bed.force_sensor is None else ForceDevice(f"{prefix}force", bed, lock, unix_s),
        None if bed.camera is None else GapDevice(f"{prefix}gap", bed, shared, lock, unix_s),
    )
