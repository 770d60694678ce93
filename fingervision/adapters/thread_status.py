"""Status of work in a thread, following bluesky.protocols.Status: done, callbacks, exception."""

import threading
from collections.abc import Callable


class ThreadStatus:
    """Status of work in a thread; done when the thread has ended.

    Parameters
    ----------
    work : callable
        Function that does the work; the status reports an exception that it raises.
    """

    def __init__(self, work: Callable[[], None]) -> None:
        self._ended, self._lock = threading.Event(), threading.Lock()
        self._callbacks: list[Callable[[ThreadStatus], None]] = []
        self._error: BaseException | None = None

        def run() -> None:
            try:
                work()
            except BaseException as error:
                self._error = error
            with self._lock:
                self._ended.set()
                callbacks = list(self._callbacks)
            for callback in callbacks:
                callback(self)

        threading.Thread(target=run, name="fingervision-bluesky", daemon=True).start()

    @property
    def done(self) -> bool:
        """Whether the work in the thread has ended."""
        return self._ended.is_set()

    @property
    def success(self) -> bool:
        """Whether the work in the thread has ended without an error."""
        return self.done and self._error is None

    def exception(self, timeout: float | None = 0.0) -> BaseException | None:
        """Wait until the thread has ended; return the exception that it raised, if any, or raise TimeoutError."""
        if not self._ended.wait(timeout):
            raise TimeoutError
        return self._error

    def add_callback(self, callback: Callable[["ThreadStatus"], None]) -> None:
        """Call `callback` when the thread has ended; immediately if it already has."""
        with self._lock:
            if not self._ended.is_set():
                self._callbacks.append(callback)
                return
        callback(self)
