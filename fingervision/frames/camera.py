"""Cameras of this machine through OpenCV: V4L2, Media Foundation, AVFoundation; what was asked is read back."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from threading import Event
from time import monotonic
from typing import Any

import av
import cv2

from fingervision.domain.errors import FingervisionError
from fingervision.domain.frame import Coding, Frame, LostFrame, Pixels
from fingervision.frames.received import Received
from fingervision.frames.source import Description, Wish

BACKENDS = {"linux": cv2.CAP_V4L2, "win32": cv2.CAP_MSMF, "darwin": cv2.CAP_AVFOUNDATION}
DEVICES = Path("/sys/class/video4linux")
# Off Linux cameras have no list; so many numbers are tried.
NUMBERS_TRIED = 6
# So many reads may fail before the camera counts as gone.
FAILED_READS = 3
# These would change scale, light or time between frames: they are asked to be off, and read back.
AUTOMATICS = (
    ("auto-focus", cv2.CAP_PROP_AUTOFOCUS, 0.0),
    ("automatic white balance", cv2.CAP_PROP_AUTO_WB, 0.0),
    # V4L2's exposure menu: 1 is manual.
    ("auto-exposure", cv2.CAP_PROP_AUTO_EXPOSURE, 1.0),
)


def accepts(name: str) -> bool:
    """Whether this is a camera's number or device."""
    return (name.isdigit() and not Path(name).exists()) or name.startswith("/dev/video")


def open_frames(name: str, wish: Wish) -> "CameraFrames":
    """Open a camera.

    Raises
    ------
    FingervisionError
        There is no such camera, somebody else has it, or it gives no picture.
    """
    return CameraFrames(name, wish)


def found_cameras() -> list[tuple[str, str]]:
    """List the cameras of this machine: what to give as a source, and the camera's own name."""
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


