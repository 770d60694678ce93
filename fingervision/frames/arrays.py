"""Pictures in memory as a recording: numpy arrays of any bit depth, grey or colour, all at once or one by one."""

import hashlib
from collections.abc import Iterable, Iterator, Sized
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import ArgumentError, ArgumentTypeError, StateError
from fingervision.domain.frame import Coding, Frame, LostFrame, Pixels
from fingervision.frames.array_levels import COLOURS, levels_of, stated_shape, what_it_is
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
    times_s : iterable of float or None
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
    times_s: Iterable[float] | None = None
    coding: Coding = Coding.LOSSLESS
    description: Description = field(init=False)
    _times_s: tuple[float, ...] | None = field(init=False, repr=False)
    _stack: NDArray[np.generic] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        stack = stated_shape(self.pictures)
        _check_rate(self.rate_hz, self.times_s)
        times_s = None if self.times_s is None else _checked_times(self.times_s, len(stack))
        whole = hashlib.sha256(f"{stack.shape} {stack.dtype.str}".encode())
        for picture in stack:
            whole.update(np.ascontiguousarray(picture).data)
        object.__setattr__(self, "_times_s", times_s)
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
            yield Frame(levels_of(picture, None if is_single else index), index, self._time_s(index), self.coding)

    @property
    def has_float_levels(self) -> bool:
        """Whether the levels were given as floats, which are converted to 16-bit levels."""
        return bool(self.pictures.dtype.kind == "f")

    def _time_s(self, index: int) -> float | None:
        if self._times_s is not None:
            return self._times_s[index]
        return None if self.rate_hz is None else index / self.rate_hz


@dataclass(eq=False)
class PictureStream:
    """Pictures that an iterable yields one by one, as a recording; only one picture is in memory at a time.

    A list or another iterable that can be read again is a recording like any other. The pictures of a generator can be
    read only once.

    Parameters
    ----------
    pictures : iterable of ndarray, shape (height, width[, colours])
        Pictures of equal size, with levels as in `ArrayFrames`.
    rate_hz : float or None
        Pictures per second.
    times_s : iterable of float or None
        Time of every picture; strictly increasing.
    coding : Coding
        Compression that the pictures underwent before they were decoded.

    Raises
    ------
    ArgumentTypeError
        The first picture is not a numeric numpy array.
    ArgumentError
        There is no picture, or it has not the shape of a single picture.
    """

    pictures: Iterable[NDArray[np.generic]] = field(repr=False)
    rate_hz: float | None = None
    times_s: Iterable[float] | None = None
    coding: Coding = Coding.LOSSLESS
    description: Description = field(init=False)
    _times_s: tuple[float, ...] | None = field(init=False, repr=False)
    _read: Iterator[NDArray[np.generic]] | None = field(init=False, repr=False)
    _first: NDArray[np.generic] = field(init=False, repr=False)
    _is_once: bool = field(init=False, repr=False)

    def __post_init__(self) -> None:
        _check_rate(self.rate_hz, self.times_s)
        count = len(self.pictures) if isinstance(self.pictures, Sized) else None
        self._times_s = None if self.times_s is None else _checked_times(self.times_s, count)
        rest = iter(self.pictures)
        self._is_once = rest is self.pictures
        first = next(rest, None)
        if first is None:
            raise ArgumentError("source", "yield at least one picture", "yields none")
        self._first = _single(first, 0)
        self._read = chain([first], rest)
        self.description = Description(
            name="pictures",
            kind="pictures in memory",
            codec=str(first.dtype),
            coding=self.coding,
            width_px=int(self._first.shape[1]),
            height_px=int(self._first.shape[0]),
            rate_hz=self.rate_hz,
            has_times=self.rate_hz is not None or self._times_s is not None,
            frame_count=count,
        )

    def __iter__(self) -> Iterator[Frame | LostFrame]:
        """Yield the pictures as they come; each is checked and converted when it is yielded.

        Raises
        ------
        StateError
            The pictures come from a generator that was read before.
        ArgumentError
            A picture differs in size or type from the first, or has no time.
        """
        pictures, self._read = self._read, None
        if pictures is None:
            if self._is_once:
                raise StateError(
                    "The pictures of a generator can be read only once, and were read: give a list or an array to "
                    "look at the pictures again."
                )
            pictures = iter(self.pictures)
        for index, picture in enumerate(pictures):
            single = _single(picture, index)
            if single.shape != self._first.shape or single.dtype != self._first.dtype:
                must = f"yield pictures like the first ({self._first.dtype}, shape {self._first.shape})"
                found = f"picture {index} is {single.dtype} of shape {single.shape}"
                raise ArgumentError("source", must, found)
            # Copied, because frames are read ahead and a generator may use its array again for the next picture.
            levels = levels_of(single.copy(), index)
            yield Frame(levels, index, self._time_s(index), self.coding)
        if self._times_s is not None and len(self._times_s) != index + 1:
            found = f"{len(self._times_s)} are given"
            raise ArgumentError("times_s", f"be one number for each of the {index + 1} pictures", found)

    def __getstate__(self) -> dict[str, Any]:
        """State without what cannot be pickled: the pictures of a generator."""
        return {**self.__dict__, "_read": None} | ({"pictures": ()} if self._is_once else {})

    @property
    def has_float_levels(self) -> bool:
        """Whether the levels were given as floats, which are converted to 16-bit levels."""
        return bool(self._first.dtype.kind == "f")

    def _time_s(self, index: int) -> float | None:
        if self._times_s is None:
            return None if self.rate_hz is None else index / self.rate_hz
        if index >= len(self._times_s):
            raise ArgumentError("times_s", "have a time for every picture", f"ends before picture {index}")
        return self._times_s[index]


