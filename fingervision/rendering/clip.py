"""Video clips: frames with their own times, compressed by a codec into a video file."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import chain
from pathlib import Path

import av
import cv2
import numpy as np
from av.container import OutputContainer
from av.video.reformatter import ColorRange

from fingervision.domain.errors import DataError, OutputError
from fingervision.domain.frame import Frame, Pixels

# A frame after JPEG compression.


def through_jpeg(pixels: Pixels, quality: int) -> Pixels:
    """Compress a frame as JPEG and decode it.

    Parameters
    ----------
    pixels : ndarray of uint8, shape (height, width) or (height, width, 3)
        Grey levels, or red, green and blue.
    quality : int
        Quality from 0 to 100, as defined by libjpeg.

    Returns
    -------
    ndarray of uint8
        Array of the same shape.

    Raises
    ------
    DataError
        If the frame is not in 8 bits, or the quality is out of range.
    """
    if pixels.dtype != np.uint8:
        msg = f"JPEG stores 8 bits, but the frame has {pixels.dtype.itemsize * 8}: render with bits=8."
        raise DataError(msg)
    if not 0 <= quality <= 100:
        msg = f"A JPEG quality must lie between 0 and 100, but is {quality}."
        raise DataError(msg)
    # OpenCV stores colours in the order blue, green, red.
    colour = pixels.ndim == 3
    done, packet = cv2.imencode(".jpg", pixels[..., ::-1] if colour else pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])
    read = cv2.imdecode(packet, cv2.IMREAD_COLOR if colour else cv2.IMREAD_GRAYSCALE) if done else None
    if read is None:
        msg = f"OpenCV could not compress a frame of {pixels.shape[1]} x {pixels.shape[0]} pixels as JPEG."
        raise DataError(msg)
    return read[..., ::-1].astype(np.uint8) if colour else read.astype(np.uint8, copy=False)


# Clock of MPEG. MP4 and QuickTime files store times to one tick of this clock; Matroska rounds times to 1 ms.
CLOCK_HZ = 90_000
# Options of the muxers. Without `movie_timescale`, MP4 would round the start of a clip to 1 ms.
CONTAINERS = {
    ".mp4": {"fflags": "+bitexact", "movie_timescale": str(CLOCK_HZ)},
    ".mov": {"fflags": "+bitexact", "movie_timescale": str(CLOCK_HZ)},
    ".mkv": {"fflags": "+bitexact"},
}

# Full-range luma and colour differences (ITU-R BT.601, as in JPEG's JFIF).
YCBCR_FROM_RGB = np.array([[0.299, 0.587, 0.114], [-0.168736, -0.331264, 0.5], [0.5, -0.418688, -0.081312]])


@dataclass(frozen=True, slots=True)
class H264:
    """H.264 by x264.

    Parameters
    ----------
    crf : float
        Constant rate factor: 18 is visually lossless, 23 ordinary, 28 poor.
    """

    crf: float = 23.0


@dataclass(frozen=True, slots=True)
class Mjpeg:
    """Motion JPEG.

    Parameters
    ----------
    qscale : int
        Quantiser scale of FFmpeg: 2 is the best, 5 ordinary, 31 the worst.
    """

    qscale: int = 3


@dataclass(frozen=True, slots=True)
class Ffv1:
    """FFV1, lossless; 8 or 16 bits."""


Codec = H264 | Mjpeg | Ffv1


def write_clip(path: Path, frames: Iterable[Frame], codec: Codec) -> None:
    """Write frames with their presentation times, at a constant or variable rate.

    Grey levels are stored unchanged as full-range luma, so that the clip's luma plane is the frame.

    Parameters
    ----------
    path : Path
        Path of the file; its suffix (.mp4, .mov or .mkv) determines the container format.
    frames : iterable of Frame
        Frames of one size, with increasing times.
    codec : H264, Mjpeg or Ffv1
        Compression.

    Raises
    ------
    DataError
        If times are missing or do not increase, sizes change, or the clip is empty.
    OutputError
        If the file cannot be written, or the container or codec does not support the frames.
    """
    if path.suffix not in CONTAINERS:
        msg = f"A clip's name must end in {', '.join(CONTAINERS)}, because these keep every time, but is {path.name}."
        raise OutputError(msg)
    source = iter(frames)
    first = next(source, None)
    if first is None:
        msg = f"A clip must have at least one frame, but {path.name} would have none."
        raise DataError(msg)
    try:
        with av.open(f"file:{path}", "w", options=CONTAINERS[path.suffix]) as container:
            _encode(container, first, source, codec)
    except OSError as error:
        msg = f"{path} must be a file that can be written, but it could not be: {error.strerror}."
        raise OutputError(msg) from error


def _encode(container: OutputContainer, first: Frame, others: Iterator[Frame], codec: Codec) -> None:
    """Compress frames into an open container."""
    pixel_format = _pixel_format(first.pixels, codec)
    match codec:
        case H264(crf=crf):
            # Equal frames must give equal bytes; without these options, the result of x264's look-ahead may vary
            # between runs.
            options = {"crf": f"{crf:g}", "threads": "1", "x264-params": "threads=1:cpu-independent=1"}
            stream = container.add_stream("libx264", options=options)
        case Mjpeg(qscale=qscale):
            stream = container.add_stream("mjpeg", options={"qmin": str(qscale), "qmax": str(qscale)})
        case Ffv1():
            stream = container.add_stream("ffv1", options={"level": "3", "slicecrc": "1"})
    stream.width, stream.height, stream.pix_fmt = first.width_px, first.height_px, pixel_format
    stream.codec_context.time_base = stream.time_base = Fraction(1, CLOCK_HZ)
    stream.codec_context.color_range = ColorRange.JPEG
    stream.codec_context.flags |= av.codec.context.Flags.bitexact.value
    last_tick = -1
    for frame in chain([first], others):
        tick = _tick(frame, last_tick)
        if frame.pixels.shape != first.pixels.shape or frame.pixels.dtype != first.pixels.dtype:
            msg = (
                f"All frames of a clip must have the same shape and type, but frame {frame.index} is "
                f"{frame.pixels.shape} of "
                f"{frame.pixels.dtype} and the first {first.pixels.shape} of {first.pixels.dtype}."
            )
            raise DataError(msg)
        picture = _picture(frame.pixels, pixel_format)
        picture.pts, picture.time_base = tick, Fraction(1, CLOCK_HZ)
        container.mux(stream.encode(picture))
        last_tick = tick
    container.mux(stream.encode(None))


def _tick(frame: Frame, last_tick: int) -> int:
    """Time of a frame in ticks of the clip's clock."""
    if frame.time_s is None:
        msg = f"A frame of a clip must have its time, but frame {frame.index} has none."
        raise DataError(msg)
    tick = round(frame.time_s * CLOCK_HZ)
    if tick <= last_tick:
        msg = (
            f"Times in a clip must start at 0 or later and increase, but frame {frame.index} is at "
            f"{frame.time_s:g} s, after {last_tick / CLOCK_HZ:g} s."
        )
        raise DataError(msg)
    return tick


