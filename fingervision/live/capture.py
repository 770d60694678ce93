"""Capture every frame for the measurement; an interrupted source is opened again."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from queue import Empty, Full, Queue, SimpleQueue
from threading import Event, Lock
from time import monotonic

from fingervision.domain.errors import DeviceError, FingervisionError, StateError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.controls import CameraControl, adjust, controls_of
from fingervision.frames.source import Driven, LiveSource, OwnPacket, Received
from fingervision.live.supervisor import Supervisor, told
from fingervision.storage.recorded_video import TICKS_PER_S

# Time scale of the live view: times of the source, joined across interruptions by the computer's clock.


# If the source's clock gains this time on the computer's clock between two frames, the source's clock has jumped.
JUMP_S = 1.0


class Timeline:
    """Converts times of a source to times since the start of the live view.

    Parameters
    ----------
    started_s : float
        Reading of the computer's monotonic clock at the start.
    """

    def __init__(self, started_s: float) -> None:
        self._started_s = started_s
        self._offset_s: float | None = None
        # Times of the last frame: on the source's clock, on the computer's clock, and as returned.
        self._last: tuple[float, float, float] | None = None

    def cut(self) -> None:
        """Record an interruption of the source, after which the source's clock may start again."""
        self._offset_s = None

    def at(self, source_s: float, arrived_s: float) -> tuple[float, float]:
        """Time of a frame since the start of the live view (s).

        Parameters
        ----------
        source_s : float
            Time of the frame by the clock of the source.
        arrived_s : float
            Time of arrival by the computer's clock.

        Returns
        -------
        time_s, jump_s : float
            Time since the start, a whole number of microseconds; jump of the source's clock, usually 0.
        """
        jump_s = 0.0
        if self._last is not None and self._offset_s is not None:
            step_s, host_step_s = source_s - self._last[0], arrived_s - self._last[1]
            if step_s < 0.0 or step_s - host_step_s > JUMP_S:
                jump_s = step_s - host_step_s
                self._offset_s = None
        if self._offset_s is None:
            begins_s = arrived_s - self._started_s
            if self._last is not None:
                # Times never decrease; after a jump, the computer's clock determines how much time has passed.
                begins_s = max(begins_s, self._last[2] + 1.0 / TICKS_PER_S)
            self._offset_s = begins_s - source_s
        time_s = round((source_s + self._offset_s) * TICKS_PER_S) / TICKS_PER_S
        self._last = (source_s, arrived_s, time_s)
        return time_s, jump_s

    def on_this(self, source_s: float) -> float:
        """Convert another time of the source, such as that of a packet, to the time since the live view's start."""
        return round((source_s + (self._offset_s or 0.0)) * TICKS_PER_S) / TICKS_PER_S


# Largest number of frames that wait for the measurement while the processor is busy: four seconds at 25 frames per
# second. Further frames are lost and counted.
FRAMES_WAITING = 100
# Time between attempts to open an interrupted source again.
AGAIN_AFTER_S = 0.3
READING = "Reading the source"

Open = Callable[[], LiveSource]


@dataclass(frozen=True, slots=True, eq=False)
class Arrival:
    """A frame on its arrival, with its time in the live view.

    Parameters
    ----------
    item : Frame or LostFrame
        The frame; `time_s` counts from the start of the live view, and `index` continues over interruptions.
    arrived_s : float
        Time of arrival by the computer's monotonic clock.
    packets : tuple of OwnPacket
        Coded packets from the camera, with times on the same time scale.
    driven : Driven or None
        State of the drive at the frame's time; None if the source does not provide it.
    """

    item: Frame | LostFrame
    arrived_s: float
    packets: tuple[OwnPacket, ...]
    driven: Driven | None = None


@dataclass(frozen=True, slots=True)
class Happening:
    """An event that is reported to the user: its name and a sentence."""

    name: str
    words: str


@dataclass(frozen=True, slots=True)
class Ended:
    """Marker for the end of a recording."""


