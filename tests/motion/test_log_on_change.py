"""A log with rows on change only: the stage rests between its motions, and does not creep across the rest."""

from itertools import pairwise

import numpy as np
import pytest

from fingervision.domain.drive import DriveHistory
from fingervision.motion.clock.alignment import find_clock_offset
from fingervision.motion.clock.clock_offset import ClockOffset
from fingervision.motion.log_on_change import with_rests

SIGMAS = 3.5
HEIGHTS = (0.0, 0.1, 0.2, 0.05, 0.3, 0.15, 0.4, 0.25, 0.1)


def stairs(rate_hz):
    """A stage that moves at 0.5 mm/s from one rest to the next; times in s, positions in mm."""
    corners = [(0.0, HEIGHTS[0])]
    for k, (a, b) in enumerate(pairwise(HEIGHTS)):
        begin = corners[-1][0] + 0.9 + 0.13 * (k % 3)
        corners += [(begin, a), (begin + abs(b - a) / 0.5, b)]
    at_s, at_mm = np.array([*corners, (corners[-1][0] + 1.0, HEIGHTS[-1])]).T
    time_s = np.arange(0.0, at_s[-1], 1.0 / rate_hz)
    return time_s, np.interp(time_s, at_s, at_mm)


def test_the_offset_and_the_input_of_a_log_on_change_are_right():
    time_s, truth_mm = stairs(1000.0)
    polled_s, polled_mm = stairs(20.0)
    written = np.insert(np.diff(np.round(polled_mm, 4)) != 0.0, 0, True)
    log, rests = with_rests(DriveHistory(polled_s[written], np.round(polled_mm, 4)[written]))
    assert rests >= 7
    # In the middle of each rest, where the log has no row, the position is that of the rest.
    inside = (time_s > log.time_s[0]) & (time_s < log.time_s[-1])
    assert np.max(np.abs(np.interp(time_s, log.time_s, log.input_mm) - truth_mm)[inside]) < 0.5 * 0.05
    film_s = np.arange(0.3, polled_s[-1] - 0.5, 0.03)
    gap = 2.0 + 7.5 * np.interp(film_s, time_s, truth_mm) + np.random.default_rng(5).normal(0.0, 5e-4, film_s.size)
    found = find_clock_offset(film_s + 12.5, gap, log)
    assert isinstance(found, ClockOffset)
    assert abs(found.offset_s - 12.5) < SIGMAS * found.u_offset_s
    assert found.u_offset_s < 5e-3


@pytest.mark.parametrize("kind", ["polled", "rows missing in a motion", "corners of a motion", "with a force"])
def test_other_logs_stay_as_they_are(kind):
    time_s, input_mm = stairs(20.0)
    force = None
    if kind == "rows missing in a motion":
        input_mm = 0.4 * np.sin(0.7 * time_s)
        kept = (time_s < 1.0) | (time_s > 1.4)
        time_s, input_mm = time_s[kept], input_mm[kept]
    if kind == "corners of a motion":  # slow there, fast back
        time_s = np.cumsum(np.tile([10.0, 1.0, 1.0], 10))
        input_mm = np.tile([1.0, 0.0, 0.5, 1.5, 0.0, 1.0], 5)
    if kind == "with a force":
        changed = np.insert(np.diff(input_mm) != 0.0, 0, True)
        time_s, input_mm = time_s[changed], input_mm[changed]
        force = np.zeros(time_s.size)
    log = DriveHistory(time_s, input_mm, None, force)
    assert with_rests(log) == (log, 0)
