"""Recordings as files: frames at their own times, and pictures at an even rate as any program codes them."""

import io
import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import count
from pathlib import Path

import av
import numpy as np
from av.video.reformatter import ColorRange

from fingervision.domain.frame import Frame, Pixels

CLOCK_HZ = 90_000
"""Clock of MPEG. MP4 and QuickTime files store times to one tick of this clock; Matroska rounds times to 1 ms."""


@dataclass(frozen=True)
class Codec:
    """A codec, the format of its pixels, and its options."""

    name: str
    pixel_format: str
    options: Mapping[str, str] = field(default_factory=dict)


FFV1 = Codec("ffv1", "gray", {"level": "3", "slicecrc": "1"})


def h264(crf: float = 23.0) -> Codec:
    """H.264 of a constant rate factor: 18 is visually lossless, 28 poor; equal frames give equal bytes."""
    return Codec(
        "libx264", "yuv420p", {"crf": f"{crf:g}", "threads": "1", "x264-params": "threads=1:cpu-independent=1"}
    )


def mjpeg(qscale: int = 3) -> Codec:
    """Motion JPEG of a quantiser scale: 2 is the best, 31 the worst."""
    return Codec("mjpeg", "yuvj420p", {"qmin": str(qscale), "qmax": str(qscale)})


@contextmanager
def opened_to_write(
    file: str | io.BytesIO, container_format: str | None = None
) -> Iterator[av.container.OutputContainer]:
    """Open a container for coding; the priority that a coder takes is given back at the end.

    SVT-AV1 gives real-time priority to the thread that calls it where it may, that is as root: everything else on the
    machine, the programs that this thread starts excepted, then waits for it until the process ends.
    """
    try:
        with av.open(file, "w", format=container_format) as container:
            yield container
    finally:
        if sys.platform == "linux":
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def write_clip(path: Path, frames: Iterable[Frame], codec: Codec) -> None:
    """Write frames at their own times; grey levels are stored unchanged, as full-range luma."""
    # Without a time scale, MP4 would round the start of a clip to 1 ms.
    timescale = {} if path.suffix == ".mkv" else {"movie_timescale": str(CLOCK_HZ)}
    with av.open(f"file:{path}", "w", options={"fflags": "+bitexact", **timescale}) as container:
        stream = container.add_stream(codec.name, options=dict(codec.options))
        stream.codec_context.time_base = stream.time_base = Fraction(1, CLOCK_HZ)
        stream.codec_context.color_range = ColorRange.JPEG
        stream.codec_context.flags |= av.codec.context.Flags.bitexact.value
        for number, frame in enumerate(frames):
            assert frame.time_s is not None
            picture = _picture(frame.pixels, codec)
            if number == 0:
                stream.width, stream.height, stream.pix_fmt = picture.width, picture.height, picture.format.name
            picture.pts, picture.time_base = round(frame.time_s * CLOCK_HZ), Fraction(1, CLOCK_HZ)
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))


def _picture(pixels: Pixels, codec: Codec) -> av.VideoFrame:
    if codec is FFV1 and pixels.ndim == 3:
        return av.VideoFrame.from_ndarray(pixels, format="rgb24").reformat(format="bgr0")
    if codec is FFV1:
        return av.VideoFrame.from_ndarray(pixels, format="gray16le" if pixels.dtype == np.uint16 else "gray")
    grey = np.full((pixels.shape[0] // 2, pixels.shape[1]), 128, dtype=np.uint8)
    picture = av.VideoFrame.from_ndarray(np.vstack([pixels, grey]), format=codec.pixel_format)
    picture.color_range = ColorRange.JPEG
    return picture


def coded(
    path: Path,
    pictures: Iterable[Pixels],
    codec: Codec,
    *,
    rate_hz: int = 25,
    ticks: Iterable[int] | None = None,
    container_format: str | None = None,
    **ranges: str,
) -> bytes:
    """Write grey pictures at an even rate, or at these ticks of it; return the file's content.

    `ranges` are those of `av.VideoFrame.reformat`, by which levels become luma.
    """
    with opened_to_write(str(path), container_format) as container:
        stream = container.add_stream(codec.name, rate=rate_hz, options=dict(codec.options))
        stream.pix_fmt = codec.pixel_format
        for number, (tick, levels) in enumerate(zip(count() if ticks is None else ticks, pictures, strict=False)):
            if number == 0:
                stream.height, stream.width = levels.shape
            picture = av.VideoFrame.from_ndarray(levels, format="gray").reformat(format=codec.pixel_format, **ranges)
            picture.pts, picture.time_base = tick, Fraction(1, rate_hz)
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))
    return path.read_bytes()
