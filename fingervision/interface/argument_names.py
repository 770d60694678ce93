"""Name an argument in an error as its caller does: `below_tip_mm` in Python, `--below-tip-mm` in a command."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from typing import ParamSpec, TypeVar

from fingervision.domain.errors import ArgumentError, FingervisionError, NoCalibrationError

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
    if not sentence.startswith(argument):
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


__all__ = ["command_words", "in_command", "in_python", "python_words", "speaks_python"]
