"""Conversion of a camera's clock to the clock of the test bed, from the arrival times of frames alone."""

import numpy as np
import pytest

from fingervision.testbed.camera import Latency
from fingervision.testbed.clocks.clock import ArrivalClock

LEAST_S, U_LEAST_S, MEAN_MORE_S = 0.008, 0.0005, 0.002
# Required uncertainty of times on the test bed, including that of the board.
JOINED_WITHIN_S = 0.002
OFFSET_S, RATE = -812.3, 1.0 + 30e-6


@pytest.mark.parametrize("seconds", [2.0, 60.0, 600.0])
def test_the_clock_is_joined_within_its_stated_uncertainty(seconds: float) -> None:
    rng = np.random.default_rng(3)
    clock = ArrivalClock(Latency(LEAST_S, U_LEAST_S))
    camera_s = np.arange(0.0, seconds, 0.04)
    true_s = OFFSET_S + RATE * camera_s
    for stamp_s, seen_s in zip(camera_s.tolist(), true_s.tolist(), strict=True):
        clock.add(stamp_s, seen_s + LEAST_S + MEAN_MORE_S * rng.standard_exponential())
    joined = clock.joined()
    assert joined.u_at(joined.board_s) >= U_LEAST_S
    assert joined.u_at(joined.board_s) < JOINED_WITHIN_S
    for stamp_s, seen_s in ((camera_s[-1], true_s[-1]), (camera_s[-25], true_s[-25])):
        assert joined.host_at(float(stamp_s)) == pytest.approx(seen_s, abs=2.0 * joined.u_at(joined.board_s))


def test_a_late_frame_changes_nothing() -> None:
    clock = ArrivalClock(Latency(LEAST_S, U_LEAST_S))
    for k in range(50):
        clock.add(0.04 * k, 100.0 + 0.04 * k + LEAST_S + 1e-4)
    before = clock.joined()
    clock.add(2.0, 102.0 + LEAST_S + 0.5)
    assert clock.joined() == before
