"""A bed for bluesky: stage, force sensor and camera as devices of its RunEngine, and an agent around the next run.

The stage is movable, readable, stoppable and flyable; the force sensor readable; the camera, with its frames measured,
readable and flyable: one event a frame, with stage and force at the frame's exposure. `NextRunAgent` takes measured
rows (`ingest`, or as a subscriber of the RunEngine) and suggests the run that tells most of what is open (`suggest`).

Tested with a real RunEngine of bluesky 1.15 on the simulated bed (tests/adapters/test_bluesky.py); on hardware only as
far as the bed's own devices are. A simulated bed must be opened with `pace=1`: time then passes for every device alike.
Protocols: bluesky.protocols, https://blueskyproject.io/bluesky/main/hardware.html. Needs the extra `bluesky`.
"""

import csv
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from fingervision.diagnosis.diagnose import Diagnosis, diagnose
from fingervision.domain.errors import DataError, DeviceError, LimitError, StateError
from fingervision.models.corrected import CorrectedModel
from fingervision.tables.read import read_measured_table
from fingervision.testbed.bed import Bed
from fingervision.testbed.reading import Reading
from fingervision.testbed.run.synchronised_acquisition import Sight

POLL_S = 0.005
FRAMES_TO_JOIN = 5
"""Frames after the last motion that are waited for: the stage's place is known between readings on either side."""
JOINED_WITHIN_S = 5.0
"""Twenty answers of a slow line; until then nothing tells which reading belongs to which frame."""
ROW = ("run", "time_s", "input_mm", "gap_mm", "left_mm", "right_mm", "force_n")


