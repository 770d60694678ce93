"""Errors for users: each message says in one sentence what is wrong, what is expected, what was found, and what to do.

Programs that catch an error should rely on its class and attributes; the wording of messages may change with any
version.

    FingervisionError                exit code 1
    ├── UsageError                   the request is wrong; exit code 2
    │   └── ArgumentError            one argument or option, also a ValueError
    │       ├── ArgumentTypeError    of the wrong kind, also a TypeError
    │       └── UnknownNameError     an unknown name; the message gives the nearest known name; also a KeyError
    ├── InputFileError               a file or folder cannot be found or read; also an OSError
    ├── DataError                    the content of a file, recording or array is not valid; also a ValueError
    ├── OutputError                  a result cannot be written; also an OSError
    ├── NoCalibrationError           pictures of known sizes give no calibration; also a ValueError
    ├── ModelError                   a model of the mechanism has no solution
    ├── DeviceError                  a camera, stage, board or sensor fails or does not respond
    ├── LimitError                   a motion beyond the limits of the test bed or device
    ├── StateError                   not possible in the present state (busy, recording, position unknown)
    ├── ProcessError                 a worker process, cluster or server cannot be started or was lost
    ├── InstallationError            a part of fingervision itself is missing
    │   └── MissingLibraryError      an optional library is not installed; also an ImportError
    └── PluginError                  a plug-in cannot be used; its classes are in `fingervision.plugins.faults`
"""

import re
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from enum import IntEnum
from textwrap import shorten
from typing import Any

MOST_LETTERS = 300
"""Length to which the message of another library is shortened within a sentence."""


class ExitCode(IntEnum):
    """Exit code of a command, which tells a calling program how the command ended."""

    DONE = 0
    COULD_NOT = 1
    WRONG_USAGE = 2
    DAMAGED_INPUT = 3


class FingervisionError(Exception):
    """An operation could not be done; the message states the reason in one sentence.

    The command line prints the message without a traceback and ends with `exit_code`.

    Examples
    --------
    >>> import fingervision as fv
    >>> try:
    ...     fv.measure("no_such_file.mp4", px_per_mm=34.0)
    ... except fv.FingervisionError as error:
    ...     print(type(error).__name__, isinstance(error, OSError))
    InputFileError True
    """

    exit_code = ExitCode.COULD_NOT

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how a pickle makes the error: from its message, because some are made of other arguments."""
        return _again, (type(self), self.args, vars(self))


def _again(kind: type[Exception], args: tuple[Any, ...], held: Mapping[str, Any]) -> Exception:
    error = kind.__new__(kind, *args)
    error.args = args
    vars(error).update(held)
    return error


class UsageError(FingervisionError):
    """The request itself is wrong: an option or argument has a value that makes no sense."""

    exit_code = ExitCode.WRONG_USAGE


class ArgumentError(UsageError, ValueError):
    """One argument has a value that is not allowed.

    Parameters
    ----------
    argument : str
        Name of the argument in Python (`below_tip_mm`).
    must : str
        Condition that the value must meet, worded to follow the word "must".
    found : str
        The value that was found, worded to follow the word "but".
    advice : str
        Advice on what to do; empty if that is obvious.
    """

    def __init__(self, argument: str, must: str, found: str, advice: str = "") -> None:
        super().__init__(f"{argument} must {must}, but {found}{': ' + advice if advice else ''}.")
        self.argument, self.must, self.found, self.advice = argument, must, found, advice


class ArgumentTypeError(ArgumentError, TypeError):
    """One argument is of a type that is not accepted."""


class UnknownNameError(ArgumentError, KeyError):
    """A name is unknown; the message gives the nearest known name.

    Parameters
    ----------
    argument : str
        Name of the argument.
    name : str
        The unknown name that was given.
    known : iterable of str
        All known names.
    what : str
        Kind of thing that the names denote, with an article.
    listing : str
        Advice if no known name is similar.
    """

    def __init__(self, argument: str, name: str, known: Iterable[str], what: str, listing: str = "") -> None:
        self.name, self.known = name, tuple(known)
        self.nearest = next(iter(get_close_matches(name, self.known, n=1)), None)
        advice = f"did you mean {self.nearest}?" if self.nearest else listing
        super().__init__(argument, f"be {what}", f"is {name!r}", advice)
        self.args = (self.args[0].replace("?.", "?"),)

    def __str__(self) -> str:
        # That of a KeyError would be in quotation marks.
        return str(self.args[0])


class InputFileError(FingervisionError, OSError):
    """An input file or folder cannot be found or opened."""


class DataError(FingervisionError, ValueError):
    """A file, a recording or an array can be read, but its content is not valid."""


def unreadable(error: Exception) -> type[InputFileError] | type[DataError]:
    """Choose the error class for a file that could not be read: the system refused access, or the content is wrong.

    Examples
    --------
    >>> unreadable(PermissionError()).__name__, unreadable(UnicodeError()).__name__
    ('InputFileError', 'DataError')
    """
    return InputFileError if isinstance(error, OSError) else DataError


class OutputError(FingervisionError, OSError):
    """A result cannot be written: the disk is full, permission is missing, or another file is in the way."""


class NoCalibrationError(FingervisionError, ValueError):
    """The pictures of objects of known size give no calibration."""


class ModelError(FingervisionError):
    """A model of the mechanism has no solution: no equilibrium, no mesh, or a body that can move freely."""


class DeviceError(FingervisionError):
    """A camera, stream, stage, board or sensor does not answer, has an alarm, or fails."""


class LimitError(FingervisionError):
    """A motion goes beyond the limits of the test bed or of the device."""


class StateError(FingervisionError):
    """The request is valid, but not in the present state, such as during a recording or a motion."""


class ProcessError(FingervisionError):
    """A worker process, a cluster or the web server of the browser page cannot be started, or was lost."""


class InstallationError(FingervisionError):
    """A part of this installation of fingervision is missing."""


class MissingLibraryError(InstallationError, ImportError):
    """A library that is an optional extra is not installed.

    Parameters
    ----------
    library : str
        Name of the library.
    extra : str
        The extra of this project that installs it.
    what : str
        The part of fingervision that needs the library.
    instead : str
        What to do without the library, worded to follow "or"; empty if there is no alternative.
    """

    def __init__(self, library: str, extra: str, what: str, instead: str = "") -> None:
        self.library, self.extra = library, extra
        advice = f"pip install 'fingervision[{extra}]'" + (f", or {instead}" if instead else "")
        super().__init__(f"{what} needs {library}, which is not installed: {advice}.")


def error_words(error: BaseException) -> str:
    r"""Message of an error within a sentence, without its full stop; that of a library in one line, after its class.

    Examples
    --------
    >>> error_words(OSError("No device\n\t* check its cable\n"))
    'OSError: No device; check its cable'
    """
    if isinstance(error, FingervisionError):
        return str(error).rstrip(".")
    listed = re.sub(r"\s*\n\s*[*-]\s+", "; ", f"{type(error).__name__}: {error}")
    return shorten(listed, MOST_LETTERS, placeholder=" ...").rstrip(" .:")
