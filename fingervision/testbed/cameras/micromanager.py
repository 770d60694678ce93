"""A camera with a device adapter of Micro-Manager; `folder`, `configuration` and `device` as for a stage.

The times of the frames are those at which Micro-Manager's core received them (`ElapsedTime-ms`), or those of another
number among the frame's tags, such as the camera's own stamp: `stamp`, and `stamp_s`, its unit in seconds.
"""

from collections.abc import Iterator
from itertools import count
from time import monotonic, sleep
from typing import Any

import numpy as np

from fingervision.domain.errors import DeviceError
from fingervision.domain.frame import Coding, Frame
from fingervision.frames.source import Description, Received
from fingervision.storage.toml_section import Section
from fingervision.testbed import micromanager_core
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.cameras import source
from fingervision.testbed.cameras.source import SourceCamera
from fingervision.testbed.micromanager_core import Core, core_of

LIVE = tuple(key for key in source.KEYS if key not in ("source", "width_px", "height_px"))
KEYS = (*micromanager_core.KEYS, "stamp", "stamp_s", "exposure_s", *LIVE)
SIMULATED = False
LOOK_EVERY_S = 0.001


class CoreSource:
    """The frames of a camera, continuously.

    Parameters
    ----------
    shared : Core
        The core.
    device : str
        Label of the camera.
    stamp : (str, float)
        Tag of the frame's time, and its unit in seconds.
    rate_hz : float or None
        Frame rate as stated in the configuration.
    """

    has_own_clock = True
    template = None

    def __init__(self, shared: Core, device: str, stamp: tuple[str, float], rate_hz: float | None) -> None:
        self._shared, self._device, self._stamp = shared, device, stamp
        self._closed = False
        core = shared.core
        core.setCameraDevice(device)
        core.startContinuousSequenceAcquisition(0.0)
        self.description = Description(
            name=device, kind="camera (Micro-Manager)", codec=f"{core.getImageBitDepth()} bit", coding=Coding.LOSSLESS,
            width_px=core.getImageWidth(), height_px=core.getImageHeight(), rate_hz=rate_hz, has_times=True,
            frame_count=None,
        )  # fmt: skip

    def received(self) -> Iterator[Received]:
        """Yield the frames as they arrive, until the camera is closed.

        Raises
        ------
        DeviceError
            The camera has stopped, or its frames have no such stamp.
        """
        import pymmcore

        core, (name, unit_s) = self._shared.core, self._stamp
        for index in count():
            while not self._closed and core.getRemainingImageCount() == 0:
                if not core.isSequenceRunning():
                    raise DeviceError(f"The camera {self._device} must send frames, but has stopped: is it connected?")
                sleep(LOOK_EVERY_S)
            if self._closed:
                return
            tags = pymmcore.Metadata()
            pixels: Any = core.popNextImageMD(tags)
            arrived_s = monotonic()
            if name not in tags.GetKeys():
                known = ", ".join(tags.GetKeys())
                raise DeviceError(f"The frames of {self._device} must have the tag {name}, but have only {known}.")
            if pixels.dtype == np.uint32:  # blue, green, red and an unused byte
                pixels = pixels.view(np.uint8).reshape(*pixels.shape, 4)[:, :, 2::-1]
            time_s = float(tags.GetSingleTag(name).GetValue()) * unit_s
            yield Received(Frame(np.array(pixels), index, time_s, Coding.LOSSLESS), arrived_s)

    def close(self) -> None:
        """Stop the camera."""
        if not self._closed:
            self._closed = True
            self._shared.core.stopSequenceAcquisition(self._device)
            self._shared.release()


def build(section: Section, context: BuildContext) -> SourceCamera:
    """Load the configuration, and start the camera."""
    latency, patience_s, rate_hz = source.stated_timing(section)
    stamp = section.word("stamp", "ElapsedTime-ms"), section.number("stamp_s", 0.001, above=0.0)
    shared = core_of(section, context)
    if "exposure_s" in section.values:
        shared.core.setExposure(section.word("device"), 1e3 * section.number("exposure_s", above=0.0))
    return SourceCamera(CoreSource(shared, section.word("device"), stamp, rate_hz), latency, patience_s)