class ThreadStatus:
    """Status of something that a thread waits for; done when the thread has ended.

    Parameters
    ----------
    work : callable
        Returns when it is done; an exception is the status's.
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
        """Whether it has ended."""
        return self._ended.is_set()

    @property
    def success(self) -> bool:
        """Whether it has ended as it should."""
        return self.done and self._error is None

    def exception(self, timeout: float | None = 0.0) -> BaseException | None:
        """Wait for its end and give what it raised; TimeoutError where it goes on."""
        if not self._ended.wait(timeout):
            raise TimeoutError
        return self._error

    def add_callback(self, callback: Callable[["ThreadStatus"], None]) -> None:
        """Call when done; at once where it is."""
        with self._lock:
            if not self._ended.is_set():
                self._callbacks.append(callback)
                return
        callback(self)


class _Shared:
    """An actuator whose readings go to each who asks: otherwise one would take them from the other."""

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
    """The stage: `set(mm)` moves, `stop` stops at once, `prepare((to_mm, speed_mm_s))` and `kickoff` fly."""

    parent = None

    def __init__(self, name: str, bed: Bed, actuator: Any, unix_s: float) -> None:
        self.name, self._bed, self._actuator, self._unix_s = name, bed, actuator, unix_s
        self._consumer = actuator.consumer()
        self.speed_mm_s = min(1.0, bed.limits.speed_mm_s)
        self._flight: tuple[float, float] | None = None
        self._flown: list[Reading] = []

    @property
    def hints(self) -> dict[str, list[str]]:
        """What plots show by themselves."""
        return {"fields": [self.name]}

    def set(self, value: float) -> ThreadStatus:
        """Move to a position in mm at `speed_mm_s`; done when the stage stands there."""
        self._within(value)
        self._actuator.move(float(value), self.speed_mm_s)
        return ThreadStatus(self._until_rest)

    def stop(self, success: bool = True) -> None:
        """Stop the motor at once, whatever else is under way."""
        self._actuator.stop()

    def read(self) -> dict[str, dict[str, Any]]:
        """Position of now."""
        newest = self._consumer.readings()[-1]
        return {self.name: {"value": newest.value, "timestamp": self._unix_s + newest.got_s}}

    def describe(self) -> dict[str, dict[str, Any]]:
        """Unit and source of the position."""
        return {self.name: {"source": self._actuator.name, "dtype": "number", "shape": [], "units": "mm"}}

    def read_configuration(self) -> dict[str, dict[str, Any]]:
        """Speed of the motions."""
        return {f"{self.name}_speed": {"value": self.speed_mm_s, "timestamp": time.time()}}

    def describe_configuration(self) -> dict[str, dict[str, Any]]:
        """Unit of the speed."""
        return {f"{self.name}_speed": {"source": "settings", "dtype": "number", "shape": [], "units": "mm/s"}}

    def prepare(self, value: tuple[float, float]) -> ThreadStatus:
        """State where a flight goes, and at which speed in mm/s."""
        self._within(value[0])
        self._flight = value
        return ThreadStatus(lambda: None)

    def kickoff(self) -> ThreadStatus:
        """Begin to fly."""
        if self._flight is None:
            raise StateError(f"{self.name} must be prepared with (to_mm, speed_mm_s) before it flies.")
        self._flown = []
        self._consumer.readings()
        self._actuator.move(*map(float, self._flight))
        return ThreadStatus(lambda: None)

    def complete(self) -> ThreadStatus:
        """Wait for the end of the flight."""

        def work() -> None:
            self._until_rest()
            self._flown += self._consumer.readings()

        return ThreadStatus(work)

    def describe_collect(self) -> dict[str, dict[str, dict[str, Any]]]:
        """The stream of a flight: positions."""
        return {f"{self.name}_flight": self.describe()}

    def collect(self) -> Iterator[dict[str, Any]]:
        """Give every reading of the flight."""
        for one in self._flown:
            at_s = self._unix_s + one.got_s
            yield {"time": at_s, "data": {self.name: one.value}, "timestamps": {self.name: at_s}}
        self._flown = []

    def _within(self, to_mm: float) -> None:
        limits = self._bed.limits
        if not limits.lower_mm <= float(to_mm) <= limits.upper_mm:
            raise LimitError(
                f"{self.name} must stay between {limits.lower_mm:g} and {limits.upper_mm:g} mm, but {float(to_mm):g} "
                "mm is asked for: nothing was moved."
            )

    def _until_rest(self) -> None:
        clock = self._bed.clock
        while self._actuator.busy:
            clock.wait_until(clock.now_s() + POLL_S)
        if self._actuator.alarm is not None:
            raise DeviceError(f"{self.name} stopped with an alarm: {self._actuator.alarm.words}.")


class ForceDevice:
    """The force sensor: readable."""

    parent = None

    def __init__(self, name: str, bed: Bed, lock: threading.RLock, unix_s: float) -> None:
        assert bed.force_sensor is not None  # noqa: S101 - looked at by whoever makes it
        self.name, self._sensor, self._lock, self._unix_s = name, bed.force_sensor, lock, unix_s

    def read(self) -> dict[str, dict[str, Any]]:
        """Force of now."""
        with self._lock:
            newest = self._sensor.readings()[-1]
        return {self.name: {"value": newest.value, "timestamp": self._unix_s + newest.got_s}}

    def describe(self) -> dict[str, dict[str, Any]]:
        """Unit and source of the force."""
        return {self.name: {"source": self._sensor.name, "dtype": "number", "shape": [], "units": "N"}}


class GapDevice:
    """The camera with its frames measured: readable after `trigger`, flyable with one event a frame."""

    parent = None

    def __init__(self, name: str, bed: Bed, actuator: Any, lock: threading.RLock, unix_s: float) -> None:
        self.name, self._lock, self._unix_s = name, lock, unix_s
        self._clock = bed.clock
        self._sight = Sight(replace(bed, actuator=actuator.consumer()))
        self._source = self._sight.camera.description.name
        self._newest: dict[str, Any] | None = None
        self._at_s = 0.0
        self._stop_flight, self._flight = threading.Event(), ThreadStatus(lambda: None)
        self._flown: list[tuple[float, dict[str, Any]]] = []

    @property
    def hints(self) -> dict[str, list[str]]:
        """What plots show by themselves."""
        return {"fields": [f"{self.name}_gap_mm"]}

    def trigger(self) -> ThreadStatus:
        """Take a frame that is exposed from now on, and measure it."""

        def work() -> None:
            with self._lock:
                began_s = self._begin()
                look = self._sight.look()
                while look.exposed_s < began_s:
                    look = self._sight.look()
                self._at_s, self._newest = look.exposed_s, self._measured(look, at_once=True)

        return ThreadStatus(work)

    def read(self) -> dict[str, dict[str, Any]]:
        """Gap, edges, stage and force of the frame that was triggered last; None where a frame has no gap."""
        if self._newest is None:
            raise StateError(f"{self.name} must be triggered before it is read: no frame was taken yet.")
        at_s = self._unix_s + self._at_s
        return {key: {"value": value, "timestamp": at_s} for key, value in self._newest.items()}

    def describe(self) -> dict[str, dict[str, Any]]:
        """Units of the columns."""
        units = {"gap_mm": "mm", "u_gap_mm": "mm", "left_mm": "mm", "right_mm": "mm", "input_mm": "mm", "force_n": "N"}
        keys = {
            f"{self.name}_{key}": {"source": self._source, "dtype": "number", "shape": [], "units": unit}
            for key, unit in units.items()
        }
        return {**keys, f"{self.name}_status": {"source": self._source, "dtype": "string", "shape": []}}

    def kickoff(self) -> ThreadStatus:
        """Begin to measure every frame."""
        self._stop_flight.clear()
        self._flown = []
        self._flight = ThreadStatus(self._fly)
        return ThreadStatus(lambda: None)

    def complete(self) -> ThreadStatus:
        """End with a few frames after now."""
        self._stop_flight.set()
        flight = self._flight

        def work() -> None:
            error = flight.exception(None)
            if error is not None:
                raise error

        return ThreadStatus(work)

    def describe_collect(self) -> dict[str, dict[str, dict[str, Any]]]:
        """The stream of a flight: what a frame has."""
        return {f"{self.name}_flight": self.describe()}

    def collect(self) -> Iterator[dict[str, Any]]:
        """Give every frame of the flight."""
        for exposed_s, data in self._flown:
            at_s = self._unix_s + exposed_s
            yield {"time": at_s, "data": data, "timestamps": dict.fromkeys(data, at_s)}
        self._flown = []

    def _begin(self) -> float:
        """Know where the stage is before the first frame that counts; time on the bed's clock from which they do."""
        instruments = [one for one in (self._sight.position, self._sight.force) if one is not None]
        until_s = self._clock.now_s() + JOINED_WITHIN_S
        for one in instruments:
            one.read()
        while any(one.clock.joined() is None for one in instruments):
            if self._clock.now_s() > until_s:
                raise DeviceError(
                    f"The clocks of stage and force sensor must be joined to the bed's within {JOINED_WITHIN_S:g} s, "
                    "but are not: see that they answer."
                )
            self._clock.wait_until(self._clock.now_s() + POLL_S)
            for one in instruments:
                one.read()
        # The stage stood or moved before: its place is told between two readings, so the frame lies after the first.
        self._clock.wait_until(self._clock.now_s() + POLL_S)
        return self._clock.now_s()

    def _fly(self) -> None:
        looks: deque[Any] = deque()
        left = FRAMES_TO_JOIN
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
                    self._flown.append((look.exposed_s, self._measured(look, at_once=not left)))

    def _measured(self, look: Any, *, at_once: bool) -> dict[str, Any]:
        row, _ = self._sight.measure(look.shot.item())
        input_mm = self._sight.position.at(look.exposed_s, at_once=at_once)
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
    """The devices of a bed; None where it has no such part."""

    stage: StageDevice
    force: ForceDevice | None
    gap: GapDevice | None


