"""The luma plane of a decoded picture, as the decoder stored it."""

from typing import Any

import av
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.frame import Pixels

# Packed formats: number of elements from the luma of one pixel to that of the next pixel, and position of the first
# luma element.
PACKED = {"yuyv422": (2, 0), "yvyu422": (2, 0), "uyvy422": (2, 1), "ya8": (2, 0), "ya16le": (2, 0), "ya16be": (2, 0)}
# Beginnings of the names of formats whose first plane is luma, with one element per pixel.
PLANAR = ("yuv4", "yuva4", "yuvj4", "gray", "nv1", "nv2", "nv4", "p0", "p2", "p4", "y8")


def luma(picture: av.VideoFrame) -> Pixels:
    """Grey levels of a picture, or its colours if it has no luma plane.

    Nothing is converted: 8-bit luma is returned as the decoder's own memory. Luma of 9 to 15 bits is scaled to 16 bits,
    so that its largest level becomes 65535.

    Parameters
    ----------
    picture : av.VideoFrame
        The decoded picture.

    Returns
    -------
    ndarray of uint8 or uint16, shape (height, width) or (height, width, 3)
        Luma; red, green and blue if the codec stores these.
    """
    name = picture.format.name
    bits = picture.format.components[0].bits
    step, first = PACKED.get(name, (1, 0))
    if "f32" in name or "f16" in name or bits > 16 or not (name in PACKED or name.startswith(PLANAR)):
        return _colours(picture, bits)
    plane = picture.planes[0]
    memory: Any = plane
    if bits <= 8:
        rows: NDArray[np.uint8] = np.frombuffer(memory, np.uint8).reshape(-1, plane.line_size)
        return rows[: picture.height, first : picture.width * step : step]
    wide = np.frombuffer(memory, ">u2" if name.endswith("be") else "<u2").reshape(-1, plane.line_size // 2)
    levels: NDArray[np.uint16] = wide[: picture.height, first : picture.width * step : step].astype(np.uint16)
    if bits == 16:
        return levels
    if name.startswith(("p0", "p2", "p4")):
        levels = levels >> np.uint16(16 - bits)
    # The upper bits are repeated in the free lower bits, so that level 0 stays 0 and the largest level becomes 65535.
    return (levels << np.uint16(16 - bits)) | (levels >> np.uint16(2 * bits - 16))


def _colours(picture: av.VideoFrame, bits: int) -> Pixels:
    """Red, green and blue of a picture stored in an RGB format, without loss."""
    grey = picture.format.name.startswith(("mono", "gray"))
    wanted = ("gray16le" if bits > 8 else "gray") if grey else ("rgb48le" if bits > 8 else "rgb24")
    levels: Any = picture.to_ndarray(format=wanted)
    pixels: Pixels = levels
    return pixels
