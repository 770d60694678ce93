"""Controls of a run (pause, continue, stop) by Ctrl-C, SIGTERM, or a letter on the terminal."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext

from fingervision.testbed.terminal import TERMINAL, handled, in_main_thread

PAUSE_LETTER, STOP_LETTER = "p", "q"


class Controls:
    """The user's commands during a run, given from any thread.

    The commands are plain flags, each set in one instruction, because a signal handler that waited for a lock would
    block the program that it interrupted.

    Attributes
    ----------
    stopped, paused : bool
        Whether the run should end, or wait.
    halted : bool
        Whether a pause has stopped the motor since the flag was last set to False.
    """

    def __init__(self) -> None:
        self.stopped = self.paused = self.halted = False
        self._stop_motor: Callable[[], None] = lambda: None

    @property
    def waits(self) -> bool:
        """Whether the run is paused at present."""
        return self.paused and not self.stopped

    def stop(self) -> None:
        """End the run; the motor is stopped at once."""
        self.stopped = True
        self._stop_motor()

    def toggle_pause(self) -> None:
        """Pause the run, which stops the motor at once, or continue it."""
        if self.paused:
            self.paused = False
            return
        self.halted = self.paused = True
        self._stop_motor()

    @contextmanager
    def listening(self, stop_motor: Callable[[], None]) -> Iterator[None]:
        """During a run, convert Ctrl-C and SIGTERM to a stop, and letters on the terminal to pauses.

        Parameters
        ----------
        stop_motor : callable
            Stops the motor at once, from a signal handler or another thread.
        """
        self._stop_motor = stop_motor
        keys = TERMINAL.listening(self._letter, lambda: self.stopped) if in_main_thread() else nullcontext()
        try:
            with handled(lambda number, frame: self.stop()), keys:
                yield
        finally:
            self._stop_motor = lambda: None

    def _letter(self, line: str) -> None:
        letter = line.strip().lower()
        if letter == PAUSE_LETTER:
            self.toggle_pause()
        elif letter == STOP_LETTER:
            self.stop()
