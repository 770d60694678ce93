"""Pause, go on, stop: by Ctrl-C, by a request to terminate, or by a letter on the terminal."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event
from types import FrameType

from fingervision.testbed.terminal import TERMINAL

PAUSE_LETTER, STOP_LETTER = "p", "q"


class Controls:
    """What the user wants, from any thread.

    Attributes
    ----------
    stopped, paused : threading.Event
        Whether the run shall end, or wait.
    """

    def __init__(self) -> None:
        self.stopped = Event()
        self.paused = Event()
        self._stop_motor: Callable[[], None] | None = None

    def stop(self) -> None:
        """End the run; the motor stops first."""
        if self._stop_motor is not None:
            self._stop_motor()
        self.stopped.set()

    def toggle_pause(self) -> None:
        """Pause, or go on."""
        if self.paused.is_set():
            self.paused.clear()
        else:
            if self._stop_motor is not None:
                self._stop_motor()
            self.paused.set()

    @contextmanager
    def listening(self, stop_motor: Callable[[], None]) -> Iterator[None]:
        """Turn Ctrl-C and SIGTERM into a stop while a run is under way, and letters on a terminal into pauses.

        Parameters
        ----------
        stop_motor : callable
            Stops the motor at once, from a signal handler.
        """
        self._stop_motor = stop_motor

        def note(number: int, frame: FrameType | None) -> None:
            self.stop()

        before = {each: signal.signal(each, note) for each in (signal.SIGINT, signal.SIGTERM)}
        try:
            with TERMINAL.listening(self._letter, self.stopped.is_set):
                yield
        finally:
            for each, handler in before.items():
                signal.signal(each, handler)
            self._stop_motor = None

    def _letter(self, line: str) -> None:
        letter = line.strip().lower()
        if letter == PAUSE_LETTER:
            self.toggle_pause()
        elif letter == STOP_LETTER:
            self.stop()
