"""Time scale of the live view: times of the source, joined across interruptions by the computer's clock."""

from fingervision.storage.recorded_video import TICKS_PER_S

# If the source's clock gains this time on the computer's clock between two frames, the source's clock has jumped.
JUMP_S = 1.0


class Timeline:
    """Converts times of a source to times since the start of the live view.

    Parameters
    ----------
    started_s : float
        Reading of the computer's monotonic clock at the start.
    """

    def __init__(self, started_s: float) -> None:
        self._started_s = started_s
        self._offset_s: float | None = None
        # Times of the last frame: on the source's clock, on the computer's clock, and as returned.
        self._last: tuple[float, float, float] | None = None

    def cut(self) -> None:
        """Record an interruption of the source, after which the source's clock may start again."""
        self._offset_s = None

    def at(self, source_s: float, arrived_s: float) -> tuple[float, float]:
        """Time of a frame since the start of the live view (s).

        Parameters
        ----------
        source_s : float
            Time of the frame by the clock of the source.
        arrived_s : float
            Time of arrival by the computer's clock.

        Returns
        -------
        time_s, jump_s : float
            Time since the start, a whole number of microseconds; jump of the source's clock, usually 0.
        """
        jump_s = 0.0
        if self._last is not None and self._offset_s is not None:
            step_s, host_step_s = source_s - self._last[0], arrived_s - self._last[1]
            if step_s < 0.0 or step_s - host_step_s > JUMP_S:
                jump_s = step_s - host_step_s
                self._offset_s = None
        if self._offset_s is None:
            begins_s = arrived_s - self._started_s
            if self._last is not None:
                # Times never decrease; after a jump, the computer's clock determines how much time has passed.
                begins_s = max(begins_s, self._last[2] + 1.0 / TICKS_PER_S)
            self._offset_s = begins_s - source_s
        time_s = round((source_s + self._offset_s) * TICKS_PER_S) / TICKS_PER_S
        self._last = (source_s, arrived_s, time_s)
        return time_s, jump_s

    def on_this(self, source_s: float) -> float:
        """Convert another time of the source, such as that of a packet, to the time since the live view's start."""
        return round((source_s + (self._offset_s or 0.0)) * TICKS_PER_S) / TICKS_PER_S
