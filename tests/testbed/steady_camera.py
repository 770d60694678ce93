"""A live camera that sends the same picture at its rate, however busy the computer is."""

from collections.abc import Iterator
from dataclasses import replace
from time import monotonic, sleep
from typing import Any

from fingervision.frames.simulated import SimulatedGripper
from fingervision.frames.source import Received
from fingervision.testbed.camera import Latency
from fingervision.testbed.cameras.source import SourceCamera

KEYS = ()
SIMULATED = False
RATE_HZ = 25.0


class Steady(SimulatedGripper):
    """Frames whose stamps are those of their exposure; what is not fetched in time is lost."""

    def received(self) -> Iterator[Received]:
        """Yield frames until the camera is closed."""
        first, began_s, number = next(super().received()), monotonic(), 0
        while not self._closed.is_set():
            number = max(number + 1, int((monotonic() - began_s) * RATE_HZ))
            sleep(max(0.0, began_s + number / RATE_HZ - monotonic()))
            yield Received(replace(first.item, index=number, time_s=number / RATE_HZ), monotonic())


def build(section: Any, context: Any) -> SourceCamera:
    """Start the camera."""
    return SourceCamera(Steady((640, 480), RATE_HZ), Latency(0.0, 0.001), 60.0)
