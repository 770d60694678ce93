"""Errors in the words of a Python call: an argument's name where the command line's sentence names its option."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import ParamSpec, TypeVar

from fingervision.domain.errors import FingervisionError

P = ParamSpec("P")
R = TypeVar("R")

OPTION = re.compile(r"`[^`]*`|--([a-z][a-z-]*)")
"""A command in backticks, which stays as it is, or an option."""
OTHER_NAMES = {"out": "folder", "with": "with_effects", "without": "without_effects", "model": "model", "o": "path"}


def in_python(sentence: str) -> str:
    """Put an argument's name in the place of each option: `below_tip_mm` for `--below-tip-mm`.

    Examples
    --------
    >>> in_python("--px-per-mm must be positive, but is -3.")
    'px_per_mm must be positive, but is -3.'
    """

    def name(found: re.Match[str]) -> str:
        option = found[1]
        return found[0] if option is None else OTHER_NAMES.get(option, option.replace("-", "_"))

    return OPTION.sub(name, sentence)


@contextmanager
def python_words() -> Iterator[None]:
    """Let the errors of this project, and those of calib, leave a block in the words of a Python call."""
    from calib.errors import CalibrationError

    try:
        yield
    except CalibrationError as error:
        raise FingervisionError(in_python(str(error))) from error
    except FingervisionError as error:
        error.args = (in_python(str(error)), *error.args[1:])
        raise


def speaks_python(function: Callable[P, R]) -> Callable[P, R]:
    """Give a public function errors that name its arguments; see `python_words`."""

    @wraps(function)
    def called(*args: P.args, **kwargs: P.kwargs) -> R:
        with python_words():
            return function(*args, **kwargs)

    return called


__all__ = ["in_python", "python_words", "speaks_python"]
