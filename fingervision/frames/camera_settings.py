"""Requested and actual settings of a camera, as properties of OpenCV, whose meaning differs between systems.

The meaning of the properties differs between OpenCV's backends (modules/videoio/src/cap_v4l.cpp, cap_msmf.cpp and
cap_avfoundation_mac.mm of OpenCV 4 and 5):

* V4L2 returns -1 for a property that a camera lacks. The exposure in V4L2 counts units of 0.1 ms
  (V4L2_CID_EXPOSURE_ABSOLUTE); its automatic exposure is a menu in which 1 is manual and 3 is the usual automatic mode.
  If the environment asks for normalised values, the V4L2 menu returns 0.25 and 0.75 and every other property a fraction
  of an unknown range; mode 0 switches the normalisation off.
* Media Foundation's exposure is the logarithm to base 2 of seconds. In Media Foundation, setting an automatic mode also
changes the value of the property (the focus would run to 0), and reading the mode back gives no information. In Media
Foundation,
  setting a value makes the property manual, so that writing back the value just read keeps the value constant.
* AVFoundation supports size and frame rate only.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from math import isclose, log2

import cv2

from fingervision.domain.frame import Coding
from fingervision.frames import controls
from fingervision.frames.source import Wish

V4L2, MSMF = "V4L2", "MSMF"
UNSUPPORTED = -1.0
# Format without compression, which every camera of the USB video class offers at some picture size.
RAW_FORMAT = "YUYV"
# Formats in which a camera compresses its pictures: each picture by itself, or with reference to other pictures.
CODINGS = {
    **dict.fromkeys(("MJPG", "JPEG", "AVRn", "dmb1"), Coding.INTRAFRAME),
    **dict.fromkeys(("H264", "HEVC", "X264", "avc1"), Coding.INTERFRAME),
}
# One picture is filled while the other is read; further buffers would only contain older pictures.
BUFFERED_PICTURES = 2
V4L2_MANUAL_EXPOSURE, V4L2_MANUAL_NORMALISED = 1.0, 0.25


@dataclass(frozen=True, slots=True)
class Control:
    """A numeric setting of a camera.

    Parameters
    ----------
    name : str
        Name of the setting in words.
    what : int
        Number of the property in OpenCV.
    unit : str
        Unit of the displayed number; empty if only the camera's maker knows it.
    wished : callable
        Function that returns the value requested by the user, or None.
    """

    name: str
    what: int
    unit: str
    wished: Callable[[Wish], float | None]


EXPOSURE = Control(controls.EXPOSURE, cv2.CAP_PROP_EXPOSURE, "ms", lambda wish: wish.camera.exposure_ms)
GAIN = Control(controls.GAIN, cv2.CAP_PROP_GAIN, "", lambda wish: wish.camera.gain)
FOCUS = Control(controls.FOCUS, cv2.CAP_PROP_FOCUS, "", lambda wish: wish.camera.focus)
# In V4L2 the same property is also called WB_TEMPERATURE; Media Foundation has only this name.
WHITE_BALANCE = Control("white balance", cv2.CAP_PROP_TEMPERATURE, "K", lambda wish: wish.camera.white_balance_k)
ZOOM = Control(controls.ZOOM, cv2.CAP_PROP_ZOOM, "", lambda wish: None)
CONTROLS = (EXPOSURE, GAIN, FOCUS, WHITE_BALANCE, ZOOM)
# Automatic settings that can change from frame to frame: V4L2's property, and the consequence for the measurement.
AUTOMATICS: Mapping[str, tuple[int, str]] = {
    EXPOSURE.name: (cv2.CAP_PROP_AUTO_EXPOSURE, "edges shift with the exposure"),
    FOCUS.name: (cv2.CAP_PROP_AUTOFOCUS, "the scale changes with the focus"),
    WHITE_BALANCE.name: (cv2.CAP_PROP_AUTO_WB, "grey levels change with the white balance"),
}
READ = (
    cv2.CAP_PROP_FOURCC,
    cv2.CAP_PROP_FPS,
    *(control.what for control in CONTROLS),
    *(what for what, _ in AUTOMATICS.values()),
)


@dataclass(frozen=True, slots=True)
class Settled:
    """The actual settings of a camera.

    Parameters
    ----------
    settings : dict of str to str
        Value of each setting that the camera has, with its unit.
    notes : tuple of str
        One sentence for each setting that differs from the request.
    """

    settings: dict[str, str]
    notes: tuple[str, ...]


def requests(backend: str, wish: Wish, found: Mapping[int, float]) -> Iterator[tuple[int, float]]:
    """Properties and values to set, in the order in which a camera must receive them.

    Parameters
    ----------
    backend : str
        OpenCV's name of the backend.
    wish : Wish
        Settings requested by the user; others are left unchanged, except that automatic changes are switched off.
    found : mapping of int to float
        Values read before, by property.
    """
    if backend == V4L2:
        yield cv2.CAP_PROP_MODE, 0.0
    # The format is set first, because the available sizes and rates depend on it. Outside V4L2, it is the format to
    # which OpenCV converts the picture.
    wanted = wish.camera.format or (RAW_FORMAT if backend == V4L2 else None)
    if wanted is not None:
        yield cv2.CAP_PROP_FOURCC, float(cv2.VideoWriter.fourcc(*wanted))
    if wish.size_px is not None:
        yield cv2.CAP_PROP_FRAME_WIDTH, float(wish.size_px[0])
        yield cv2.CAP_PROP_FRAME_HEIGHT, float(wish.size_px[1])
    if wish.rate_hz is not None:
        yield cv2.CAP_PROP_FPS, wish.rate_hz
    if backend == V4L2:
        yield cv2.CAP_PROP_BUFFERSIZE, float(BUFFERED_PICTURES)
        for name, (what, _) in AUTOMATICS.items():
            yield what, V4L2_MANUAL_EXPOSURE if name == EXPOSURE.name else 0.0
    for control in CONTROLS:
        value = control.wished(wish)
        if value is not None and backend in (V4L2, MSMF):
            yield control.what, of_camera(backend, control, value)
        elif backend == MSMF and control.name in AUTOMATICS and is_there(found, control.what):
            yield control.what, found[control.what]


def settled(backend: str, wish: Wish, read: Mapping[int, float]) -> Settled:
    """Compare the settings read back from a camera with those requested.

    Parameters
    ----------
    backend : str
        OpenCV's name of the backend.
    wish : Wish
        Settings requested by the user.
    read : mapping of int to float
        Values read after the request, by property.
    """
    settings, notes = {"format": four_letters(read.get(cv2.CAP_PROP_FOURCC, UNSUPPORTED))}, []
    if wish.camera.format is not None and settings["format"] != wish.camera.format:
        notes.append(
            f"The format {wish.camera.format} was requested from the camera, but it gives {settings['format']}."
        )
    if settings["format"] == "MJPG":
        notes.append(
            "The camera compresses its pictures (MJPG) with loss, which increases the uncertainty: choose a size or "
            "rate that the camera offers without compression (--format YUYV)."
        )
    rate_hz = read.get(cv2.CAP_PROP_FPS, UNSUPPORTED)
    if wish.rate_hz is not None and not isclose(rate_hz, wish.rate_hz, rel_tol=controls.SAME_SHARE):
        states = f"states {rate_hz:g}" if rate_hz > 0.0 else "states no rate"
        notes.append(f"A rate of {wish.rate_hz:g} frames per second was requested from the camera, but it {states}.")
    for control in CONTROLS:
        asked = control.wished(wish)
        if not is_there(read, control.what) or backend not in (V4L2, MSMF):
            if asked is not None:
                notes.append(_cannot(backend, control, asked))
            continue
        value = of_user(backend, control, read[control.what])
        settings[control.name] = _words(control, value)
        if asked is not None and not isclose(value, asked, rel_tol=controls.SAME_SHARE):
            notes.append(
                f"The camera's {control.name} was requested as {_words(control, asked)}, but is "
                f"{_words(control, value)}."
            )
    for name, (what, harm) in AUTOMATICS.items() if backend == V4L2 else ():
        if is_there(read, what) and not _is_manual(name, read[what]):
            settings[name] = "automatic"
            notes.append(
                f"The camera's automatic {name} could not be switched off (the camera reports the mode "
                f"{read[what]:g}): {harm}."
            )
    listed = ", ".join(f"{name} {value}" for name, value in settings.items())
    notes.append(f"The camera reports these settings: {listed}.")
    return Settled(settings, tuple(notes))


def coding_of(settings: Mapping[str, str]) -> Coding:
    """Compression of a camera's pictures before their arrival, derived from the reported pixel format."""
    return CODINGS.get(settings.get("format", ""), Coding.LOSSLESS)


