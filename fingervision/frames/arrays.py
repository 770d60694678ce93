"""Pictures in memory as a recording: numpy arrays of any bit depth, grey or colour."""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import ArgumentError
from fingervision.domain.frame import Coding, Frame, LostFrame, Pixels
from fingervision.frames.array_levels import levels_of, stated_shape
from fingervision.frames.source import Description

HASH_DIGITS = 12
"""Number of digits of the pictures' SHA-256 in the recording's name; two different arrays have the same digits with a
probability of 10^-14.
"""


@dataclass(frozen=True, slots=True, eq=False)
class ArrayFrames:
    """Pictures in an array as a recording.

    Parameters
    ----------
    pictures : ndarray, shape (height, width[, colours]) or (frames, height, width[, colours])
        Grey levels, or red, green and blue, optionally with an opaque alpha channel; uint8, uint16, or float from 0 to
        1. An array of three dimensions is one colour picture if its last dimension is 3 or 4, otherwise a stack of grey
        pictures.
    rate_hz : float or None
        Pictures per second.
    times_s : sequence of float or None
        Time of every picture; strictly increasing.
    coding : Coding
        Compression that the pictures underwent before they were decoded.

    Raises
    ------
    ArgumentTypeError
        The argument is not a numeric numpy array.
    ArgumentError
        The array's shape, type or levels cannot be those of pictures, or the number of times differs from the number
        of pictures.
    """

    pictures: NDArray[np.generic] = field(repr=False)
    rate_hz: float | None = None
    times_s: Sequence[float] | None = None
    coding: Coding = Coding.LOSSLESS
    description: Description = field(init=False)
    _stack: NDArray[np.generic] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        stack = stated_shape(self.pictures)
        if self.rate_hz is not None and self.times_s is not None:
            raise ArgumentError("rate_hz", "be left out if times_s is given", "both are given")
        if self.rate_hz is not None and not 0.0 < self.rate_hz < float("inf"):
            raise ArgumentError("rate_hz", "be positive", f"is {self.rate_hz:g}")
        times_s = None if self.times_s is None else _checked_times(self.times_s, len(stack))
        whole = hashlib.sha256(f"{stack.shape} {stack.dtype.str}".encode())
        for picture in stack:
            whole.update(np.ascontiguousarray(picture).data)
        object.__setattr__(self, "times_s", times_s)
        object.__setattr__(self, "_stack", stack)
        object.__setattr__(
            self,
            "description",
            Description(
                name=f"array-{whole.hexdigest()[:HASH_DIGITS]}",
                kind="array",
                codec=str(self.pictures.dtype),
                coding=self.coding,
                width_px=int(stack.shape[2]),
                height_px=int(stack.shape[1]),
                rate_hz=self.rate_hz,
                has_times=self.rate_hz is not None or times_s is not None,
                frame_count=len(stack),
            ),
        )

    def __iter__(self) -> Iterator[Frame | LostFrame]:
        """Yield the pictures one by one; each is checked and converted when it is yielded."""
        is_single = self.pictures.ndim < 4 and len(self._stack) == 1
        for index, picture in enumerate(self._stack):
            words = "" if is_single else f" of picture {index}"
            yield Frame(levels_of(picture, words), index, self._time_s(index), self.coding)

    @property
    def has_float_levels(self) -> bool:
        """Whether the levels were given as floats, which are converted to 16-bit levels."""
        return bool(self.pictures.dtype.kind == "f")

    def _time_s(self, index: int) -> float | None:
        if self.times_s is not None:
            return self.times_s[index]
        return None if self.rate_hz is None else index / self.rate_hz


@dataclass(frozen=True, slots=True, eq=False)
class KeptFrames:
    """Frames of a camera that were kept in memory, as a recording.

    Parameters
    ----------
    description : Description
        Description of the camera.
    frames : tuple of Frame or LostFrame
        Frames in order.
    """

    description: Description
    frames: tuple[Frame | LostFrame, ...] = field(repr=False)

    def __iter__(self) -> Iterator[Frame | LostFrame]:
        """Yield the frames again."""
        return iter(self.frames)


def _checked_times(times_s: Sequence[float], count: int) -> tuple[float, ...]:
    try:
        times = np.asarray(times_s, dtype=np.float64)
    except (TypeError, ValueError):
        raise ArgumentError("times_s", "be one number for each picture, in seconds", f"is {times_s!r}") from None
    if times.shape != (count,):
        raise ArgumentError("times_s", f"be one number for each of the {count} pictures", f"has shape {times.shape}")
    if not np.all(np.isfinite(times)) or np.any(np.diff(times) <= 0.0):
        raise ArgumentError("times_s", "be finite and increase from picture to picture", "does not")
    return tuple(times.tolist())


__all__ = ["ArrayFrames", "KeptFrames", "Pixels"]