def devices(bed: Bed, *, prefix: str = "") -> Devices:
    """Make the devices of an open bed: `stage`, `force`, `gap`, each with the prefix before its name."""
    lock, unix_s = threading.RLock(), time.time() - bed.clock.now_s()
    shared = _Shared(bed.actuator, lock)
    return Devices(
        StageDevice(f"{prefix}stage", bed, shared, unix_s),
        None if bed.force_sensor is None else ForceDevice(f"{prefix}force", bed, lock, unix_s),
        None if bed.camera is None else GapDevice(f"{prefix}gap", bed, shared, lock, unix_s),
    )


class NextRunAgent:
    """Diagnoses what was measured, and suggests the run that separates what is left open.

    Parameters
    ----------
    model : CorrectedModel
        What the measurement is held against (`fingervision.tables.read.read_model`).
    gap : str
        Name of the `GapDevice` whose events it takes as a subscriber (`RE.subscribe(agent)`).
    seed : int
        Of the diagnosis.
    """

    def __init__(self, model: CorrectedModel, gap: str = "gap", *, seed: int = 1) -> None:
        self._model, self._gap, self._seed = model, gap, seed
        self._rows: list[dict[str, Any]] = []
        self._run = 0
        self._answer: Diagnosis | None = None

    def ingest(self, rows: Sequence[Mapping[str, Any]]) -> None:
        """Take rows with `input_mm` and any of `gap_mm`, `run`, `time_s`, `left_mm`, `right_mm`, `force_n`."""
        for row in rows:
            if row.get("input_mm") is None:
                raise DataError(f"Every row must have input_mm, but one has {sorted(row)}: add it.")
            self._rows.append({"run": str(self._run), **{key: row.get(key) for key in ROW if row.get(key) is not None}})
        self._answer = None

    def __call__(self, name: str, document: Mapping[str, Any]) -> None:
        """Take the documents of a RunEngine: each of its runs is a run of the table."""
        if name == "start":
            self._run += 1
        if name == "event":
            self._ingest_event(document["time"], document["data"])
        if name == "event_page":
            for k, at_s in enumerate(document["time"]):
                self._ingest_event(at_s, {key: values[k] for key, values in document["data"].items()})

    def report(self) -> Diagnosis:
        """Diagnose everything that was taken so far."""
        if self._answer is None:
            with TemporaryDirectory(prefix="fingervision-") as folder:
                path = Path(folder) / "measured.csv"
                keys = [key for key in ROW if any(row.get(key) is not None for row in self._rows)]
                with path.open("w", encoding="utf-8", newline="") as file:
                    writer = csv.writer(file, lineterminator="\n")
                    writer.writerow(keys)
                    writer.writerows([["" if row.get(key) is None else row[key] for key in keys] for row in self._rows])
                self._answer = diagnose(read_measured_table(path), self._model, seed=self._seed)
        return self._answer

    def suggest(self, batch_size: int = 1) -> list[dict[str, Any]]:
        """Suggest the next run: `name`, `steps` as in a recipe, `separates`; empty where nothing is open."""
        proposed = self.report().report.next_run
        if proposed is None or batch_size < 1:
            return []
        steps = [dict(step) for step in proposed.steps]
        return [{"name": proposed.name, "steps": steps, "separates": list(proposed.separates)}]

    def _ingest_event(self, at_s: float, data: Mapping[str, Any]) -> None:
        prefix = f"{self._gap}_"
        own = {key.removeprefix(prefix): value for key, value in data.items() if key.startswith(prefix)}
        if own.get("input_mm") is not None:
            self.ingest([{**own, "run": str(self._run), "time_s": at_s}])