def four_letters(number: float) -> str:
    """Four-letter name of a pixel format; "unknown" if there is none."""
    letters = "".join(chr((int(number) >> shift) & 0xFF) for shift in (0, 8, 16, 24)) if number > 0.0 else ""
    return letters.strip() if letters.isascii() and letters.isprintable() and letters.strip() else "unknown"


def is_there(read: Mapping[int, float], what: int) -> bool:
    """Whether a camera has a property, judged by the value that was read back."""
    return read.get(what, UNSUPPORTED) != UNSUPPORTED


def _is_manual(name: str, value: float) -> bool:
    return value in (V4L2_MANUAL_EXPOSURE, V4L2_MANUAL_NORMALISED) if name == EXPOSURE.name else value == 0.0


def of_camera(backend: str, control: Control, value: float) -> float:
    """Convert a user's value to the units of a camera's backend."""
    if control is not EXPOSURE:
        return value
    return float(round(log2(1e-3 * value))) if backend == MSMF else float(max(1, round(10.0 * value)))


def of_user(backend: str, control: Control, value: float) -> float:
    """Convert a backend's value to the user's units."""
    if control is not EXPOSURE:
        return value
    return float(1e3 * 2.0**value) if backend == MSMF else 0.1 * value


def _words(control: Control, value: float) -> str:
    return f"{value:.4g} {control.unit}".strip()


def _cannot(backend: str, control: Control, asked: float) -> str:
    words = f"The camera's {control.name} was requested as {_words(control, asked)}"
    if backend in (V4L2, MSMF):
        return f"{words}, but the camera has no such setting."
    return (
        f"{words}, but {backend} does not allow programs to change this setting: change it in the camera's own program."
    )
