"""GenICam cameras (GigE Vision, USB3 Vision, CoaXPress) through the maker's GenTL producer (extra `genicam`).

A camera's name is `genicam:PRODUCER.cti`, or `genicam:PRODUCER.cti#SERIAL` if there are several cameras. The producer
is the driver file that the camera's maker installs (GenICam GenTL Standard, EMVA, 2019); `harvesters` loads it. The
adapter is tested with Viky, the simulated camera that comes with the GenICam reference implementation, and not with
hardware.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import count
from pathlib import Path
from threading import Event
from time import monotonic
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DeviceError, InputFileError, error_words
from fingervision.domain.frame import Coding, Frame, LostFrame, Pixels
from fingervision.domain.needed_library import needed_library
from fingervision.domain.status import Status
from fingervision.frames.controls import EXPOSURE, FRAME_RATE, GAIN, CameraControl
from fingervision.frames.source import Description, Endable, Received, Wish

# Features of a GenICam camera: requested at the start, stated by the camera, or changeable while the camera runs.
#
# The names of the features are those of the Standard Features Naming Convention (EMVA). Each GenTL producer has
# exception classes of its own, so that every exception is caught.

MONO = ("Mono8", "Mono10", "Mono12", "Mono14", "Mono16")
"""Pixel formats in which each grey level occupies one or two whole bytes, by their names in the EMVA's Pixel Format
Naming Convention.
"""
NODES = {"exposure_ms": ("ExposureTime", 1e3), "gain": ("Gain", 1.0)}
"""Features of the Standard Features Naming Convention by the options of this program, with factors that convert the
option's unit to the feature's.
"""
CONTROLS = {
    EXPOSURE: (*NODES["exposure_ms"], "ms"),
    GAIN: (*NODES["gain"], "dB"),
    FRAME_RATE: ("AcquisitionFrameRate", 1.0, "Hz"),
}
"""Settings that can be changed while the camera runs: feature, number of its units in one of ours, and our unit."""


def control_list(nodes: Any) -> tuple[CameraControl, ...]:
    """Settings that a camera's features allow to be changed; a feature that is locked now states no value or no limit.

    Parameters
    ----------
    nodes : GenApi's map of nodes
        Map of the camera's features.
    """
    found = []
    for name, (node, factor, unit) in CONTROLS.items():
        value = feature_value(nodes, node)
        if value is None:
            continue
        least, greatest = (_limit(nodes, node, end) for end in ("min", "max"))
        found.append(
            CameraControl(
                name,
                float(value) / factor,
                unit,
                None if least is None else least / factor,
                None if greatest is None else greatest / factor,
            )
        )
    return tuple(found)


def _limit(nodes: Any, node: str, end: str) -> float | None:
    try:
        return float(getattr(getattr(nodes, node), end))
    except Exception:  # the camera does not state the limit at present
        return None


def request_settings(nodes: Any, wish: Wish) -> tuple[str, ...]:
    """Request settings and a grey format from a camera; return a sentence for each refused setting."""
    asked: dict[str, Any] = {}
    if feature_value(nodes, "PixelFormat") not in MONO:
        asked["PixelFormat"] = next((each for each in MONO if each in _choices(nodes, "PixelFormat")), None)
    if wish.size_px is not None:
        asked["Width"], asked["Height"] = wish.size_px
    if wish.rate_hz is not None:
        asked["AcquisitionFrameRateEnable"], asked["AcquisitionFrameRate"] = True, float(wish.rate_hz)
    for name, (node, factor) in NODES.items():
        value = getattr(wish.camera, name)
        if value is not None:
            asked[node] = factor * value
    notes = []
    for node, value in asked.items():
        try:
            if value is not None:
                getattr(nodes, node).value = value
        except Exception as error:  # missing or locked feature, or value out of range
            if node != "AcquisitionFrameRateEnable":  # many cameras do not have this feature and do not need it
                notes.append(f"The camera refused the requested setting {node} = {value} ({error_words(error)}).")
            continue
    return tuple(notes)


def read_settings(nodes: Any) -> Mapping[str, str]:
    """Return the settings that the camera states, each with its unit."""
    units = {"AcquisitionFrameRate": "Hz", "ExposureTime": "us", "Gain": "dB", "PixelFormat": ""}
    found = {node: feature_value(nodes, node) for node in units}
    return {node: f"{value} {units[node]}".strip() for node, value in found.items() if value is not None}


def feature_value(nodes: Any, node: str) -> Any:
    """Return the value of a feature; None if the camera has no such feature, or does not state it now."""
    try:
        return getattr(nodes, node).value
    except Exception:
        return None


def _choices(nodes: Any, node: str) -> tuple[str, ...]:
    try:
        return tuple(getattr(nodes, node).symbolics)
    except Exception:
        return ()


START = "genicam:"
SILENT_S, ASKED_EVERY_S = 2.0, 0.2
"""Time without data after which a camera counts as disconnected, and interval of the checks whether the source was
closed."""


def accepts(name: str) -> bool:
    """Whether a name is that of a GenICam camera."""
    return name.startswith(START)


def open_frames(name: str, wish: Wish) -> "GenicamFrames":
    """Open a camera.

    Raises
    ------
    MissingLibraryError
        If harvesters is not installed.
    InputFileError
        If the producer's file does not exist.
    DeviceError
        The camera does not exist, is in use by another program, or delivers no grey levels.
    """
    return GenicamFrames(name, wish)


class GenicamFrames(Endable):
    """An open GenICam camera.

    Time stamps are the camera's own if it sends them, else those of the computer's clock on arrival.

    Parameters
    ----------
    name : str
        Name of the camera, in the form described in the module.
    wish : Wish
        Requested size, frame rate, exposure (ms) and gain.
    """

    def __init__(self, name: str, wish: Wish) -> None:
        self.name = name
        self._closed = Event()
        self._harvester, self._camera = _connected(name)
        nodes = self._camera.remote_device.node_map
        notes = request_settings(nodes, wish)
        self._format = feature_value(nodes, "PixelFormat")
        if self._format not in MONO:
            self._release()
            raise DeviceError(
                f"The camera {name} must give grey levels ({', '.join(MONO)}), but offers only {self._format}: choose "
                "another camera."
            )
        try:
            self._camera.start()
            first = self._camera.fetch(timeout=SILENT_S)
        except Exception as error:  # a producer has its own exception classes
            self._release()
            raise DeviceError(f"The camera {name} is open but gives no picture ({error_words(error)}).") from error
        self.has_own_clock = _own_time_s(first) is not None
        picture = first.payload.components[0]
        rate_hz = feature_value(nodes, "AcquisitionFrameRate")
        self.description = Description(
            name=name,
            kind="camera (GenICam)",
            codec=self._format,
            coding=Coding.LOSSLESS,
            width_px=int(picture.width),
            height_px=int(picture.height),
            rate_hz=float(rate_hz) if rate_hz else None,
            has_times=True,
            frame_count=None,
            notes=notes,
            camera=read_settings(nodes),
        )
        first.queue()

    def received(self) -> Iterator[Received]:
        """Yield the frames as they arrive, until the camera is closed or unplugged.

        Raises
        ------
        DeviceError
            The camera has stopped sending pictures.
        """
        try:
            for index in count():
                buffer = self._next()
                if buffer is None:
                    return
                arrived_s = monotonic()
                try:
                    item = self._item(buffer, index, arrived_s)
                finally:
                    buffer.queue()
                yield Received(item, arrived_s)
        finally:
            self._release()

    def controls(self) -> tuple[CameraControl, ...]:
        """Settings that may be changed while the camera runs, with their values and limits."""
        return control_list(self._camera.remote_device.node_map)

    def set_control(self, name: str, value: float) -> None:
        """Request another value of one of the camera's settings.

        Parameters
        ----------
        name : str
            Name of the setting.
        value : float
            Requested value, in the setting's unit.
        """
        nodes = self._camera.remote_device.node_map
        node, factor, _ = CONTROLS[name]
        getattr(nodes, node).value = factor * value
        self.description = replace(self.description, camera=read_settings(nodes))

    def _next(self) -> Any:
        """Return the next picture buffer; None once the source is closed."""
        silent_since_s = monotonic()
        while not self._closed.is_set():
            try:
                buffer = self._camera.try_fetch(timeout=ASKED_EVERY_S)
            except Exception as error:
                raise DeviceError(f"The camera {self.name} can no longer be read ({error_words(error)}).") from error
            if buffer is not None:
                return buffer
            if monotonic() - silent_since_s > SILENT_S:
                raise DeviceError(f"The camera {self.name} has stopped sending pictures: is it plugged in?")
        return None

    def _item(self, buffer: Any, index: int, arrived_s: float) -> Frame | LostFrame:
        own_s = _own_time_s(buffer) if self.has_own_clock else None
        time_s = own_s if self.has_own_clock else arrived_s
        parts = buffer.payload.components
        size = self.description.height_px, self.description.width_px
        if not parts or not buffer.module.is_complete or parts[0].data.size != size[0] * size[1]:
            words = "The frame arrived without some of its packets: check the network and its packet size."
            return LostFrame(index, time_s, Status.DAMAGED, words)
        return Frame(levels(parts[0].data, size), index, time_s, Coding.LOSSLESS)

    def _release(self) -> None:
        for act in (self._camera.stop, self._camera.destroy, self._harvester.reset):
            try:
                act()
            except Exception:
                continue


def levels(data: NDArray[np.generic], size: tuple[int, int]) -> Pixels:
    """Copy the grey levels out of a buffer, which the producer will reuse; shape (height, width)."""
    pixels: Pixels = np.array(data).reshape(size)
    return pixels


def _connected(name: str) -> tuple[Any, Any]:
    """Open the producer and the camera."""
    harvesters = needed_library("harvesters.core", "genicam", f"The camera {name}")
    file, _, serial = name.removeprefix(START).partition("#")
    if not Path(file).is_file():
        raise InputFileError(
            f"There is no GenTL producer {file}: name the .cti file that the camera's maker installs, as in "
            f"{START}/opt/maker/lib/producer.cti."
        )
    harvester = harvesters.Harvester()
    try:
        harvester.add_file(str(Path(file).resolve()))
        harvester.update()
        found = [str(each.serial_number) for each in harvester.device_info_list]
    except Exception as error:
        harvester.reset()
        raise DeviceError(
            f"{file} must be a GenTL producer, but cannot be used as one ({error_words(error)})."
        ) from error
    if not found or (serial and serial not in found):
        harvester.reset()
        which = f"with the serial number {serial} " if serial else ""
        there = f"those found: {', '.join(found)}" if found else "none was found"
        raise DeviceError(f"{file} must list a camera {which}but does not ({there}): is it plugged in?")
    try:
        return harvester, harvester.create({"serial_number": serial} if serial else 0)
    except Exception as error:
        harvester.reset()
        raise DeviceError(
            f"The camera {name} cannot be opened ({error_words(error)}): close the other program that uses it."
        ) from error


def _own_time_s(buffer: Any) -> float | None:
    """Time of the exposure (s) by the camera's own clock; None if the camera does not state it."""
    try:
        return 1e-9 * float(buffer.timestamp_ns)
    except Exception:
        return None
