"""Task and outcome of a worker, as sent between processes and machines."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from fingervision.batch.digest import Digest


@dataclass(frozen=True, slots=True)
class Task:
    """One input to be processed by one command.

    Parameters
    ----------
    command : str
        `measure` or `diagnose`.
    input : str
        As the user named it.
    arguments : tuple of str
        The command's options, as on a command line; without input and --out.
    folder : Path
        Where the result shall be.
    options_key : str
        Hash of everything but the input that decides the result: options, the files that they name, the version.
    """

    command: str
    input: str
    arguments: tuple[str, ...]
    folder: Path
    options_key: str


@dataclass(frozen=True, slots=True)
class Ended:
    """How a command ended.

    Parameters
    ----------
    exit_code : int
        As the command line would end with.
    words : str
        Its sentence; empty where all went well.
    finished : bool
        Whether it came to its end, so that its files are the result, also where they hold no number.
    disk_full : bool
        Whether it could not go on for want of room.
    """

    exit_code: int
    words: str
    finished: bool
    disk_full: bool = False


Perform = Callable[[str, tuple[str, ...]], Ended]


@dataclass(frozen=True, slots=True)
class Outcome:
    """Result for one input.

    Parameters
    ----------
    input : str
        As the user named it.
    folder : Path or None
        Where its result is; None where there is none.
    exit_code : int
        0, or 3 where the input was damaged, or 1 or 2 where it could not be done.
    words : str
        Its sentence; empty where all went well.
    digest : Digest or None
        Its line of the table and its small picture.
    seconds : float
        Time that it took, hashing included.
    disk_full : bool
        Whether there was no room for the result.
    kept : bool
        Whether the result was there already.
    """

    input: str
    folder: Path | None
    exit_code: int
    words: str
    digest: Digest | None
    seconds: float
    disk_full: bool = False
    kept: bool = False


def failure(task: Task, words: str, seconds: float = 0.0, exit_code: int = 1, *, disk_full: bool = False) -> Outcome:
    """Return the outcome of an input without a result."""
    return Outcome(task.input, None, exit_code, words, None, seconds, disk_full)