def _single(picture: Any, index: int) -> NDArray[np.generic]:
    """Check that something that was yielded is one picture, of shape (height, width) or (height, width, colours)."""
    if isinstance(picture, Frame | LostFrame):
        must = "have a `description` (a fingervision.Description) if it yields frames, or yield arrays"
        raise ArgumentTypeError("source", must, f"yields {what_it_is(picture)} and has none")
    stack = stated_shape(picture, "source" if index == 0 else f"source, picture {index},")
    if len(stack) > 1 or picture.ndim > 3:
        must = f"yield pictures of shape (height, width) or (height, width, {' or '.join(map(str, COLOURS))})"
        raise ArgumentError("source", must, f"picture {index} has shape {picture.shape}")
    return picture if picture.ndim == 2 else np.asarray(picture.reshape(stack.shape[1:]))


def _check_rate(rate_hz: float | None, times_s: Iterable[float] | None) -> None:
    if rate_hz is not None and times_s is not None:
        raise ArgumentError("rate_hz", "be left out if times_s is given", "both are given")
    if rate_hz is not None and not 0.0 < rate_hz < float("inf"):
        raise ArgumentError("rate_hz", "be positive", f"is {rate_hz:g}")


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


def _checked_times(times_s: Iterable[float], count: int | None) -> tuple[float, ...]:
    try:
        times = np.asarray(times_s if isinstance(times_s, Sized) else list(times_s), dtype=np.float64)
    except (TypeError, ValueError):
        raise ArgumentError("times_s", "be one number for each picture, in seconds", f"is {times_s!r}") from None
    if times.shape != (len(times) if count is None and times.ndim else count,):
        which = "each picture" if count is None else f"each of the {count} pictures"
        raise ArgumentError("times_s", f"be one number for {which}", f"has shape {times.shape}")
    if not np.all(np.isfinite(times)) or np.any(np.diff(times) <= 0.0):
        raise ArgumentError("times_s", "be finite and increase from picture to picture", "does not")
    return tuple(times.tolist())


__all__ = ["ArrayFrames", "KeptFrames", "PictureStream", "Pixels"]
