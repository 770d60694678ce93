"""Open a recording from a file name, the number of a camera, an array, or a frame source."""

import os
from collections.abc import Callable, Sequence
from itertools import islice
from typing import Any

import numpy as np

from fingervision.domain.errors import ArgumentError, ArgumentTypeError, UsageError
from fingervision.domain.frame import Coding
from fingervision.frames.array_levels import what_it_is
from fingervision.frames.arrays import ArrayFrames, KeptFrames
from fingervision.frames.source import FrameSource, Wish, open_source
from fingervision.interface.argument_checks import number, one_of, whole_number

MUST = (
    "be a picture or a stack of pictures (numpy array), the name of a video, folder, image or glob, or a camera's "
    "number"
)

Opener = Callable[[], FrameSource]


def recording_of(
    source: Any,
    *,
    rate_hz: float | None = None,
    times_s: Sequence[float] | None = None,
    frames: int | None = None,
    coding: str = "lossless",
) -> Opener:
    """Return a function that opens the recording anew at each call; the frames of a camera are read once and kept.

    Parameters
    ----------
    source, rate_hz, times_s, frames, coding
        The same as the arguments of `fingervision.measure`.

    Raises
    ------
    ArgumentTypeError
        The array does not contain pictures.
    UsageError
        An argument does not apply to this kind of source.
    DataError, DeviceError, InputFileError
        The file cannot be read.
    """
    if rate_hz is not None:
        rate_hz = number("rate_hz", rate_hz)
    stored = Coding(one_of("coding", coding, tuple(Coding)))
    if isinstance(source, np.ndarray) or hasattr(source, "__array__"):
        _refuse_frames(frames)
        pictures = ArrayFrames(source, rate_hz, times_s, stored)
        return lambda: pictures
    if times_s is not None:
        raise UsageError(
            "times_s is for arrays only: leave it out, and put the times of a folder of images into its times.csv."
        )
    if stored is not Coding.LOSSLESS:
        raise UsageError("coding is for arrays only, since a file states its own coding: leave it out.")
    if isinstance(source, bool) or not isinstance(source, str | os.PathLike | int | np.integer):
        if hasattr(source, "description") and hasattr(source, "__iter__"):
            given: FrameSource = source
            return _camera(given, frames) if hasattr(given, "received") else _recording(lambda: given, frames)
        advice = "numpy.stack(...) makes one array of equal pictures" if isinstance(source, list | tuple) else ""
        raise ArgumentTypeError("source", MUST, f"is {what_it_is(source)}", advice)
    name = str(int(source)) if isinstance(source, int | np.integer) else os.fspath(source)
    wish = Wish(rate_hz=rate_hz)
    opened = open_source(str(name), wish)
    if hasattr(opened, "received"):
        return _camera(opened, frames)
    return _recording(lambda: open_source(str(name), wish), frames)


def _recording(opener: Opener, frames: int | None) -> Opener:
    _refuse_frames(frames)
    return opener


def _refuse_frames(frames: int | None) -> None:
    if frames is not None:
        raise ArgumentError("frames", "be left out where the source ends by itself", f"is {frames!r}")


def _camera(source: Any, frames: int | None) -> Opener:
    """Read a given number of frames from a camera and close it."""
    try:
        if frames is None:
            raise ArgumentError(
                "frames", "be given for a camera, which has no last frame", "is not", "say how many frames to measure"
            )
        count = whole_number("frames", frames, 1)
        kept = KeptFrames(source.description, tuple(islice(iter(source), count)))
    finally:
        source.close()
    return lambda: kept


__all__ = ["Opener", "recording_of"]
