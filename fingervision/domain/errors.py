"""Errors that a user reads: one sentence that says what, what it must be, what it is, and what to do."""

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