def _pixel_format(pixels: Pixels, codec: Codec) -> str:
    """FFmpeg's name of the pixel format in which a codec stores frames of this bit depth and number of channels."""
    wide, colour = pixels.dtype == np.uint16, pixels.ndim == 3
    if isinstance(codec, Ffv1):
        if colour:
            if wide:
                msg = "FFV1 clips hold colour with 8 bits, but the frames have 16: render grey frames or bits=8."
                raise DataError(msg)
            return "bgr0"
        return "gray16le" if wide else "gray"
    if wide:
        msg = f"{type(codec).__name__} holds 8 bits, but the frames have 16: render with bits=8 or write FFV1."
        raise DataError(msg)
    if pixels.shape[0] % 2 or pixels.shape[1] % 2:
        msg = (
            f"{type(codec).__name__} needs an even width and height, but the frames have "
            f"{pixels.shape[1]} x {pixels.shape[0]} pixels."
        )
        raise DataError(msg)
    return "yuvj420p" if isinstance(codec, Mjpeg) else "yuv420p"


def _picture(pixels: Pixels, pixel_format: str) -> av.VideoFrame:
    """Wrap a frame for the encoder."""
    if pixel_format == "bgr0":
        return av.VideoFrame.from_ndarray(pixels, format="rgb24").reformat(format=pixel_format)
    if pixel_format.startswith("gray"):
        return av.VideoFrame.from_ndarray(pixels, format=pixel_format)
    height, width = pixels.shape[:2]
    if pixels.ndim == 2:
        planes = np.vstack([pixels, np.full((height // 2, width), 128, dtype=np.uint8)])
    else:
        luma, blue, red = np.moveaxis(pixels @ YCBCR_FROM_RGB.T, -1, 0)
        blue, red = (c.reshape(height // 2, 2, width // 2, 2).mean(axis=(1, 3)) + 128 for c in (blue, red))
        planes = np.concatenate([luma.ravel(), blue.ravel(), red.ravel()]).reshape(height * 3 // 2, width)
        planes = np.clip(np.rint(planes), 0, 255).astype(np.uint8)
    picture = av.VideoFrame.from_ndarray(planes, format=pixel_format)
    picture.color_range = ColorRange.JPEG
    return picture