class CameraFrames:
    """A camera that is open.

    Grey levels are those of the camera's luma; times are the host's on arrival.

    Parameters
    ----------
    name : str
        Number or device.
    wish : Wish
        Size and rate that are asked for.
    """

    has_own_clock = False
    template: av.VideoStream | None = None

    def __init__(self, name: str, wish: Wish) -> None:
        self.name = name
        _check_device(name)
        with _quiet():
            self._capture = cv2.VideoCapture(
                int(name) if name.isdigit() else name, BACKENDS.get(sys.platform, cv2.CAP_ANY)
            )
        if not self._capture.isOpened():
            raise FingervisionError(
                f"The camera {name} cannot be opened: it is in use by another program, or no camera; close the other "
                "program, or see `fingervision live --list`."
            )
        self._ask(wish)
        read, pixels = self._capture.read()
        if not read or pixels is None:
            self._capture.release()
            raise FingervisionError(
                f"The camera {name} is open but gives no picture: another program may use it, or it does not have the "
                "size and rate asked for; leave out --size and --rate-hz."
            )
        self._closed = Event()
        height_px, width_px = pixels.shape[:2]
        rate_hz = self._capture.get(cv2.CAP_PROP_FPS)
        self.description = Description(
            name=name,
            kind=f"camera ({self._capture.getBackendName()})",
            codec=_four_letters(self._capture.get(cv2.CAP_PROP_FOURCC)),
            coding=Coding.LOSSLESS,
            width_px=width_px,
            height_px=height_px,
            rate_hz=rate_hz if rate_hz > 0.0 else None,
            has_times=True,
            frame_count=None,
            notes=self._notes(wish, (width_px, height_px), rate_hz),
        )

    def __iter__(self) -> Iterator[Frame | LostFrame]:
        """Frames as they come."""
        for received in self.received():
            yield received.item

    def received(self) -> Iterator[Received]:
        """Frames as they come, until the camera is closed or gone."""
        failed = 0
        try:
            for index in count():
                read, pixels = self._capture.read()
                if self._closed.is_set():
                    return
                if not read or pixels is None:
                    failed += 1
                    if failed >= FAILED_READS:
                        raise FingervisionError(f"The camera {self.name} gives no pictures any more: is it plugged in?")
                    continue
                failed = 0
                arrived_s = monotonic()
                yield Received(Frame(_luma(pixels), index, arrived_s, self.description.coding), arrived_s)
        finally:
            self._capture.release()

    def close(self) -> None:
        """End the iteration with the next frame."""
        self._closed.set()

    def _ask(self, wish: Wish) -> None:
        """Ask for raw pictures, size, rate and that nothing changes by itself; cameras take what they like."""
        self._capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"YUYV"))
        if wish.size_px is not None:
            self._capture.set(cv2.CAP_PROP_FRAME_WIDTH, wish.size_px[0])
            self._capture.set(cv2.CAP_PROP_FRAME_HEIGHT, wish.size_px[1])
        if wish.rate_hz is not None:
            self._capture.set(cv2.CAP_PROP_FPS, wish.rate_hz)
        self._capture.set(cv2.CAP_PROP_BUFFERSIZE, 2)
        for _, what, value in AUTOMATICS:
            self._capture.set(what, value)

    def _notes(self, wish: Wish, size_px: tuple[int, int], rate_hz: float) -> tuple[str, ...]:
        """Sentences on what the camera does otherwise."""
        notes = []
        if wish.size_px is not None and wish.size_px != size_px:
            notes.append(
                f"The camera was asked for {wish.size_px[0]}x{wish.size_px[1]} pixels and gives "
                f"{size_px[0]}x{size_px[1]}."
            )
        if wish.rate_hz is not None and abs(rate_hz - wish.rate_hz) > 0.01 * wish.rate_hz:
            notes.append(f"The camera was asked for {wish.rate_hz:g} frames a second and states {rate_hz:g}.")
        codec = _four_letters(self._capture.get(cv2.CAP_PROP_FOURCC))
        if codec == "MJPG":
            notes.append(
                "The camera compresses its pictures (MJPG) before they arrive here: what that adds to the error is not "
                "in the uncertainty; choose a size or rate that it delivers raw."
            )
        for words, what, value in AUTOMATICS:
            stays = self._capture.get(what)
            if stays not in (value, -1.0, 0.0):
                notes.append(f"The camera's {words} could not be switched off (it reads back {stays:g}).")
        exposure, gain = self._capture.get(cv2.CAP_PROP_EXPOSURE), self._capture.get(cv2.CAP_PROP_GAIN)
        focus = self._capture.get(cv2.CAP_PROP_FOCUS)
        notes.append(f"The camera reads back: format {codec}, exposure {exposure:g}, gain {gain:g}, focus {focus:g}.")
        return tuple(notes)


def _check_device(name: str) -> None:
    if sys.platform != "linux":
        return
    device = Path(f"/dev/video{name}" if name.isdigit() else name)
    if not device.exists():
        found = ", ".join(source for source, _ in found_cameras()) or "none"
        raise FingervisionError(
            f"There is no camera {name} ({device} does not exist; cameras found: {found}): plug it in, or try the "
            "source `simulated`."
        )


def _luma(pixels: Any) -> Pixels:
    """Grey levels of OpenCV's blue, green and red, or of raw YUYV."""
    if pixels.ndim == 2:
        levels: Pixels = pixels
        return levels
    if pixels.shape[2] == 2:
        luma: Pixels = pixels[:, :, 0].copy()
        return luma
    # ITU-R BT.601, as `measure` makes grey of colours.
    grey: Pixels = cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY)
    return grey


def _four_letters(number: float) -> str:
    letters = "".join(chr((int(number) >> shift) & 0xFF) for shift in (0, 8, 16, 24))
    return letters if letters.isprintable() and letters.strip() else "unknown"


def _first_line(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8").strip()
    except OSError:
        return "camera"


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep OpenCV's own words about cameras that are not there off the screen."""
    before = cv2.getLogLevel()  # type: ignore[attr-defined]
    cv2.setLogLevel(0)  # type: ignore[attr-defined]
    try:
        yield
    finally:
        cv2.setLogLevel(before)  # type: ignore[attr-defined]
