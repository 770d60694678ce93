"""Ctrl-C as a question between two frames: nothing is broken off in the middle, neither a row nor compiled code."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def asked_to_stop() -> Iterator[threading.Event]:
    """Note a first Ctrl-C instead of raising it; a second one is raised as ever.

    Where the signal is not for us (another thread than the main one, or a worker that leaves it to its parent), nothing
    is noted.

    Yields
    ------
    threading.Event
        Set from the first Ctrl-C on.
    """
    asked = threading.Event()
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield asked
        return

    def note(number: int, frame: FrameType | None) -> None:
        signal.signal(signal.SIGINT, before)
        asked.set()

    signal.signal(signal.SIGINT, note)
    try:
        yield asked
    finally:
        signal.signal(signal.SIGINT, before)
