"""Cameras of this machine through OpenCV (V4L2, Media Foundation, AVFoundation), with settings read back."""

import os
import struct
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from threading import Event
from time import monotonic
from typing import Any

import cv2

from fingervision.domain.errors import DeviceError
from fingervision.domain.frame import Frame, LostFrame, Pixels
from fingervision.domain.status import Status
from fingervision.frames.camera_settings import (
    EXPOSURE,
    FOCUS,
    GAIN,
    MSMF,
    READ,
    V4L2,
    WHITE_BALANCE,
    Control,
    coding_of,
    is_there,
    of_camera,
    of_user,
    requests,
    settled,
)
from fingervision.frames.controls import FRAME_RATE, CameraControl
from fingervision.frames.source import Description, Endable, Received, Wish

# Limits of a V4L2 camera's settings, as stated by the driver (Linux).
#
# Source: `struct v4l2_queryctrl` and `VIDIOC_QUERYCTRL` in linux/videodev2.h; numbers of the controls in
# linux/v4l2-controls.h.

QUERY = 0xC0445624  # _IOWR('V', 36, 68 bytes)
LAYOUT = struct.Struct("II32siiiiI8x")
DISABLED = 0x0001
NUMBERS: Mapping[int, int] = {
    cv2.CAP_PROP_EXPOSURE: 0x009A0902,
    cv2.CAP_PROP_GAIN: 0x00980913,
    cv2.CAP_PROP_FOCUS: 0x009A090A,
    cv2.CAP_PROP_TEMPERATURE: 0x0098091A,
}
"""Numbers of V4L2's controls, by OpenCV's properties."""

Ioctl = Callable[[int, int, bytes], Any]


def ranges(name: str, ioctl: Ioctl | None = None) -> dict[int, tuple[int, int]]:
    """Smallest and largest value of each setting of a camera, in the driver's units, by OpenCV's property.

    Parameters
    ----------
    name : str
        Number or device file of the camera.
    ioctl : callable, optional
        Function to use in place of the system's `ioctl`.

    Returns
    -------
    dict of int to (int, int)
        Limits by OpenCV's property; empty if the driver does not state them.
    """
    if ioctl is None:
        if sys.platform != "linux":
            return {}
        import fcntl

        ioctl = fcntl.ioctl
    path = Path(f"/dev/video{name}" if name.isdigit() else name)
    try:
        device = os.open(path, os.O_RDWR | os.O_NONBLOCK)
    except OSError:
        return {}
    found = {}
    try:
        for what, number in NUMBERS.items():
            try:
                answer = ioctl(device, QUERY, LAYOUT.pack(number, 0, b"", 0, 0, 0, 0, 0))
            except OSError:
                continue  # the camera does not have this setting
            _, _, _, least, greatest, _, _, flags = LAYOUT.unpack(answer)
            if not flags & DISABLED and least < greatest:
                found[what] = (least, greatest)
    finally:
        os.close(device)
    return found


# Settings of this computer's cameras that can be changed while a camera runs, in the user's units and in OpenCV's.

WHILE_RUNNING = (EXPOSURE, GAIN, FOCUS, WHITE_BALANCE)


def control_list(
    backend: str, read: Mapping[int, float], ranges: Mapping[int, tuple[int, int]]
) -> tuple[CameraControl, ...]:
    """List the settings of a camera that can be changed while it runs.

    Parameters
    ----------
    backend : str
        OpenCV's name of the backend; AVFoundation has no such settings.
    read : mapping of int to float
        Values that the camera reports, by OpenCV's property.
    ranges : mapping of int to (int, int)
        Smallest and largest value by property, in the camera's units, as far as known.
    """
    return tuple(_controls(backend, read, ranges)) if backend in (V4L2, MSMF) else ()