class Capture:
    """Reads a source in a separate thread.

    Parameters
    ----------
    first : LiveSource
        The opened source.
    again : callable, optional
        Function that opens the source again after an interruption; None for a file, whose end is final.
    """

    def __init__(self, first: LiveSource, again: Open | None) -> None:
        self.source = first
        self.overflowed = 0
        self.adjustments = Adjustments()
        """Settings of the camera that may be changed while it runs."""
        self.adjustments.begin(first)
        self.waiting: Queue[Arrival | Happening | Ended] = Queue(FRAMES_WAITING)
        self._again = again
        self._begun, self._stopped = Event(), Event()
        self._index = 0
        self._timeline = Timeline(monotonic())

    def start(self, supervisor: Supervisor) -> None:
        """Begin to read and discard frames, because frames that queue up in a camera would arrive late."""
        self._supervisor = supervisor
        if self._again is not None:
            self._thread = supervisor.start(READING, self._read, self._end)

    def begin(self) -> None:
        """Pass frames to the measurement from now on; a recording is read from its first frame."""
        self._timeline = Timeline(monotonic())
        self._begun.set()
        if self._again is None:
            self._thread = self._supervisor.start(READING, self._read, self._end)

    def stop(self) -> None:
        """End reading; queued frames are kept."""
        self._stopped.set()
        self.source.close()

    def next(self, timeout_s: float) -> Arrival | Happening | Ended | None:
        """Return the next frame or event; None if none arrives in time."""
        try:
            return self.waiting.get(timeout=timeout_s)
        except Empty:
            return None

    def _end(self, why: str) -> None:
        self._put(Ended())

    def _read(self) -> None:
        while not self._stopped.is_set():
            try:
                for received in self.source.received():
                    if self._begun.is_set():
                        self._hand_over(received)
                    self.adjustments.act(self.source)
                    if self._stopped.is_set():
                        return
                if self._stopped.is_set():
                    return
                if self._again is None:
                    self._put(Ended())
                    return
                why = "The source ended."
            except Exception as error:  # a camera may come back after any error of its driver
                if self._stopped.is_set():
                    return
                if self._again is None:
                    raise
                why = told(error) if isinstance(error, FingervisionError) else f"The source failed ({told(error)})."
            self._put(Happening("interrupted", f"{why} The live view waits until the source is back."))
            if not self._reopened():
                return
            self._timeline.cut()
            self._put(Happening("resumed", "The source is back; the data lack the frames of the interruption."))

    def _reopened(self) -> bool:
        assert self._again is not None  # noqa: S101 - only called where it can be opened again
        size_px = (self.source.description.width_px, self.source.description.height_px)
        said = ""
        while not self._stopped.wait(AGAIN_AFTER_S):
            try:
                source = self._again()
            except FingervisionError:
                continue
            found = (source.description.width_px, source.description.height_px)
            if found == size_px:
                before, self.source = self.source.description.camera, source
                for words in self.adjustments.begin(source):
                    self._put(Happening("camera", words))
                if source.description.camera != before:
                    notes = "".join(f" {note}" for note in source.description.notes[-1:])
                    self._put(Happening("camera", f"The camera has come back with other settings.{notes}"))
                return True
            source.close()
            words = (
                f"The source came back with {found[0]}x{found[1]} pixels, but had {size_px[0]}x{size_px[1]}: "
                "set the camera as before, or start the live view again."
            )
            if words != said:
                said = words
                self._put(Happening("changed", words))
        return False

    def _hand_over(self, received: Received) -> None:
        item = received.item
        if item.time_s is not None:
            time_s, jump_s = self._timeline.at(item.time_s, received.arrived_s)
            if jump_s:
                self._put(
                    Happening(
                        "time_jumped",
                        f"The source's clock jumped by {jump_s:+.3f} s; the computer's clock bridges the jump.",
                    )
                )
        else:
            time_s = None
        item = replace(item, index=self._index, time_s=time_s)
        self._index += 1
        packets = tuple(
            replace(own, time_s=self._timeline.on_this(own.time_s), decode_s=self._timeline.on_this(own.decode_s))
            for own in received.packets
        )
        self._put(Arrival(item, received.arrived_s, packets, received.driven))

    def _put(self, what: Arrival | Happening | Ended) -> None:
        try:
            self.waiting.put(what, timeout=0.0 if isinstance(what, Arrival) else 5.0)
        except Full:
            self.overflowed += 1


