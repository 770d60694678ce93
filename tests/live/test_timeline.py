"""Time of the live view: correct steps, never decreasing, whatever the source's clock does."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingervision.live.capture import Timeline

TICK_S = 1e-6
steps = st.lists(st.tuples(st.floats(-5.0, 5.0), st.floats(0.001, 3.0)), min_size=1, max_size=40)


@given(steps)
def test_time_never_runs_back_however_the_source_jumps(changes: list[tuple[float, float]]) -> None:
    timeline = Timeline(100.0)
    source_s, arrived_s, last_s = 7.0, 100.5, -1.0
    for step_s, host_step_s in changes:
        time_s, _ = timeline.at(source_s, arrived_s)
        assert time_s >= last_s
        last_s, source_s, arrived_s = time_s, source_s + step_s, arrived_s + host_step_s


def test_the_sources_own_steps_are_kept_while_the_host_jitters() -> None:
    timeline = Timeline(0.0)
    times = [timeline.at(1000.0 + 0.04 * index, 0.5 + 0.04 * index + 0.02 * (index % 3))[0] for index in range(50)]
    assert [after - before for before, after in pairwise(times)] == pytest.approx([0.04] * 49, abs=2 * TICK_S)


def test_a_jump_is_noticed_and_bridged_by_the_hosts_clock() -> None:
    timeline = Timeline(0.0)
    timeline.at(10.0, 1.0)
    time_s, jump_s = timeline.at(3610.0, 1.04)
    assert jump_s == pytest.approx(3599.96)
    assert time_s == pytest.approx(1.04, abs=TICK_S)


def test_a_cut_is_a_gap_of_its_true_length() -> None:
    timeline = Timeline(0.0)
    timeline.at(10.0, 1.0)
    timeline.cut()
    time_s, jump_s = timeline.at(0.0, 8.5)
    assert (time_s, jump_s) == (pytest.approx(8.5, abs=TICK_S), 0.0)