def _controls(
    backend: str, read: Mapping[int, float], ranges: Mapping[int, tuple[int, int]]
) -> Iterator[CameraControl]:
    for control in WHILE_RUNNING:
        if is_there(read, control.what):
            limits = [of_user(backend, control, float(each)) for each in ranges.get(control.what, ())]
            least, greatest = limits or (None, None)
            yield CameraControl(
                control.name, of_user(backend, control, read[control.what]), control.unit, least, greatest
            )
    rate_hz = read.get(cv2.CAP_PROP_FPS, 0.0)
    if rate_hz > 0.0:
        yield CameraControl(FRAME_RATE, rate_hz, "Hz")


def request_of(backend: str, name: str, value: float) -> tuple[int, float]:
    """OpenCV's property and value for a setting of `control_list`.

    Parameters
    ----------
    backend : str
        OpenCV's name of the backend.
    name : str
        Name of the setting.
    value : float
        Requested value, in the user's unit.
    """
    if name == FRAME_RATE:
        return cv2.CAP_PROP_FPS, value
    control: Control = next(each for each in WHILE_RUNNING if each.name == name)
    return control.what, of_camera(backend, control, value)


BACKENDS = {"linux": cv2.CAP_V4L2, "win32": cv2.CAP_MSMF, "darwin": cv2.CAP_AVFOUNDATION}
DEVICES = Path("/sys/class/video4linux")
# Number of camera numbers that are tried on systems other than Linux, which have no list of cameras.
NUMBERS_TRIED = 6
# Number of failed reads after which the camera is regarded as disconnected.
FAILED_READS = 3


def accepts(name: str) -> bool:
    """Whether a name is the number or the device of a camera."""
    return (name.isdigit() and not Path(name).exists()) or name.startswith("/dev/video")


def open_frames(name: str, wish: Wish) -> "CameraFrames":
    """Open a camera.

    Raises
    ------
    DeviceError
        The camera does not exist, is in use by another program, or delivers no picture.
    """
    return CameraFrames(name, wish)


def found_cameras() -> list[tuple[str, str]]:
    """List the cameras of this machine, each with its name as a source and its product name."""
    if sys.platform == "linux":
        devices = sorted(DEVICES.glob("video*"), key=lambda path: int(path.name.removeprefix("video")))
        return [(f"/dev/{device.name}", _first_line(device / "name")) for device in devices]
    found = []
    for number in range(NUMBERS_TRIED):
        with _quiet():
            capture = cv2.VideoCapture(number, BACKENDS.get(sys.platform, cv2.CAP_ANY))
        if capture.isOpened():
            found.append((str(number), f"camera {number}"))
        capture.release()
    return found


