"""Corners of the motion between two rows: found where the stage turned, started and stopped, and decisive for plays."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fingervision.diagnosis.diagnose import diagnose
from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.domain.effect import History, InputPath
from fingervision.models.table import TableModel
from fingervision.motion.corners import Corner, corners
from tests.diagnosis.tables import written

PERIOD_S, EVERY_S = 8.0, 0.04


def reversals(u: np.ndarray, t: np.ndarray, sigma_mm: float) -> list[Corner]:
    """Corners at which the stage turned."""
    return [c for c in corners(u, t, (slice(0, t.size),), sigma_mm) if c.least_mm is not None]


def triangle(t: np.ndarray) -> np.ndarray:
    """Strokes of 2 mm at a constant speed, with sharp corners."""
    return 2.0 * np.abs((t / PERIOD_S) % 1.0 * 2.0 - 1.0)


def cosine(t: np.ndarray) -> np.ndarray:
    """Strokes of 2 mm without corners."""
    return 1.0 + np.cos(2.0 * np.pi * t / PERIOD_S)


@pytest.mark.parametrize("motion", [triangle, cosine])
@pytest.mark.parametrize("phase_s", [0.004, 0.013, 0.019, 0.031])
def test_turning_points_lie_where_the_stage_turned(motion: Callable[[np.ndarray], np.ndarray], phase_s: float) -> None:
    t = np.arange(0.0, 30.0, EVERY_S) + phase_s
    u = motion(t)
    points = reversals(u, t, 0.0)
    ends = np.array([2.0 * round(point.input_mm / 2.0) for point in points])
    assert len(points) == 7
    np.testing.assert_allclose([point.input_mm for point in points], ends, atol=5e-4)
    np.testing.assert_allclose([point.time_s for point in points], 4.0 * np.arange(1, 8), atol=0.002)


def test_no_turning_point_at_a_hold_a_noisy_end_or_a_long_pause() -> None:
    t = np.arange(0.0, 30.0, EVERY_S)
    held = np.clip(triangle(t), 0.1, 1.9)
    assert not reversals(held, t, 0.0)
    rng = np.random.default_rng(3)
    noisy = cosine(t + 0.013) + 0.002 * rng.standard_normal(t.size)
    assert len(reversals(noisy, t, 0.002)) <= 1
    turn = np.abs(t % PERIOD_S - 4.0) < 0.3
    paused = t[~turn & (np.abs(t % PERIOD_S - 8.0) > 0.3) & (t % PERIOD_S > 0.3)]
    assert not reversals(triangle(paused), paused, 0.0)


def test_two_equal_rows_at_an_end_are_a_stop() -> None:
    strokes = np.concatenate([np.linspace(0.0, 1.0, 80), np.linspace(1.0, 0.0, 80), np.linspace(0.0, 1.0, 80)])
    assert not reversals(strokes, EVERY_S * np.arange(strokes.size), 0.0)


def test_rows_at_equal_distances_from_a_turn_do_not_hide_it() -> None:
    """A stop is as possible as a turn: the gap decides, because the place is free between both."""
    t = np.arange(0.0, 30.0, EVERY_S) + 0.5 * EVERY_S
    u = triangle(t) + 2e-4 * np.random.default_rng(4).standard_normal(t.size)
    points = reversals(u, t, 2e-4)
    assert len(points) == 7
    assert all(point.free for point in points)
    np.testing.assert_allclose([point.input_mm for point in points], [0.0, 2.0, 0.0, 2.0, 0.0, 2.0, 0.0], atol=1e-3)


def strokes_with_stops(dwell_s: float, hold_s: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    """Times and inputs of the corners of six strokes of 1 mm at 0.8 mm/s, which stop at each end for a moment."""
    steps_s = [hold_s, *[1.25, dwell_s] * 6, hold_s]
    places = [0.0, 0.0, *[end for k in range(6) for end in [float((k + 1) % 2)] * 2], 0.0]
    return np.cumsum([0.0, *steps_s]), np.array(places[: len(steps_s) + 1])


@pytest.mark.parametrize("phase_s", [0.003, 0.011, 0.024, 0.038])
def test_starts_and_stops_lie_where_the_speed_changed(phase_s: float) -> None:
    at_s, places = strokes_with_stops(0.3)
    t = np.arange(phase_s, at_s[-1], EVERY_S)
    found = corners(np.interp(t, at_s, places), t, (slice(0, t.size),), 0.0)
    points = np.array([point for corner in found for point in corner.points(corner.short_by[0])])
    at_s, places = at_s[1:-2], places[1:-2]  # without the end of the last stop, after which nothing moves
    beside = np.min(np.abs(at_s[:, None] - t), axis=1) > EVERY_S / 16  # farther from any row than the rows resolve
    assert beside.sum() >= 8
    for time_s, place in zip(at_s[beside], places[beside], strict=True):
        nearest = points[np.argmin(np.abs(points[:, 0] - time_s))]
        np.testing.assert_allclose(nearest, [time_s, place], atol=1e-9)


def test_strokes_to_the_same_place_determine_it_together() -> None:
    at_s, places = strokes_with_stops(0.015)
    t = np.arange(0.003, at_s[-1], EVERY_S)
    found = corners(np.interp(t, at_s, places), t, (slice(0, t.size),), 0.0)
    turning = [c for c in found if c.least_mm is not None]
    ends = [c.points(share)[0][1] for c in turning for share in c.short_by]
    widths = [abs(c.input_mm - (c.least_mm or 0.0)) for c in turning]
    assert max(widths) > 0.01
    # Without the other strokes, each place is known within these widths, of which the meeting place is the outer end.
    within = 0.002 * max(widths)  # a place exactly at a row is a thousandth of the width beside it
    for low, high in zip(ends[::2], ends[1::2], strict=True):
        true = float(round(high))
        assert min(low, high) - within <= true <= max(low, high) + within
        assert abs(low - high) < 0.6 * max(widths)


@pytest.mark.parametrize("late", ["drive_lag", "camera_latency"])
def test_a_delay_beside_a_play_is_exact_between_the_rows(late: str) -> None:
    at_s, places = strokes_with_stops(0.0)
    fine_s = np.arange(0.0, at_s[-1], 1e-4)
    delay_s, play_mm = 0.0734, 0.05
    place_mm = played(np.interp(fine_s - delay_s, at_s, places), play_mm)
    rows = np.arange(130, fine_s.size, 400)
    t = fine_s[rows]
    history = History(np.interp(t, at_s, places), t, (slice(0, t.size),), 0.0, 1.0, both_edges=False)
    points = {c.after: c.points(c.short_by[0]) for c in corners(history.input_mm, t, history.runs, 0.0)}
    along = [(t[i], history.input_mm[i], i) for i in range(t.size)]
    along += [(time_s, input_mm, -1) for after in points.values() for time_s, input_mm in after]
    time_s, input_mm, owner = (np.array(column) for column in zip(*sorted(along), strict=True))
    owner = owner.astype(np.intp)
    whole = replace(history, input_mm=input_mm, time_s=time_s, runs=(slice(0, time_s.size),))
    path = InputPath(whole, np.flatnonzero(owner >= 0), owner)
    line = np.array([-1.0, 2.0])
    chain = MeasuringChain(TableModel("line", line, -0.5 * line, 0.5 * line), history, {}, path=path)
    seen = chain.respond({late: {"delay_s": delay_s}, "backlash": {"play_mm": play_mm, "start_1": 0.0}})
    # One row in 25 would be wrong by up to 16 um where the delayed input turned between the rows.
    np.testing.assert_allclose(seen.gap_mm, place_mm[rows], atol=1e-4)


def played(input_mm: np.ndarray, play_mm: float) -> np.ndarray:
    """Output of a play of a given full width, sample by sample, from its middle."""
    out, state = np.empty(input_mm.size), input_mm[0]
    for k, u in enumerate(input_mm):
        state = min(max(state, u - play_mm / 2), u + play_mm / 2)
        out[k] = state
    return out


def test_strokes_that_stop_for_a_moment_have_no_end_stop(tmp_path: Path) -> None:
    at_s, places = strokes_with_stops(0.02)
    fine_s = np.arange(0.0, at_s[-1], 1e-3)
    input_mm = np.interp(fine_s, at_s, places)
    rows = np.arange(7, fine_s.size, 40)
    noise_mm = 0.0005 * np.random.default_rng(4).standard_normal(rows.size)
    gap_mm = 3.0 + 7.7 * played(input_mm, 0.05)[rows] + noise_mm
    lines = [f"{fine_s[i]:.3f},{input_mm[i]:.5f},{gap:.5f}" for i, gap in zip(rows, gap_mm, strict=True)]
    report = diagnose(*written(tmp_path, "time_s,input_mm,gap_mm", lines, "-0.5,-0.85\n2,18.4")).report
    assert [effect.name for effect in report.effects] == ["backlash"]
    play = report.effects[0].parameters["play_mm"]
    assert play.value == pytest.approx(0.05, abs=0.0005)  # without the places of the reversals, 3 um too wide
    assert report.disagreement.after_rms_mm < 0.001


def test_a_play_as_small_as_the_motion_between_two_rows_is_no_delay(tmp_path: Path) -> None:
    fine_s = np.arange(0.0, 40.0, 0.001)
    input_mm, play_mm = triangle(fine_s), 0.018
    place_mm = played(input_mm, play_mm)
    rows = np.arange(13, fine_s.size, 40)
    gap_mm = 3.0 + 0.8 * place_mm[rows] + 0.002 * np.random.default_rng(8).standard_normal(rows.size)
    lines = [f"{fine_s[i]:.3f},{input_mm[i]:.5f},{gap:.5f}" for i, gap in zip(rows, gap_mm, strict=True)]
    report = diagnose(*written(tmp_path, "time_s,input_mm,gap_mm", lines, "-0.5,2.6\n3,5.4")).report
    assert [effect.name for effect in report.effects] == ["backlash"]
    play = report.effects[0].parameters["play_mm"]
    assert play.value == pytest.approx(play_mm, abs=3.0 * (play.u or 0.0))


def test_a_rest_that_is_interpolated_in_a_log_is_no_reversal() -> None:
    t = np.round(np.arange(60) / 30.0, 3)
    u = np.interp(t, [0.0, 1.02, 2.0], [0.0, 0.6, 0.6])
    first = int(np.flatnonzero(u == 0.6)[0])
    u[first + 1] = np.nextafter(0.6, 1.0)
    assert not reversals(u, t, 0.0)
