"""The board's clock converted to the host's clock: the times are correct within their stated uncertainty."""

import numpy as np
import pytest

from fingervision.testbed.clocks.clock import FEWEST, ClockJoin, JoinedClock

BEGAN_S, RATE = 5000.0, 1.004
ASK_EVERY_S = 0.02


def joined(rng: np.random.Generator, seconds: float, *, least_s: float = 3e-4, mean_s: float = 2e-3) -> JoinedClock:
    """Converted clock from message exchanges; the delay of each message is random above a minimum."""
    join = ClockJoin()
    for board_s in np.arange(0.0, seconds, ASK_EVERY_S):
        there_s, back_s = least_s + rng.exponential(mean_s, 2)
        true_s = BEGAN_S + RATE * board_s
        join.add(board_s, true_s - there_s, true_s + back_s)
    clock = join.joined()
    assert clock is not None
    return clock


def test_the_truth_lies_within_the_bounds_and_within_two_milliseconds() -> None:
    rng = np.random.default_rng(7)
    for _ in range(50):
        clock = joined(rng, 5.0)
        for board_s in (0.0, 2.5, 5.0):
            true_s = BEGAN_S + RATE * board_s
            low_s, high_s = clock.bounds_at(board_s)
            assert low_s <= true_s <= high_s
            assert abs(clock.host_at(board_s) - true_s) < 2e-3


def test_the_stated_uncertainty_covers() -> None:
    """A uniform distribution lies within 1 u in 58 % of cases and always within 2 u; the bounds are wider."""
    rng = np.random.default_rng(8)
    clocks = [joined(rng, 3.0) for _ in range(200)]
    within = [abs(each.host_at(3.0) - BEGAN_S - RATE * 3.0) <= each.u_at(3.0) for each in clocks]
    assert np.mean(within) >= 0.58


def test_the_rate_is_found_within_its_uncertainty() -> None:
    rng = np.random.default_rng(9)
    clocks = [joined(rng, 20.0) for _ in range(50)]
    assert all(abs(each.rate - RATE) <= 4.0 * each.u_rate for each in clocks)
    assert max(each.u_rate for each in clocks) < 2e-5


def test_before_the_rate_is_known_it_is_taken_as_one_with_that_uncertainty() -> None:
    clock = joined(np.random.default_rng(1), FEWEST * ASK_EVERY_S)
    assert clock.rate == 1.0
    assert abs(RATE - 1.0) <= 2.0 * clock.u_rate


def test_too_few_exchanges_join_nothing() -> None:
    join = ClockJoin()
    for board_s in range(FEWEST - 1):
        join.add(board_s, board_s, board_s + 1e-3)
    assert join.joined() is None


def test_a_shift_of_either_clock_shifts_the_answer_by_as_much() -> None:
    rows = np.random.default_rng(2).exponential(1e-3, (100, 2))
    answers = []
    for shift_s, other_s in ((0.0, 0.0), (100.0, 0.0), (0.0, -40.0)):
        join = ClockJoin()
        for number, (there_s, back_s) in enumerate(rows):
            at_s = 0.02 * number
            join.add(at_s + other_s, at_s + shift_s - there_s, at_s + shift_s + back_s)
        clock = join.joined()
        assert clock is not None
        answers.append(clock.host_at(1.0 + other_s) - shift_s)
    assert answers == pytest.approx([answers[0]] * 3, abs=1e-9)


def test_one_exchange_that_belies_all_others_changes_little() -> None:
    """The cause may be a host whose clock was set or that was suspended."""
    rng = np.random.default_rng(3)
    join = ClockJoin()
    for number in range(500):
        there_s, back_s = rng.exponential(1e-3, 2)
        wrong_s = 0.2 if number == 250 else 0.0
        join.add(0.02 * number, 0.02 * number - there_s + wrong_s, 0.02 * number + back_s + wrong_s)
    clock = join.joined()
    assert clock is not None
    assert abs(clock.host_at(5.0) - 5.0) < 1e-3


def test_an_instrument_on_the_host_clock_is_joined_exactly() -> None:
    join = ClockJoin()
    for number in range(50):
        join.add(0.04 * number, 0.04 * number, 0.04 * number)
    clock = join.joined()
    assert clock is not None
    assert clock.host_at(1.5) == pytest.approx(1.5, abs=1e-9)
