"""Settings of this computer's cameras that can be changed while a camera runs, in the user's units and in OpenCV's."""

from collections.abc import Iterator, Mapping

import cv2

from fingervision.frames.camera_settings import (
    EXPOSURE,
    FOCUS,
    GAIN,
    MSMF,
    V4L2,
    WHITE_BALANCE,
    Control,
    is_there,
    of_camera,
    of_user,
)
from fingervision.frames.controls import FRAME_RATE, CameraControl

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
