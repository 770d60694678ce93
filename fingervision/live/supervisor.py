"""One supervisor of all threads and tasks of a live view: an error in any of them becomes an alarm.

Decision: no part of the live view catches unexpected errors itself. Each thread is started by the supervisor of its
view, and each task that is done again and again (a row, a picture, a state, a request) is watched by it. What failed is
then known to the page (an alarm, and nothing green), to the terminal (a sentence) and to the calling program (exit code
1), and the other parts go on.
"""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Lock, Thread
from typing import Any

from fingervision.domain.errors import FingervisionError

# Thread priority for the measurement on a computer that is busy with other programs.


# Longest time that a thread waits for Python's global interpreter lock when it returns from compiled code. The
# measurement returns many times per frame, so that Python's default of 5 ms would add up to several frames while a page
# is drawn.
SWITCH_S = 0.0005
# Higher priority than that of a user's programs, but lower than that of the system's processes.
NICENESS = -10


def be_prompt() -> None:
    """Raise the priority of the calling thread, and of threads that it starts, so that frames are measured on time.

    All threads that run Python code should call this function, because a thread that waits for Python's global
    interpreter lock is delayed by the thread that has the lock. The priority is raised only for users with permission
    (root, or a limit set with ulimit -e).
    """
    sys.setswitchinterval(SWITCH_S)
    with suppress(AttributeError, OSError):
        os.setpriority(os.PRIO_PROCESS, 0, NICENESS)  # on Linux, process 0 means the calling thread


FAILED = "failed"
"""Name of the messages about failed parts."""
MOST_LETTERS = 300
"""Largest length of the text of an unexpected error in an alarm."""

Say = Callable[[str, str], None]


class Supervisor:
    """Starts and watches the parts of one live view, and keeps the alarms of those that failed.

    Parameters
    ----------
    say : callable
        Function that sends a message (its name and a sentence) to the page and the terminal.
    """

    def __init__(self, say: Say) -> None:
        self._say = say
        self._alarms: dict[str, str] = {}
        self._lock = Lock()

    @property
    def trouble(self) -> str:
        """All present alarms; empty if no part has failed."""
        with self._lock:
            return " ".join(dict.fromkeys(self._alarms.values()))

    def trouble_of(self, part: str) -> str:
        """The alarm of one part; empty if it has not failed."""
        return self._alarms.get(part, "")

    def alarm(self, part: str, words: str) -> None:
        """Raise the alarm of a part; the sentence is told once."""
        with self._lock:
            is_new = words not in self._alarms.values()
            self._alarms[part] = words
        if is_new:
            self._say(FAILED, words)

    def clear(self, part: str) -> None:
        """End the alarm of a part that works again."""
        with self._lock:
            self._alarms.pop(part, None)

    def start(self, part: str, work: Callable[[], None], failed: Callable[[str], None] | None = None) -> Thread:
        """Run a part in a thread of its own.

        Parameters
        ----------
        part : str
            Name of the part, worded to precede "has failed".
        work : callable
            The part.
        failed : callable, optional
            Function that brings the part to an orderly end after an error; it gets the sentence of the alarm.
        """
        self.clear(part)

        def run() -> None:
            be_prompt()
            try:
                work()
            except (Exception, SystemExit) as error:
                words = sentence(part, error)
                self.alarm(part, words)
                if failed is not None:
                    with self.watching(f"The end of: {part}"):
                        failed(words)

        thread = Thread(target=run, name=part, daemon=True)
        thread.start()
        return thread

    @contextmanager
    def watching(self, part: str) -> Iterator[None]:
        """Within the `with` block, an error becomes an alarm, which ends when the block succeeds the next time."""
        try:
            yield
        except Exception as error:
            self.alarm(part, sentence(part, error))
        else:
            self.clear(part)

    def guarded(self, part: str, act: Callable[..., None]) -> Callable[..., None]:
        """Return a function that calls `act` until `act` fails, which raises the alarm."""

        def act_until_failed(*arguments: Any) -> None:
            if not self.trouble_of(part):
                with self.watching(part):
                    act(*arguments)

        return act_until_failed


def sentence(part: str, error: BaseException) -> str:
    """State an error in a sentence; an unexpected error with its type, and with the part that it ended."""
    if isinstance(error, FingervisionError):
        return str(error)
    return f"{part} has failed ({told(error)}): start the live view again."


def told(error: BaseException) -> str:
    """Text of an error within a sentence; for an unexpected error with its type, on one line."""
    if isinstance(error, FingervisionError):
        return str(error)
    return " ".join(f"{type(error).__name__}: {error}".split())[:MOST_LETTERS]
