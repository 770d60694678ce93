"""The camera's transfer curve as stated by a tag in the recording."""

import struct
from functools import lru_cache
from pathlib import Path

import av

from calib.camera_response import STUDIO
from fingervision.frames.image_file import JPEG_START, PNG_SIGNATURE
from fingervision.frames.open_container import open_container

# Transfer characteristics of ITU-T H.273, table 3, with their names in `calib.camera_response`.
VIDEO_TAGS = {1: "bt709", 6: "bt709", 8: "linear", 13: "srgb", 14: "bt709", 15: "bt709", 16: "pq", 18: "hlg"}
# PyAV's number of the limited colour range (ITU-T H.273, 8.3: VideoFullRangeFlag is 0).
STUDIO_RANGE = 1
LUMA_FORMATS = ("yuv", "yuyv", "uyvy", "yvyu", "nv", "p0", "p2", "p4", "gray", "y2")
# A PNG picture states sRGB, or a power (PNG specification, 11.3.3.2), of which 1/2.2 stands for sRGB.
IMAGE_TAGS = VIDEO_TAGS | {4: "srgb"}
EXIF_START, EXIF_IFD, COLOUR_SPACE = b"Exif\x00\x00", 0x8769, 0xA001
# Number of bytes at the start of a file that are searched for tags, which precede the pixels.
HEAD_BYTES = 1 << 16


def transfer_tag(files: tuple[Path, ...]) -> str | None:
    """Name of the standard camera response that the first file states; None if no response is stated.

    Parameters
    ----------
    files : tuple of Path
        Files of the recording.
    """
    if not files:
        return None
    try:
        with files[0].open("rb") as file:
            head = file.read(HEAD_BYTES)
    except OSError:
        return None
    if head.startswith(JPEG_START):
        return _of_jpeg(head)
    if len(files) > 1 and not head.startswith(PNG_SIGNATURE):
        return None
    try:
        return _of_container(files[0], files[0].stat().st_mtime_ns)
    except (av.FFmpegError, OSError, ValueError):
        return None


@lru_cache(maxsize=1)
def _of_container(path: Path, changed_ns: int) -> str | None:
    """Tag of a video as it was at that time; to open one reads its whole index, which takes long for an hour."""
    with open_container(path) as container:
        video = next(iter(container.streams.video), None)
        return None if video is None else _of_video(video.codec_context)


def _of_video(codec: av.VideoCodecContext) -> str | None:
    """Transfer curve that a video states, with `_studio` appended if black and white lie within the stored levels.

    Only luma has a limited (studio) range; a video that states no range is assumed to use the full range.
    """
    name = (IMAGE_TAGS if codec.name == "png" else VIDEO_TAGS).get(int(codec.color_trc))
    is_luma = (codec.pix_fmt or "").startswith(LUMA_FORMATS)
    return f"{name}_studio" if name in STUDIO and is_luma and int(codec.color_range) == STUDIO_RANGE else name


def _of_jpeg(head: bytes) -> str | None:
    """Colour space in a JPEG's Exif record, where 1 means sRGB; None without such a record."""
    start = head.find(EXIF_START)
    if start < 0:
        return None
    tiff = head[start + len(EXIF_START) :]
    order = "<" if tiff[:2] == b"II" else ">"
    try:
        (place,) = struct.unpack_from(order + "I", tiff, 4)
        inner = _entry(tiff, order, place, EXIF_IFD)
        space = None if inner is None else _entry(tiff, order, inner, COLOUR_SPACE)
    except struct.error:
        return None
    return "srgb" if space == 1 else None


def _entry(tiff: bytes, order: str, place: int, wanted: int) -> int | None:
    """Value of one entry of an image file directory (TIFF 6.0, section 2)."""
    (count,) = struct.unpack_from(order + "H", tiff, place)
    for k in range(count):
        tag, kind, _ = struct.unpack_from(order + "HHI", tiff, place + 2 + 12 * k)
        if tag == wanted:
            return int(struct.unpack_from(order + ("H" if kind == 3 else "I"), tiff, place + 10 + 12 * k)[0])
    return None
