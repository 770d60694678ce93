"""Handle Ctrl-C and SIGTERM between two frames, so that no row of the table is incomplete."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def asked_to_stop() -> Iterator[threading.Event]:
    """Record the first Ctrl-C or SIGTERM instead of raising it; a second signal is raised as usual.

    Signals are not recorded outside the main thread, nor in a worker process, whose parent process handles them.

    Yields
    ------
    threading.Event
        Event that is set by the first Ctrl-C or SIGTERM.
    """
    asked = threading.Event()
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    if threading.current_thread() is not threading.main_thread() or not callable(before[signal.SIGINT]):
        yield asked
        return

    def note(number: int, frame: FrameType | None) -> None:
        restore()
        asked.set()

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    for number in before:
        signal.signal(number, note)
    try:
        yield asked
    finally:
        restore()
