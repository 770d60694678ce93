"""Read one image file (PNG, JPEG, BMP or TIFF; 8 or 16 bits; grey or colour); refuse a truncated file."""

import struct
import zlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.frame import Pixels

LOSSY_SUFFIXES = frozenset({".jpg", ".jpeg"})
IMAGE_SUFFIXES = LOSSY_SUFFIXES | {".png", ".bmp", ".tif", ".tiff"}

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
JPEG_START, JPEG_END = b"\xff\xd8", b"\xff\xd9"
# Largest accepted size, because a damaged header can state any size; the largest cameras have 150 million pixels.
MOST_PIXELS = 200_000_000
TIFF_STARTS = (b"II*\x00", b"MM\x00*", b"II+\x00", b"MM\x00+")


class UnreadableImageError(Exception):
    """An image cannot be read; the message gives the reason in a sentence."""


def is_image(file: Path) -> bool:
    """Whether a file is read as one image, by its name or its first bytes; otherwise it may be a video."""
    return not file.is_file() or file.suffix.lower() in IMAGE_SUFFIXES or cv2.haveImageReader(str(file))


def read_image(file: Path) -> Pixels:
    """Read an image at its own bit depth.

    An alpha channel is dropped; the colour levels stay as stored. A file that ends early or fails its checksum is
    refused, because decoders would fill in the missing part.

    Parameters
    ----------
    file : Path
        The image.

    Returns
    -------
    ndarray of uint8 or uint16, shape (height, width) or (height, width, 3)
        Grey, or red, green and blue.

    Raises
    ------
    UnreadableImageError
        If the file cannot be read, is damaged, contains several pictures, or has levels of other than 8 or 16 bits.
    """
    try:
        content = file.read_bytes()
    except OSError as error:
        raise UnreadableImageError(f"{file.name} could not be read ({error.strerror}).") from error
    if not content:
        raise UnreadableImageError(f"{file.name} is empty.")
    if content.startswith(PNG_SIGNATURE):
        _check_png(file.name, content)
    elif content.startswith(JPEG_START) and JPEG_END not in content[-4096:]:
        raise UnreadableImageError(f"{file.name} is truncated: the file ends before its picture is complete.")
    elif content.startswith(TIFF_STARTS) and cv2.imcount(str(file)) > 1:
        raise UnreadableImageError(f"{file.name} contains several pictures: save each picture in a separate file.")
    width_px, height_px = _stated_size_px(content)
    if width_px * height_px > MOST_PIXELS:
        raise UnreadableImageError(
            f"{file.name} states {width_px}x{height_px} pixels, which is more than {MOST_PIXELS // 10**6} "
            "million: crop the picture."
        )
    pixels = _decoded(content)
    if pixels is None:
        raise UnreadableImageError(f"{file.name} is damaged, or is not an image.")
    if pixels.dtype not in (np.uint8, np.uint16):
        raise UnreadableImageError(f"{file.name} must have levels of 8 or 16 bits, but they are {pixels.dtype}.")
    if pixels.ndim == 2:
        return pixels
    if pixels.shape[2] < 3:
        return np.ascontiguousarray(pixels[:, :, 0])
    return np.ascontiguousarray(pixels[:, :, 2::-1])


def _stated_size_px(content: bytes) -> tuple[int, int]:
    """Width and height that a PNG or JPEG states, read before memory is reserved; (0, 0) for other formats."""
    if content.startswith(PNG_SIGNATURE) and len(content) >= 24:
        width_px, height_px = struct.unpack_from(">II", content, 16)
        return width_px, height_px
    place = 2 if content.startswith(JPEG_START) else len(content)
    while place + 9 < len(content) and content[place] == 0xFF:
        kind = content[place + 1]
        if 0xC0 <= kind <= 0xCF and kind not in (0xC4, 0xC8, 0xCC):  # markers "start of frame" (ITU-T T.81, table B.1)
            height_px, width_px = struct.unpack_from(">HH", content, place + 5)
            return width_px, height_px
        place += 2 + struct.unpack_from(">H", content, place + 2)[0]
    return 0, 0


def _decoded(content: bytes) -> NDArray[Any] | None:
    """Decoded levels in OpenCV's channel order (blue first); None if the content cannot be decoded."""
    try:
        return cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        return None


def _check_png(name: str, content: bytes) -> None:
    """Check the chunks (PNG specification, section 5): length, type and CRC-32 of each, and that the last is IEND."""
    place = len(PNG_SIGNATURE)
    while True:
        if place + 12 > len(content):
            raise UnreadableImageError(f"{name} is truncated: the file ends before its picture is complete.")
        (length,) = struct.unpack_from(">I", content, place)
        end = place + 8 + length
        if end + 4 > len(content):
            raise UnreadableImageError(f"{name} is truncated: the file ends before its picture is complete.")
        kind = content[place + 4 : place + 8]
        (stated,) = struct.unpack_from(">I", content, end)
        if zlib.crc32(memoryview(content)[place + 4 : end]) != stated:
            raise UnreadableImageError(f"{name} is damaged: a chunk of the file has a wrong checksum.")
        if kind == b"IEND":
            return
        place = end + 4
