"""Any live source of frames as the test bed's camera: a camera of this machine, or a network stream."""

from collections import deque
from dataclasses import replace
from threading import Condition, Thread
from typing import cast

from fingervision.domain.errors import DeviceError, FingervisionError
from fingervision.frames.source import LiveSource, Received, Wish
from fingervision.frames.source_kinds import open_source
from fingervision.storage.toml_section import Section
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.camera import Latency, Taken

KEYS = ("source", "rate_hz", "width_px", "height_px", "patience_s", "latency_s", "u_latency_s")
SIMULATED = False
# The motor is stopped if the camera sends no frame for this time.
PATIENCE_S = 1.0
# The smallest latency of a webcam is unknown unless it was measured: assume one frame time, with a standard uncertainty
# of the same size.
LATENCY_S, U_LATENCY_S = 0.04, 0.04
# Largest number of waiting frames; older frames are dropped, because the test bed needs the present state.
FRAMES_WAITING = 8


class SourceCamera:
    """Reads a source in a separate thread, and delivers frames on request.

    Parameters
    ----------
    source : LiveSource
        The open source.
    latency : Latency
        Latency from exposure to arrival, as far as it is known.
    patience_s : float
        Time without a frame after which the camera counts as failed.
    """

    def __init__(self, source: LiveSource, latency: Latency, patience_s: float) -> None:
        self.latency = latency
        self._source, self._patience_s = source, patience_s
        self._waiting: deque[Received] = deque(maxlen=FRAMES_WAITING)
        self._changed = Condition()
        self._ended = ""
        self._index = 0
        self.description = source.description
        Thread(target=self._read, name="bed camera", daemon=True).start()

    def next(self) -> Taken:
        """Wait for the next frame of the source and return it."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._ended, self._patience_s)
            if not self._waiting:
                why = self._ended or f"it sent no frame for {self._patience_s:g} s"
                raise DeviceError(
                    f"The camera {self.description.name} must send frames while the test bed works, but {why}: the "
                    "motor was stopped; check the camera's cable."
                )
            received = self._waiting.popleft()
        index, self._index = self._index, self._index + 1
        own_s = received.item.time_s if self._source.has_own_clock else None
        device_s = received.arrived_s if own_s is None else own_s
        item = replace(received.item, index=index, time_s=device_s)
        return Taken(index, device_s, received.arrived_s, lambda: item)

    def ready(self, within_s: float) -> bool:
        """Wait for the next frame, but no longer than a time; return whether `next` need not wait for it."""
        with self._changed:
            return bool(self._changed.wait_for(lambda: self._waiting or self._ended, within_s))

    def close(self) -> None:
        """Release the source."""
        self._source.close()

    def _read(self) -> None:
        ended = "it ended"
        try:
            for received in self._source.received():
                with self._changed:
                    self._waiting.append(received)
                    self._changed.notify()
        except FingervisionError as error:
            ended = f"it was disconnected ({error})"
        with self._changed:
            self._ended = ended
            self._changed.notify()


def stated_timing(section: Section) -> tuple[Latency, float, float | None]:
    """Read the latency, the patience (s) and the frame rate (Hz) of a live camera."""
    latency = Latency(
        section.number("latency_s", LATENCY_S, low=0.0), section.number("u_latency_s", U_LATENCY_S, low=0.0)
    )
    rate_hz = section.number("rate_hz", above=0.0) if "rate_hz" in section.values else None
    return latency, section.number("patience_s", PATIENCE_S, above=0.0), rate_hz


def build(section: Section, context: BuildContext) -> SourceCamera:
    """Open the source of frames that a section of the configuration states."""
    name = section.word("source")
    size = None
    if "width_px" in section.values or "height_px" in section.values:
        size = section.whole("width_px", low=16, high=16384), section.whole("height_px", low=16, high=16384)
    latency, patience_s, rate_hz = stated_timing(section)
    source = open_source(name, Wish(rate_hz=rate_hz, size_px=size))
    if not hasattr(source, "received"):
        section.refuse("source", f"must be a camera or a stream, but {name} is a recording: name a live source.")
    return SourceCamera(cast("LiveSource", source), latency, patience_s)
