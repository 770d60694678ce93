"""The offset between the recording's clock and the stage's log is found from the motion, or refused with a reason."""

import json
from dataclasses import dataclass

import numpy as np
import pytest

from fingervision.domain.drive import DriveHistory
from fingervision.domain.measured_table import ONE_CLOCK, FoundClock
from fingervision.motion.clock.alignment import find_clock_offset
from fingervision.motion.clock.clock_offset import ClockOffset, NoClockOffset
from fingervision.storage.beside import clock_beside
from tests.benchmarks import drawn_recordings

SIGMAS = 3.5
"""Of single draws: one in two thousand lies outside."""
STROKES = ((1.0, 0.0), (3.0, 0.8), (4.0, 0.8), (5.5, 0.1), (6.0, 0.1), (8.0, 1.0), (9.0, 0.3), (10.5, 0.3), (12.0, 0.0))
"""Corners of a motion that does not repeat: time in s, place in mm."""


@dataclass(frozen=True)
class Drawn:
    """A recording and the stage's own log; times in s, lengths in mm."""

    time_s: np.ndarray
    gap_mm: np.ndarray
    drive: DriveHistory


def behind_play(path_mm, width_mm):
    """Output of a play that follows a path, sample by sample."""
    out, state = np.empty_like(path_mm), path_mm[0]
    for i, place in enumerate(path_mm):
        state = min(max(state, place - width_mm / 2), place + width_mm / 2)
        out[i] = state
    return out


def drawn(offset_s, rate=0.0, play_mm=0.05, corners=STROKES, rate_hz=25.0, noise_mm=5e-4, seed=1):
    """Log a motion, and record it with a camera whose clock has an offset."""
    rng = np.random.default_rng(seed)
    at_s, at_mm = np.array(corners).T
    fine_s = np.arange(0.0, at_s[-1] + 1.0, 1e-3)
    path = np.interp(fine_s, at_s, at_mm)
    log_s, film_s = np.arange(0.0, fine_s[-1], 0.01), np.arange(0.2, fine_s[-1] - 0.3, 1.0 / rate_hz)
    moved = np.interp(film_s, fine_s, behind_play(path, play_mm))
    gap = 1.2 + 7.7 * moved + rng.normal(0.0, noise_mm, film_s.size)
    logged = np.interp(log_s, fine_s, path) + rng.normal(0.0, 1e-4, log_s.size)
    return Drawn(film_s * (1.0 + rate) + offset_s, gap, DriveHistory(log_s, logged))


def found(one):
    """Find the offset of a simulated recording."""
    return find_clock_offset(one.time_s, one.gap_mm, one.drive)


@pytest.mark.parametrize(("offset_s", "rate", "play_mm"), [(23.0, 1e-3, 0.0), (-41.37, -5e-4, 0.1)])
def test_offset_rate_and_play_are_found_within_their_uncertainty(offset_s, rate, play_mm):
    clock = found(drawn(offset_s, rate, play_mm))
    assert isinstance(clock, ClockOffset)
    assert abs(clock.offset_s - offset_s) < SIGMAS * clock.u_offset_s
    assert clock.u_offset_s < 0.01
    assert abs(clock.rate - rate) < SIGMAS * clock.u_rate
    assert abs(clock.play_mm - play_mm) < SIGMAS * clock.u_play_mm + 1e-4
    assert any("runs fast" in note for note in clock.notes) == (rate == 1e-3)
    assert clock.runner_up_s is None
    # Both ways of reading the clock are each other's inverse.
    assert clock.log_time_s(float(clock.recording_time_s(np.array([7.0]))[0])) == pytest.approx(7.0, abs=1e-9)


@pytest.mark.slow
def test_motion_of_one_period_is_refused_with_the_candidates():
    corners = [(0.5 * k, 0.4 * (k % 2)) for k in range(40)]
    one = drawn(3.0, corners=corners)
    part = (one.time_s > 8.0) & (one.time_s < 14.0)
    refused = find_clock_offset(one.time_s[part], one.gap_mm[part], one.drive)
    assert isinstance(refused, NoClockOffset)
    assert "equally well" in refused.words
    assert min(abs(candidate - 3.0) for candidate in refused.candidates_s) < 0.01
    assert np.median(np.diff(refused.candidates_s)) == pytest.approx(1.0, abs=0.01)


