"""Limits of a V4L2 camera's settings, as stated by the driver (Linux).

Source: `struct v4l2_queryctrl` and `VIDIOC_QUERYCTRL` in linux/videodev2.h; numbers of the controls in
linux/v4l2-controls.h.
"""

import os
import struct
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import cv2

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
