"""The virtual clock with a pace: several threads share it, as the devices of bluesky do."""

import threading
from time import monotonic

import numpy as np

from fingervision.testbed.clocks.clock import VirtualClock


def test_what_one_thread_waits_for_is_not_yet_the_time_of_another() -> None:
    clock = VirtualClock(pace=1.0)
    clock.wait_until(0.001)
    long_wait = threading.Thread(target=clock.wait_until, args=(0.5,))
    long_wait.start()
    seen_s = []
    while long_wait.is_alive():
        seen_s.append(clock.now_s())
        clock.wait_until(clock.now_s() + 0.01)
    assert np.diff(seen_s).max() < 0.1  # in steps of its own wait, not in one leap to the end of the other's
    assert clock.now_s() >= 0.5


def test_without_a_pace_a_wait_takes_no_time() -> None:
    clock, began_s = VirtualClock(), monotonic()
    clock.wait_until(1000.0)
    clock.wait_until(10.0)
    assert clock.now_s() == 1000.0
    assert monotonic() - began_s < 100.0