def test_too_little_motion_is_said():
    still = drawn(3.0, corners=[(1.0, 0.0), (2.0, 1e-5), (12.0, 1e-5)])
    refused = found(still)
    assert isinstance(refused, NoClockOffset)
    assert "too little motion" in refused.words


@pytest.mark.slow
def test_a_single_ramp_leaves_the_offset_open():
    ramp = drawn(3.0, corners=[(0.0, 0.0), (30.0, 1.0)])
    inside = (ramp.time_s > 8.0) & (ramp.time_s < 20.0)
    refused = find_clock_offset(ramp.time_s[inside], ramp.gap_mm[inside], ramp.drive)
    if isinstance(refused, ClockOffset):  # else it is refused with a reason
        assert any("more than one frame" in note for note in refused.notes)


@pytest.mark.slow
def test_another_recordings_log_is_refused():
    rng = np.random.default_rng(5)
    other = drawn(0.0, corners=[(k + 1.0, float(p)) for k, p in enumerate(rng.uniform(0.0, 1.0, 12))])
    one = drawn(0.0)
    refused = find_clock_offset(one.time_s, one.gap_mm, other.drive)
    if isinstance(refused, ClockOffset):
        assert refused.notes


def test_a_reversed_sign_is_named():
    one = drawn(3.0)
    refused = find_clock_offset(one.time_s, 12.0 - one.gap_mm, one.drive)
    assert isinstance(refused, NoClockOffset)
    assert "sign" in refused.words or "does not follow" in refused.words


def test_the_next_best_offset_is_named_where_there_is_one():
    # Two strokes that are nearly alike, 5 s apart, then one that is not.
    strokes = [
        (1.0, 0.0),
        (2.0, 1.0),
        (3.0, 0.0),
        (6.0, 0.0),
        (7.0, 0.9),
        (8.0, 0.0),
        (11.0, 0.0),
        (12.0, 1.0),
        (13.0, 0.0),
    ]
    clock = found(drawn(2.0, corners=strokes))
    assert isinstance(clock, ClockOffset)
    assert clock.offset_s == pytest.approx(2.0, abs=0.02)
    assert abs(clock.runner_up_s - clock.offset_s) == pytest.approx(5.0, abs=0.2)
    assert any(f"{clock.runner_up_s:.3f} s" in note for note in clock.notes)


def test_a_log_of_set_points_is_refused():
    at_s, at_mm = np.array(STROKES).T
    one = drawn(3.0)
    # The place that is gone to stands in every row until it is reached.
    targets = at_mm[np.clip(np.searchsorted(at_s, one.drive.time_s, side="right"), 0, at_mm.size - 1)]
    refused = find_clock_offset(one.time_s, one.gap_mm, DriveHistory(one.drive.time_s, targets))
    assert isinstance(refused, NoClockOffset)
    assert "set-points" in refused.words


def test_a_stage_that_jumps_within_a_row_is_not_taken_for_set_points_without_a_word():
    jumps = [(0.0, 0.0)]
    for k, place in enumerate((0.8, 0.1, 0.5, 0.9, 0.2, 0.6)):
        jumps += [(1.3 * k + 1.0, jumps[-1][1]), (1.3 * k + 1.02, place)]
    one = drawn(3.0, corners=[*jumps, (9.0, 0.6)])
    clock = find_clock_offset(one.time_s, one.gap_mm, DriveHistory(one.drive.time_s[::20], one.drive.input_mm[::20]))
    assert isinstance(clock, ClockOffset)
    assert abs(clock.offset_s - 3.0) < SIGMAS * clock.u_offset_s
    assert any("set-points" in note for note in clock.notes)


