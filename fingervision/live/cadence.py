"""Regularity of the frame times: rate, jitter, and missing frames."""

from collections import deque
from itertools import pairwise
from math import fsum, sqrt
from threading import RLock

import numpy as np

# Number of the most recent frames from which rate and jitter are computed.
FRAMES_LOOKED_AT = 100
# A delay is counted as missing frames only if this many consecutive frames are late: a network may delay a few frames
# and then deliver them in quick succession.
FRAMES_UNTIL_SURE = 5
# A frame is missing if the following frames are permanently later than this share of a period.
LATE_SHARE = 0.75
FRAMES_TO_KNOW_THE_PERIOD = 10
# A frame that follows its predecessor within this share of a period was delayed; missing frames are not judged by it.
HURRY_SHARE = 0.5
# The period is the median duration of strides of 25 frames, among the last 250 frames, divided by 25. Delayed and
# missing frames then have little influence; the mean of the shorter intervals would be biased where many frames are
# slightly late.
FRAMES_A_STRIDE, FRAMES_FOR_THE_PERIOD = 25, 250
# Share of a lateness without missing frames by which the expected times are corrected. The period has a small error,
# which would otherwise accumulate.
FORGIVEN_SHARE = 0.02


class Cadence:
    """Statistics of frame times; one thread adds times, and any thread may read the result."""

    def __init__(self) -> None:
        self._lock = RLock()
        self.missing = 0
        self._times_s: deque[float] = deque(maxlen=FRAMES_LOOKED_AT)
        self._long_s: deque[float] = deque(maxlen=FRAMES_FOR_THE_PERIOD)
        self._lateness_s: deque[float] = deque(maxlen=FRAMES_UNTIL_SURE)
        self._due_s: float | None = None
        self._period_s: float | None = None

    def restart(self) -> None:
        """Discard the times before an interruption, which is not counted as missing frames."""
        with self._lock:
            self._times_s.clear()
            self._long_s.clear()
            self._lateness_s.clear()
            self._due_s = self._period_s = None

    def add(self, time_s: float) -> None:
        """Add the time of a frame to the statistics."""
        with self._lock:
            self._add(time_s)

    def _add(self, time_s: float) -> None:
        self._times_s.append(time_s)
        self._long_s.append(time_s)
        self._period_s = self._median_s()
        if len(self._times_s) < FRAMES_TO_KNOW_THE_PERIOD:
            return
        period_s = self._period_s
        if period_s is None:
            return
        self._due_s = time_s if self._due_s is None else self._due_s + period_s
        if time_s < self._due_s:
            # The frame is earlier than expected: frames that were counted as missing were only delayed.
            self.missing = max(0, self.missing - round((self._due_s - time_s) / period_s))
            self._due_s = time_s
            self._lateness_s.clear()
        elif self._times_s[-1] - self._times_s[-2] < HURRY_SHARE * period_s:
            self._lateness_s.clear()
        late_s = time_s - self._due_s
        self._lateness_s.append(late_s)
        if late_s < LATE_SHARE * period_s:
            self._due_s += FORGIVEN_SHARE * late_s
        if len(self._lateness_s) < FRAMES_UNTIL_SURE:
            return
        late_s = min(self._lateness_s)
        if late_s > LATE_SHARE * period_s:
            missing = round(late_s / period_s)
            self.missing += missing
            self._due_s += missing * period_s
            self._lateness_s.clear()

    @property
    def period_s(self) -> float | None:
        """Median time between frames (s); None until it is known."""
        return self._period_s

    def _median_s(self) -> float | None:
        times_s = np.array(self._long_s)
        stride = min(FRAMES_A_STRIDE, times_s.size // 2)
        if stride < 1:
            return None
        usual_s = float(np.median(times_s[stride:] - times_s[:-stride])) / stride
        return usual_s if usual_s > 0.0 else None

    @property
    def rate_hz(self) -> float | None:
        """Frame rate over the last hundred frames (Hz)."""
        times = self._last_hundred()
        if len(times) < 2 or times[-1] <= times[0]:
            return None
        return (len(times) - 1) / (times[-1] - times[0])

    @property
    def jitter_s(self) -> float | None:
        """Standard deviation of the time between frames (s), over the last hundred frames."""
        steps = [after - before for before, after in pairwise(self._last_hundred())]
        if len(steps) < 2:
            return None
        # This is computed for every picture; the exact `statistics.pstdev` would take a millisecond.
        mean_s = fsum(steps) / len(steps)
        return sqrt(fsum((step - mean_s) ** 2 for step in steps) / len(steps))

    def _last_hundred(self) -> tuple[float, ...]:
        with self._lock:
            return tuple(self._times_s)
