"""Errors that a user reads: one sentence that says what, what it must be, what it is, and what to do.

Whoever catches an error asks for its class, and for the facts that it carries; the wording may change with any version.

    FingervisionError                exit code 1
    ├── UsageError                   the request is wrong; exit code 2
    │   └── ArgumentError            one argument or option, also a ValueError
    │       ├── ArgumentTypeError    of the wrong kind, also a TypeError
    │       └── UnknownNameError     no such name, with the nearest one that there is
    ├── DataError                    a file or array does not hold what it must; also a ValueError
    ├── OutputError                  a result cannot be written; also an OSError
    └── MissingLibraryError          an optional library is not installed; also an ImportError
"""

from collections.abc import Iterable
from difflib import get_close_matches
from enum import IntEnum


class ExitCode(IntEnum):
    """How a command ended."""

    DONE = 0
    COULD_NOT = 1
    WRONG_USAGE = 2
    DAMAGED_INPUT = 3


class FingervisionError(Exception):
    """Something could not be done, for a reason that the message states in a sentence.

    The command line prints the message without a traceback and ends with `exit_code`.
    """

    exit_code = ExitCode.COULD_NOT


class UsageError(FingervisionError):
    """The request itself is wrong: an option or argument that cannot be meant."""

    exit_code = ExitCode.WRONG_USAGE


class ArgumentError(UsageError, ValueError):
    """One argument has a value that cannot be meant.

    Parameters
    ----------
    argument : str
        Its name in Python (`below_tip_mm`).
    must : str
        What it must be, as it follows the word "must".
    found : str
        What it is, as it follows the word "but".
    advice : str
        What to do; empty where that is plain.
    """

    def __init__(self, argument: str, must: str, found: str, advice: str = "") -> None:
        super().__init__(f"{argument} must {must}, but {found}{': ' + advice if advice else ''}.")
        self.argument, self.must, self.found, self.advice = argument, must, found, advice


class ArgumentTypeError(ArgumentError, TypeError):
    """One argument is of a kind that cannot be meant."""


class UnknownNameError(ArgumentError):
    """A name that there is not, with the nearest one that there is.

    Parameters
    ----------
    argument : str
        Name of the argument.
    name : str
        What was given.
    known : iterable of str
        The names that there are.
    what : str
        What they are names of, with its article.
    listing : str
        What to do where no name is near.
    """

    def __init__(self, argument: str, name: str, known: Iterable[str], what: str, listing: str = "") -> None:
        self.name, self.known = name, tuple(known)
        self.nearest = next(iter(get_close_matches(name, self.known, n=1)), None)
        advice = f"did you mean {self.nearest}?" if self.nearest else listing
        super().__init__(argument, f"be {what}", f"is {name!r}", advice)
        self.args = (self.args[0].replace("?.", "?"),)


class DataError(FingervisionError, ValueError):
    """A file or an array does not hold what it must."""


class OutputError(FingervisionError, OSError):
    """A result cannot be written."""


class MissingLibraryError(FingervisionError, ImportError):
    """A library that is an optional extra is not installed.

    Parameters
    ----------
    library : str
        Its name.
    extra : str
        The extra of this project that installs it.
    what : str
        What needs it.
    """

    def __init__(self, library: str, extra: str, what: str) -> None:
        self.library, self.extra = library, extra
        super().__init__(f"{what} needs {library}, which is not installed: pip install 'fingervision[{extra}]'.")
