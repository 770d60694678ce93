"""Open a recording from a file name, the number of a camera, an array, or a frame source."""

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from fingervision.domain.errors import ArgumentError, ArgumentTypeError, UsageError
from fingervision.domain.frame import Coding
from fingervision.frames.array_levels import what_it_is
from fingervision.frames.arrays import ArrayFrames, KeptFrames, PictureStream
from fingervision.frames.checked_frames import CheckedFrames
from fingervision.frames.source import FrameSource, Wish
from fingervision.frames.source_kinds import open_source
from fingervision.interface.argument_checks import number, one_of, whole_number

MUST = (
    "be a picture or a stack of pictures (numpy array), an iterable of pictures, the name of a video, folder, image or "
    "glob, a camera's number, or a FrameSource"
)

Opener = Callable[[], FrameSource]


@dataclass(frozen=True, slots=True)
class _Same:
    """Opener of a recording that need not be opened anew; a function could not be pickled."""

    source: FrameSource

    def __call__(self) -> FrameSource:
        return self.source


def recording_of(
    source: Any,
    *,
    rate_hz: float | None = None,
    times_s: Iterable[float] | None = None,
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
        return _Same(pictures)
    if _yields_pictures(source):
        _refuse_frames(frames)
        stream = PictureStream(source, rate_hz, times_s, stored)
        return _Same(stream)
    if times_s is not None:
        raise UsageError(
            "times_s is for pictures in arrays: leave it out. The times of a folder of images belong into its "
            "times.csv, and a source of your own yields them."
        )
    if stored is not Coding.LOSSLESS:
        raise UsageError("coding is for pictures in arrays, since a file states its own coding: leave it out.")
    if isinstance(source, bool) or not isinstance(source, str | os.PathLike | int | np.integer):
        if not hasattr(source, "description"):
            raise ArgumentTypeError("source", MUST, f"is {what_it_is(source)}")
        given = _own_source(source, rate_hz)
        return _camera(given, frames) if hasattr(given, "received") else _recording(_Same(given), frames)
    name = str(int(source)) if isinstance(source, int | np.integer) else os.fspath(source)
    wish = Wish(rate_hz=rate_hz)
    opened = open_source(str(name), wish)
    if hasattr(opened, "received"):
        return _camera(opened, frames)
    return _recording(partial(open_source, str(name), wish), frames)


def _yields_pictures(source: Any) -> bool:
    """Whether a source is an iterable of pictures: neither a name, nor a source with a description of its own."""
    if isinstance(source, str | bytes | os.PathLike | Mapping) or hasattr(source, "description"):
        return False
    return hasattr(source, "__iter__") or hasattr(source, "__next__")


def _own_source(source: Any, rate_hz: float | None) -> CheckedFrames:
    """Check that a user's class is a frame source, and give its pictures times if it has none.

    Raises
    ------
    ArgumentError
        The class cannot be iterated, or its description is wrong.
    UsageError
        A rate is given for pictures that have times.
    """
    if not hasattr(source, "__iter__"):
        must = "have a method __iter__ that yields fingervision.Frame or fingervision.LostFrame"
        raise ArgumentTypeError("source", must, f"is {what_it_is(source)} without it")
    return CheckedFrames(source, rate_hz)


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
    return _Same(kept)
