"""Print in a separate thread, so that a slow or missing reader delays neither measurement nor recording."""

import os
from contextlib import suppress
from queue import Empty, Full, Queue
from threading import Event
from typing import TextIO

from fingervision.live.supervisor import Supervisor

# Largest number of queued lines: ten minutes at 25 frames per second. Further lines are left out and counted.
LINES_WAITING = 15_000
# Longest time that a reader may take at the end for the queued lines.
PATIENCE_S = 2.0


class Outlet:
    """Prints text to one output stream in a separate thread.

    Parameters
    ----------
    stream : text stream or None
        Standard output or standard error; None if the stream was closed before the program began.
    supervisor : Supervisor
        Supervisor of the live view.
    waiting : int
        Largest number of queued lines.
    """

    def __init__(self, stream: TextIO | None, supervisor: Supervisor, waiting: int = LINES_WAITING) -> None:
        self.left_out = 0
        self.broken = stream is None
        """Whether the stream is closed, so that text cannot be printed any more."""
        self._stream = stream
        self._waiting: Queue[str] = Queue(waiting)
        self._ending = Event()
        self._thread = supervisor.start("Printing", self._print)

    def put(self, text: str) -> None:
        """Queue text for printing; never waits."""
        if self.broken:
            return
        try:
            self._waiting.put_nowait(text)
        except Full:
            self.left_out += 1

    def close(self) -> None:
        """Print the queued text, as far as the reader accepts it in time."""
        self._ending.set()
        self._thread.join(PATIENCE_S)
        if self._thread.is_alive():
            self.left_out += self._waiting.qsize()
            self.broken = True
        if self.broken:
            self._let_go()

    def _print(self) -> None:
        while not (self._ending.is_set() and self._waiting.empty()):
            try:
                text = self._waiting.get(timeout=0.1)
            except Empty:
                continue
            if self._stream is None:
                return
            try:
                self._stream.write(text)
                self._stream.flush()
            except (OSError, ValueError):
                self.broken = True
                return

    def _let_go(self) -> None:
        """Redirect the stream to the null device, so that Python neither fails nor waits at the final flush."""
        if self._stream is None:
            return
        with suppress(OSError, ValueError):
            nothing = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nothing, self._stream.fileno())
            os.close(nothing)