def run_steps(steps: Sequence[Mapping[str, Any]], stage: StageDevice, gap: GapDevice) -> Iterator[Any]:
    """Give a bluesky plan for the steps of a recipe: one run, the gap flown while the stage moves.

    Kinds: triangle, move and hold; others need the bed's own runner (`fingervision bed run`).
    """
    import bluesky.plan_stubs as bps
    import bluesky.preprocessors as bpp

    def moves() -> Iterator[Any]:
        for step in steps:
            kind, speed_mm_s = step.get("kind"), float(step.get("speed_mm_s", stage.speed_mm_s))
            if kind in ("triangle", "move"):
                ends = [step["from_mm"], *[step["to_mm"], step["from_mm"]] * int(step.get("cycles", 1))]
                for to_mm in ends if kind == "triangle" else [step["to_mm"]]:
                    yield from bps.prepare(stage, (float(to_mm), speed_mm_s), wait=True)
                    yield from bps.kickoff(stage, wait=True)
                    yield from bps.complete(stage, wait=True)
            elif kind == "hold":
                yield from bps.mv(stage, float(step["at_mm"]))
                yield from bps.sleep(float(step["seconds"]))
            else:
                raise DataError(
                    f"A step must be a triangle, move or hold here, but is {kind!r}: `fingervision bed run` runs it."
                )

    def flown() -> Iterator[Any]:
        yield from bps.kickoff(gap, wait=True)
        yield from moves()
        yield from bps.complete(gap, wait=True)
        yield from bps.collect(gap)

    yield from bpp.run_wrapper(flown())  # type: ignore[no-untyped-call]  # it carries no types
