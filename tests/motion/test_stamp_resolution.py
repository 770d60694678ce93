"""Rounded time stamps of a log: their resolution is part of the offset's uncertainty."""

import numpy as np

from fingervision.domain.drive import DriveHistory
from fingervision.motion.clock.alignment import find_clock_offset
from fingervision.motion.clock.clock_offset import ClockOffset

WINDOWS_TICK_S = 0.0156


def test_times_cut_off_at_the_tick_of_a_clock_widen_the_uncertainty():
    corners_s = [0.0, 1.0, 3.0, 4.0, 5.5, 6.0, 8.0, 9.0, 10.5, 12.0]
    corners_mm = [0.0, 0.0, 0.8, 0.8, 0.1, 0.1, 1.0, 0.3, 0.3, 0.0]
    film_s, log_s = np.arange(0.3, 11.5, 0.04), np.arange(0.0, 12.0, 0.05)
    gap = 2.0 + 7.5 * np.interp(film_s, corners_s, corners_mm)
    gap += np.random.default_rng(8).normal(0.0, 5e-4, gap.size)
    stamps_s = np.floor(log_s / WINDOWS_TICK_S) * WINDOWS_TICK_S
    found = find_clock_offset(film_s, gap, DriveHistory(stamps_s, np.interp(log_s, corners_s, corners_mm)))
    assert isinstance(found, ClockOffset)
    assert found.u_offset_s > WINDOWS_TICK_S / np.sqrt(12.0)
    assert abs(found.offset_s) < 2.0 * found.u_offset_s
