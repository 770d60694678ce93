"""Checks of single arguments: a number, a whole number, one of several words, a file's name."""

import os
from collections.abc import Iterable, Sized
from numbers import Integral, Real
from pathlib import Path

from fingervision.domain.errors import ArgumentError, ArgumentTypeError, UnknownNameError, UsageError


def number(argument: str, value: object) -> float:
    """Check that an argument is a number; its caller checks the range.

    Raises
    ------
    ArgumentTypeError
        The argument is not a number.
    """
    if isinstance(value, bool) or not isinstance(value, Real):
        raise ArgumentTypeError(argument, "be a number", f"is {value!r}")
    return float(value)


def whole_number(argument: str, value: object, least: int) -> int:
    """Check that an argument is a whole number not below `least`, and return it.

    Raises
    ------
    ArgumentTypeError
        The argument is not a whole number.
    ArgumentError
        The number is below `least`.
    """
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise ArgumentTypeError(argument, f"be a whole number from {least}", f"is {value!r}")
    if value < least:
        raise ArgumentError(argument, f"be a whole number from {least}", f"is {value}")
    return int(value)


def one_of(argument: str, value: object, words: Iterable[str]) -> str:
    """Check that an argument is one of several words, and return it.

    Raises
    ------
    ArgumentTypeError
        The argument is not a text.
    UnknownNameError
        The argument is not one of the allowed words; the message suggests the most similar word.
    """
    known = tuple(words)
    if isinstance(value, str) and value in known:
        return value
    listed = f"{', '.join(known[:-1])} or {known[-1]}" if len(known) > 1 else known[0]
    if not isinstance(value, str):
        raise ArgumentTypeError(argument, f"be {listed}", f"is {value!r}")
    raise UnknownNameError(argument, value, known, listed)


def path_of(argument: str, value: object, what: str) -> Path:
    """Check the name of a file or folder; `what` names its kind with its article, such as "a video".

    Raises
    ------
    ArgumentTypeError
        The argument is not the name of a file or folder.
    ArgumentError
        The name is empty.
    """
    from fingervision.frames.array_levels import what_it_is

    if not isinstance(value, str | os.PathLike):
        raise ArgumentTypeError(argument, f"be the name of {what}", f"is {what_it_is(value)}")
    name = os.fspath(value)
    if isinstance(name, bytes):
        name = os.fsdecode(name)
    if not name:
        raise ArgumentError(argument, f"be the name of {what}", "is empty")
    return Path(name)


def region_of(roi: object) -> tuple[int, int, int, int] | None:
    """Check a region of interest: first column, first row, width, height in pixels.

    Raises
    ------
    UsageError
        The region is not four whole numbers.
    """
    if roi is None:
        return None
    if isinstance(roi, str) or not isinstance(roi, Sized) or not isinstance(roi, Iterable) or len(roi) != 4:
        raise UsageError(f"--roi must be four whole numbers X,Y,W,H in pixels, but is {roi!r}.")
    x_px, y_px, width_px, height_px = (whole_number("roi", each, 0) for each in roi)
    return x_px, y_px, width_px, height_px


__all__ = ["number", "one_of", "path_of", "region_of", "whole_number"]
