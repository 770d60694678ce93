"""Checks of single arguments: a number, a whole number, one of several words, a file's name."""

import os
import re
from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from numbers import Integral, Real
from pathlib import Path
from typing import ParamSpec, TypeVar

from fingervision.domain.errors import (
    ArgumentError,
    ArgumentTypeError,
    FingervisionError,
    NoCalibrationError,
    UnknownNameError,
    UsageError,
)

# Name an argument in an error as its caller does: `below_tip_mm` in Python, `--below-tip-mm` in a command.


P = ParamSpec("P")
R = TypeVar("R")

OPTION = re.compile(r"`[^`]*`|--([a-z][a-z-]*)")
"""Matches a command in backticks, which is not changed, or an option."""
OF_OPTIONS = {"out": "folder", "with": "with_effects", "without": "without_effects"}
"""Names of arguments that differ from the names of their options."""
OF_ARGUMENTS = {
    **{argument: f"--{option}" for option, argument in OF_OPTIONS.items()},
    "source": "The recording",
    "measured": "The measured table",
    "path": "The file",
    "name": "The name",
    "effect": "The effect",
}
"""Words for an argument on the command line, if there is no option of the same name."""
_of_command: ContextVar[bool] = ContextVar("of_command", default=False)


def in_python(sentence: str) -> str:
    """Replace each option's name in a text by the argument's name: `below_tip_mm` for `--below-tip-mm`.

    Examples
    --------
    >>> in_python("--px-per-mm must be positive, but is -3.")
    'px_per_mm must be positive, but is -3.'
    """

    def name(found: re.Match[str]) -> str:
        option = found[1]
        return found[0] if option is None else OF_OPTIONS.get(option, option.replace("-", "_"))

    return OPTION.sub(name, sentence)


def in_command(error: ArgumentError) -> str:
    """Return an argument's error with the argument spelt as an option of the command line.

    Examples
    --------
    >>> in_command(ArgumentError("below_tip_mm", "be positive", "is -3"))
    '--below-tip-mm must be positive, but is -3.'
    """
    sentence, argument = str(error), error.argument
    # What is no option but a word of the command stands in its help in capital letters.
    if not sentence.startswith(argument) or argument.isupper():
        return sentence
    return OF_ARGUMENTS.get(argument, f"--{argument.replace('_', '-')}") + sentence.removeprefix(argument)


@contextmanager
def command_words() -> Iterator[None]:
    """Within the `with` block, errors name arguments as the options of a command."""
    before = _of_command.set(True)
    try:
        yield
    except ArgumentError as error:
        error.args = (in_command(error), *error.args[1:])
        raise
    finally:
        _of_command.reset(before)


@contextmanager
def python_words() -> Iterator[None]:
    """Within the `with` block, errors of fingervision and calib name arguments as a Python call does."""
    from calib.errors import CalibrationError

    try:
        yield
    except CalibrationError as error:
        said = str(error) if _of_command.get() else in_python(str(error))
        raise NoCalibrationError(said) from error
    except FingervisionError as error:
        if not _of_command.get():
            error.args = (in_python(str(error)), *error.args[1:])
        raise


def speaks_python(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate a public function so that its errors name arguments as in Python; see `python_words`."""

    @wraps(function)
    def called(*args: P.args, **kwargs: P.kwargs) -> R:
        with python_words():
            return function(*args, **kwargs)

    return called


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
