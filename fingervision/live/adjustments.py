"""Changes of a camera's settings during operation, passed to the thread that reads the camera."""

from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from threading import Event, Lock

from fingervision.domain.errors import DeviceError, FingervisionError, StateError
from fingervision.frames.controls import CameraControl, adjust, controls_of

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