class CameraFrames(Endable):
    """An open camera.

    Grey levels are the camera's luma. Time stamps are the driver's, where it gives any (V4L2: the beginning of the
    exposure or of the transfer, by the computer's monotonic clock); else they are the times of arrival.

    Parameters
    ----------
    name : str
        Number or device of the camera.
    wish : Wish
        Requested settings of the camera.
    """

    def __init__(self, name: str, wish: Wish) -> None:
        self.name = name
        _check_device(name)
        with _quiet():
            self._capture = cv2.VideoCapture(
                int(name) if name.isdigit() else name, BACKENDS.get(sys.platform, cv2.CAP_ANY)
            )
        if not self._capture.isOpened():
            raise DeviceError(
                f"The camera {name} cannot be opened: another program uses it, or it is not a camera; close the other "
                "program, or see `fingervision live --list`."
            )
        self._ask(wish)
        read, pixels = self._capture.read()
        if not read or pixels is None:
            self._capture.release()
            raise DeviceError(
                f"The camera {name} is open but gives no picture: another program may use it, or it does not offer "
                "the requested format, size and rate; leave out --format, --size and --rate-hz."
            )
        first_s = self._stamp_s()
        self._capture.read()
        self.has_own_clock = 0.0 < first_s < self._stamp_s()
        self._closed = Event()
        self._ranges = ranges(name) if self._capture.getBackendName() == V4L2 else {}
        self.description = self._described(wish, (pixels.shape[1], pixels.shape[0]))

    def received(self) -> Iterator[Received]:
        """Yield the frames as they arrive, until the camera is closed or unplugged."""
        failed, last_s = 0, 0.0
        try:
            for index in count():
                read, pixels = self._capture.read()
                if self._closed.is_set():
                    return
                if not read or pixels is None:
                    failed += 1
                    if failed >= FAILED_READS:
                        raise DeviceError(f"The camera {self.name} has stopped sending pictures: is it plugged in?")
                    continue
                failed = 0
                arrived_s = monotonic()
                time_s = self._stamp_s() if self.has_own_clock else arrived_s
                item: Frame | LostFrame = Frame(_luma(pixels), index, time_s, self.description.coding)
                if time_s == last_s:
                    words = "The frame has the same time as the previous frame."
                    item = LostFrame(index, time_s, Status.DUPLICATE, words)
                last_s = time_s
                yield Received(item, arrived_s)
        finally:
            self._capture.release()

    def controls(self) -> tuple[CameraControl, ...]:
        """Settings that may be changed while the camera runs, with their values and limits."""
        with _quiet():
            return control_list(self._capture.getBackendName(), self._read(), self._ranges)

    def set_control(self, name: str, value: float) -> None:
        """Request another value of one of the camera's settings.

        Parameters
        ----------
        name : str
            Name of the setting.
        value : float
            Requested value, in the setting's unit.
        """
        with _quiet():
            self._capture.set(*request_of(self._capture.getBackendName(), name, value))
        self.description = self._described(Wish(), (self.description.width_px, self.description.height_px))

    def _stamp_s(self) -> float:
        """The driver's time of the picture that was read last; 0 or less if it gives none."""
        return 1e-3 * self._capture.get(cv2.CAP_PROP_POS_MSEC)

    def _ask(self, wish: Wish) -> None:
        """Request the given settings, and no automatic changes; a camera accepts only some of them."""
        with _quiet():
            for what, value in requests(self._capture.getBackendName(), wish, self._read()):
                self._capture.set(what, value)

    def _read(self) -> dict[int, float]:
        return {what: self._capture.get(what) for what in READ}

    def _described(self, wish: Wish, size_px: tuple[int, int]) -> Description:
        """Describe the camera with its actual settings, with a sentence for each that differs from the request."""
        backend = self._capture.getBackendName()
        with _quiet():
            read = self._read()
        found = settled(backend, wish, read)
        notes = found.notes
        if wish.size_px is not None and wish.size_px != size_px:
            asked, given = (f"{width_px}x{height_px}" for width_px, height_px in (wish.size_px, size_px))
            notes = (f"Pictures of {asked} pixels were requested from the camera, but it gives {given}.", *notes)
        rate_hz = read[cv2.CAP_PROP_FPS]
        return Description(
            name=self.name,
            kind=f"camera ({backend})",
            codec=found.settings["format"],
            coding=coding_of(found.settings),
            width_px=size_px[0],
            height_px=size_px[1],
            rate_hz=rate_hz if rate_hz > 0.0 else None,
            has_times=True,
            frame_count=None,
            notes=notes,
            camera=found.settings,
        )


def _check_device(name: str) -> None:
    if sys.platform != "linux":
        return
    device = Path(f"/dev/video{name}" if name.isdigit() else name)
    if not device.exists():
        found = ", ".join(source for source, _ in found_cameras()) or "none"
        raise DeviceError(
            f"There is no camera {name} ({device} does not exist; cameras found: {found}): plug it in, or try the "
            "source `simulated`."
        )


def _luma(pixels: Any) -> Pixels:
    """Grey levels of an OpenCV picture (blue, green, red), or of a raw YUYV picture."""
    if pixels.ndim == 2:
        levels: Pixels = pixels
        return levels
    if pixels.shape[2] == 2:
        luma: Pixels = pixels[:, :, 0].copy()
        return luma
    # Weights of ITU-R BT.601, which `measure` uses too.
    grey: Pixels = cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY)
    return grey


def _first_line(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8").strip()
    except OSError:
        return "camera"


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress OpenCV's own messages about missing cameras in the `with` block."""
    before = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        cv2.utils.logging.setLogLevel(before)
