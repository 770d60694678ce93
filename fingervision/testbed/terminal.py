"""Terminal input: responses to questions, single letters typed at any time, and Ctrl-C."""

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from queue import Empty, SimpleQueue
from types import FrameType
from typing import TextIO

from fingervision.domain.errors import StateError

LOOK_EVERY_S = 0.2


class Terminal:
    """Keyboard and screen of the person at the test bed.

    If two parts of the program read from the keyboard, each part would take lines that are meant for the other part.
    Therefore the terminal reads all lines: a line is the response to a question if one was asked, and otherwise a
    command of a single letter.

    Parameters
    ----------
    keyboard, screen : text streams, optional
        Standard input and standard error, if not given.
    """

    def __init__(self, keyboard: TextIO | None = None, screen: TextIO | None = None) -> None:
        self._keyboard, self._screen = keyboard, screen
        self._asked = False
        self._answers: SimpleQueue[str] = SimpleQueue()
        self._reader: threading.Thread | None = None
        self._unasked: Callable[[str], None] | None = None
        self._ended: Callable[[], bool] = lambda: False

    def ask(self, words: str) -> str | None:
        """Ask a question and wait for the response; None if nobody is at the keyboard.

        Raises
        ------
        StateError
            The run was stopped before the question was answered.
        """
        # Set the flag before the question is printed, because an answer may arrive at once.
        self._asked = self._reader is not None
        self.say(words)
        if self._reader is None:
            return (self._keyboard or sys.stdin).readline() or None
        while True:
            try:
                return self._answers.get(timeout=LOOK_EVERY_S) or None
            except Empty:
                if self._ended():
                    self._asked = False
                    raise StateError("The operator gave no answer before the run was stopped.") from None

    def say(self, words: str) -> None:
        """Write a sentence on the screen."""
        screen = self._screen or sys.stderr
        screen.write(words)
        screen.flush()

    @contextmanager
    def listening(self, unasked: Callable[[str], None], ended: Callable[[], bool]) -> Iterator[None]:
        """Within the `with` block, receive single letters too, if a person is at the keyboard.

        Parameters
        ----------
        unasked : callable
            Function that is called with each line that is not a response to a question.
        ended : callable
            Returns whether nobody waits for responses any more.
        """
        keyboard = self._keyboard or sys.stdin
        if keyboard is None or not keyboard.isatty():
            yield
            return
        self._unasked, self._ended = unasked, ended
        if self._reader is None:
            self._reader = threading.Thread(target=self._read, args=(keyboard,), name="keys", daemon=True)
            self._reader.start()
        try:
            yield
        finally:
            self._unasked, self._ended = None, lambda: False

    def _read(self, keyboard: TextIO) -> None:
        for line in keyboard:
            unasked = self._unasked
            if self._asked or unasked is None:
                self._asked = False
                self._answers.put(line)
            else:
                unasked(line)
        self._answers.put("")


TERMINAL = Terminal()


def in_main_thread() -> bool:
    """Whether this is the main thread, which alone receives signals."""
    return threading.current_thread() is threading.main_thread()


@contextmanager
def handled(note: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    """Within the `with` block, Ctrl-C and SIGTERM call a function, if this is the main thread."""
    before = {each: signal.signal(each, note) for each in (signal.SIGINT, signal.SIGTERM)} if in_main_thread() else {}
    try:
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