# Report of frames that were lost because they arrived faster than they could be measured.


SAID_EVERY_S = 10.0


class OverflowReport:
    """Reports, at intervals, the number of frames lost since the last report.

    Parameters
    ----------
    capture : Capture
        Capture that counts the lost frames.
    tell : callable
        Function that reports an event by a name and a sentence.
    """

    def __init__(self, capture: Capture, tell: Callable[[str, str], None]) -> None:
        self._capture, self._tell = capture, tell
        self._told, self._told_at_s = 0, float("-inf")

    def say(self) -> None:
        """Report lost frames, if frames were lost and the last report is long enough ago."""
        lost, now_s = self._capture.overflowed, monotonic()
        if lost > self._told and now_s - self._told_at_s >= SAID_EVERY_S:
            self._told_at_s = now_s
            more, self._told = lost - self._told, lost
            self._tell(
                "overflowed", f"{more} frames are lost, because they arrived faster than they could be measured."
            )


# Changes of a camera's settings during operation, passed to the thread that reads the camera.


ANSWERED_WITHIN_S = 3.0
"""Longest wait until the camera has applied a change (s); some cameras restart when their frame rate is changed."""


@dataclass(slots=True, eq=False)
class _Wanted:
    name: str
    value: float
    done: Event = field(default_factory=Event)
    is_void: bool = False
    found: tuple[CameraControl, CameraControl] | None = None
    failure: FingervisionError | None = None


class Adjustments:
    """Changes of camera settings that any thread may request and the reading thread applies between two frames."""

    def __init__(self) -> None:
        self.controls: tuple[CameraControl, ...] = ()
        """Settings that can be changed, with the values that were read last."""
        self._chosen: dict[str, float] = {}
        self._wanted: SimpleQueue[_Wanted] = SimpleQueue()
        self._lock = Lock()

    def ask(self, name: str, value: float) -> tuple[CameraControl, CameraControl]:
        """Request a new value of a setting and wait until the camera has it; return the control before and after.

        Raises
        ------
        DeviceError
            The camera refuses the value, or sends no more frames.
        StateError
            The source has no settings that can be changed.
        UsageError
            The source has no setting of this name, or the setting does not accept the value.
        """
        if not self.controls:
            raise StateError("This source has no settings that can be changed while it runs.")
        wanted = _Wanted(name, value)
        self._wanted.put(wanted)
        if not wanted.done.wait(ANSWERED_WITHIN_S):
            with self._lock:
                if not wanted.done.is_set():
                    wanted.is_void = True
                    raise DeviceError(
                        f"The camera does not answer, so that its {name} was not changed: is the camera plugged in?"
                    )
        if wanted.failure is not None:
            raise wanted.failure
        assert wanted.found is not None  # noqa: S101 - what is done has a result or a failure
        return wanted.found

    def begin(self, source: object) -> list[str]:
        """Begin to use a newly (or again) opened source, and apply the settings that were chosen before.

        Returns
        -------
        list of str
            One sentence for each value that the source does not accept again.
        """
        said = []
        self.controls = controls_of(source)
        now = {each.name: each.value for each in self.controls}
        for name, value in self._chosen.items():
            if now.get(name) == value:
                continue
            try:
                adjust(source, name, value)
            except FingervisionError as error:
                said.append(str(error))
        if self._chosen:
            self.controls = controls_of(source)
        return said

    def act(self, source: object) -> None:
        """Apply the requested changes; the thread that reads the source calls this between two frames."""
        while True:
            try:
                wanted = self._wanted.get_nowait()
            except Empty:
                return
            with self._lock:
                if wanted.is_void:
                    continue
                try:
                    wanted.found = adjust(source, wanted.name, wanted.value)
                    self._chosen[wanted.name] = wanted.found[1].value
                except FingervisionError as error:
                    wanted.failure = error
                self.controls = controls_of(source)
                wanted.done.set()