@pytest.mark.slow
def test_a_coarse_encoder_is_said():
    one = drawn(3.0, corners=[(3.0 * at_s, at_mm) for at_s, at_mm in STROKES])
    rounded = np.round(one.drive.input_mm / 0.03) * 0.03
    clock = find_clock_offset(one.time_s, one.gap_mm, DriveHistory(one.drive.time_s, rounded))
    notes = clock.notes if isinstance(clock, ClockOffset) else (clock.words,)
    assert any("more than one frame" in note or "exceed one frame" in note for note in notes)


def test_wrong_gaps_here_and_there_do_not_move_it():
    one = drawn(3.0)
    gap = one.gap_mm.copy()
    gap[::37] += 0.7
    clock = find_clock_offset(one.time_s, gap, one.drive)
    assert isinstance(clock, ClockOffset)
    assert abs(clock.offset_s - 3.0) < SIGMAS * clock.u_offset_s


def test_the_uncertainty_is_read_from_the_summary_beside_a_table(tmp_path):
    found = FoundClock(0.0125, 0.03, 0.0004)
    settings = {"drive_offset": "found", "u_drive_time_s": 0.0125, "drive_corner_s": 0.03, "u_drive_corner_s": 0.0004}
    (tmp_path / "summary.json").write_text(json.dumps({"settings": settings}))
    assert clock_beside(tmp_path / "gaps.csv") == found
    assert clock_beside(tmp_path / "other.csv") == ONE_CLOCK
    (tmp_path / "summary.json").write_text(json.dumps({"settings": {**settings, "drive_offset": "given"}}))
    assert clock_beside(tmp_path / "gaps.csv") == ONE_CLOCK
    (tmp_path / "summary.json").write_text("[")
    assert clock_beside(tmp_path / "gaps.csv") == ONE_CLOCK


@pytest.mark.slow
def test_a_play_of_several_steps_of_a_staircase_gives_no_other_step():
    """Seed 73000 of the benchmark: at a wrong offset by one step, with a play of 4 um, 544 of 761 frames fit within
    noise.
    """
    one = drawn_recordings.draw(73000)
    clock = find_clock_offset(one.time_s, one.gap_mm, DriveHistory(one.log_s, one.input_mm))
    if isinstance(clock, ClockOffset):
        assert abs(clock.offset_s - one.kind.offset_s) < SIGMAS * clock.u_offset_s
    else:
        assert "do not follow the drive" in clock.words


@pytest.mark.parametrize(
    ("number", "words"),
    [
        pytest.param(99001177, "set-points", id="set-points of short moves, whose frames were left out as wrong"),
        pytest.param(88151011, "equally well at 2 offsets", id="a play of a step behind rows slower than the moves"),
        pytest.param(
            88151032,
            "set-points",
            id="set-points in equal steps with noise, once taken for an encoder",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_what_leaves_two_answers_open_is_refused(number, words):
    one = drawn_recordings.draw(number)
    found = find_clock_offset(one.time_s, one.gap_mm, DriveHistory(one.log_s, one.input_mm))
    assert isinstance(found, NoClockOffset)
    assert words in found.words


def test_a_staircase_of_equal_steps_that_never_turns_leaves_the_step_open():
    """One step on, all halts fit as well; the bends between the rows of the log decided for a wrong step, 1.4 s off."""
    one = drawn_recordings.draw(99101000, noise_mm=3e-4, duration_s=14.0)
    found = find_clock_offset(one.time_s, one.gap_mm, DriveHistory(one.log_s, one.input_mm))
    assert isinstance(found, NoClockOffset)
    assert min(abs(offset_s - one.kind.offset_s) for offset_s in found.candidates_s) < 0.01


@pytest.mark.slow
def test_a_creep_that_looks_like_slow_turns_is_said_and_carried():
    one = drawn_recordings.draw(232005, creep=0.02)
    found = find_clock_offset(one.time_s, one.gap_mm, DriveHistory(one.log_s, one.input_mm))
    assert isinstance(found, ClockOffset)
    assert any("creep" in note for note in found.notes)
    assert abs(found.offset_s - one.kind.offset_s) < 2.0 * found.u_offset_s
