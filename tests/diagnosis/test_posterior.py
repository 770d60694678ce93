"""Uncertainties with known true values: of a mean, and of a parameter whose best value lies at its bound."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fingervision as fv
from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit
from fingervision.diagnosis.inference.posterior import beside_alternatives, settled
from fingervision.diagnosis.inference.record_errors import simulated_records, with_record_errors
from fingervision.diagnosis.input.preparation import prepare
from fingervision.domain.drive import DriveHistory
from fingervision.domain.measured_table import FoundClock
from fingervision.effects.play_operator import play
from fingervision.interface.column_tables import measured_from_columns
from fingervision.motion.clock.alignment import find_clock_offset
from fingervision.motion.clock.clock_offset import ClockOffset
from fingervision.motion.drive_at import drive_at
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model
from tests.benchmarks.clock import PLAY_ALONE, named_play
from tests.benchmarks.drawn_recordings import draw
from tests.diagnosis.tables import written

EDGE_MM = 0.01
SAMPLES = 240
SEED = 4
WALK = 0.2
"""Relative tolerance: a random walk of a thousand steps determines a standard deviation to 10 %; twice that value."""


@pytest.fixture
def problem(tmp_path: Path) -> Problem:
    """One run to the end of the range and back without an effect; the noise is estimated with no effect."""
    rng = np.random.default_rng(SEED)
    u = 0.5 * np.sin(np.linspace(0.0, 12.0, SAMPLES))
    left, right = (side * (2.0 + 3.5 * u) + EDGE_MM * rng.standard_normal(SAMPLES) for side in (-1.0, 1.0))
    lines = [f"{0.1 * k},{u[k]},{right[k] - left[k]},{left[k]},{right[k]}" for k in range(SAMPLES)]
    bench = prepare(*written(tmp_path, "time_s,input_mm,gap_mm,left_mm,right_mm", lines, "-0.6,-0.2\n0.6,8.2"))
    return bench.problem(bench.stacked_mm - bench.chain.stacked({}), 0, explained=True)


def settle(problem: Problem, name: str, parameter: str, start: float) -> tuple[Explanation, float]:
    best = fit(problem, (name,), {name: {parameter: start}}, iterations=20)
    answer, _ = settled(problem, best, np.random.default_rng(SEED))
    return answer, float(np.sqrt(answer.covariance[0, 0]))


def test_an_offset_is_as_uncertain_as_a_mean(problem: Problem) -> None:
    answer, u = settle(problem, "rest_gap_error", "offset_mm", 0.001)
    expected = np.sqrt(2.0) * EDGE_MM / np.sqrt(SAMPLES)
    assert u == pytest.approx(expected, rel=WALK)
    assert abs(answer.values["rest_gap_error"]["offset_mm"]) < 3.0 * expected


def test_a_noise_of_few_degrees_of_freedom_gives_every_parameter_students_width(problem: Problem) -> None:
    names = ("rest_gap_error", "lever_ratio_error", "assembly_asymmetry", "camera_drift")
    start = {"offset_mm": 0.001, "ratio": 0.001, "share": 0.001, "rate_mm_per_s": 1e-5}
    degrees = 8.0
    noises = tuple(replace(noise, slow_doubt=float(np.sqrt(2.0 / degrees))) for noise in problem.whitener.noises)
    unsure = replace(problem, whitener=replace(problem.whitener, noises=noises))
    best = fit(unsure, names, dict(zip(names, ({key: by} for key, by in start.items()), strict=True)), iterations=20)
    answer, _ = settled(unsure, best, np.random.default_rng(SEED))
    wider = np.sqrt(np.diag(answer.covariance) / np.diag(best.covariance))
    assert wider == pytest.approx(np.sqrt(degrees / (degrees - 2.0)), rel=WALK)


def test_a_play_of_nothing_is_not_known_exactly(problem: Problem) -> None:
    answer, u = settle(problem, "backlash", "play_mm", 1e-4)
    play_mm = answer.values["backlash"]["play_mm"]
    # Half of the play changes the gap by 7 mm per mm, and the mean over some 200 samples in motion shows 0.001 mm.
    assert 0.0 <= play_mm < 1e-3
    assert 5e-5 < u < 1e-3


def test_an_alternative_of_far_better_odds_without_the_parameter_leaves_its_covariance(problem: Problem) -> None:
    best = fit(problem, ("rest_gap_error",), {"rest_gap_error": {"offset_mm": 0.001}}, iterations=20)
    far = replace(best, values={"rest_gap_error": {"offset_mm": 3.0}})
    other = fit(problem, ("lever_ratio_error",), {"lever_ratio_error": {"ratio": 0.001}}, iterations=20)
    assert np.array_equal(beside_alternatives(problem, far, (other,)).covariance, far.covariance)


def test_the_record_of_an_encoder_widens_a_play_and_an_exact_one_does_not(tmp_path: Path) -> None:
    rng = np.random.default_rng(SEED)
    t = 0.1 * np.arange(400)
    u = 0.8 * np.abs((t / 10.0 + 0.5) % 2.0 - 1.0)
    gap = 2.0 + 5.0 * play(u, 0.05, 0.0) + 0.002 * rng.standard_normal(t.size)
    (tmp_path / "sim.csv").write_text("input_mm,gap_mm\n-0.2,1.0\n1.0,7.0\n")
    found = {}
    for step_mm in (0.0, 0.03):
        recorded = np.round(u / step_mm) * step_mm if step_mm else u
        lines = [f"{t[k]:.3f},{recorded[k]:.6f},{gap[k]:.6f}" for k in range(t.size)]
        (tmp_path / "measured.csv").write_text("time_s,input_mm,gap_mm\n" + "\n".join(lines) + "\n")
        data = prepare(read_measured_table(tmp_path / "measured.csv"), read_model(tmp_path / "sim.csv"))
        problem = data.problem(data.stacked_mm - data.chain.stacked({"backlash": {"play_mm": 0.05}}), 1, explained=True)
        best = fit(problem, ("backlash",), {"backlash": {"play_mm": 0.05}}, iterations=5)
        best = replace(best, covariance=np.array([[1e-8]]))
        again = list(simulated_records(data, np.random.default_rng(SEED)))
        found[step_mm] = with_record_errors(problem, best, again).covariance[0, 0]
    assert found[0.0] == 1e-8
    # The mean rounding error of a stroke resembles a play: with some ten encoder steps per stroke, it is at most a
    # third of the largest rounding error.
    assert 1e-8 + (0.03 / 300.0) ** 2 < found[0.03] < (0.03 / 6.0) ** 2


def test_stick_slip_alone_behind_a_noisy_record_keeps_its_covariance(tmp_path: Path) -> None:
    rng = np.random.default_rng(SEED)
    t = 0.1 * np.arange(300)
    u = 0.8 * np.abs((t / 10.0 + 0.5) % 2.0 - 1.0)
    read, gap = (values + 0.003 * rng.standard_normal(t.size) for values in (u, 2.0 + 5.0 * u))
    lines = [f"{t[k]:.3f},{read[k]:.6f},{gap[k]:.6f}" for k in range(t.size)]
    data = prepare(*written(tmp_path, "time_s,input_mm,gap_mm", lines, "-0.2,1.0\n1.0,7.0"))
    problem = data.problem(data.stacked_mm - data.chain.stacked({}), 0, explained=True)
    best = fit(problem, ("stick_slip",), {"stick_slip": {"jump_mm": 0.02}}, iterations=2)
    # The prediction depends on it discontinuously, so that no derivative gives the contribution of the record.
    again = list(simulated_records(data, np.random.default_rng(SEED)))
    np.testing.assert_array_equal(with_record_errors(problem, best, again).covariance, best.covariance)


@pytest.mark.parametrize("behind", [True, False], ids=["wrong slope behind the play", "wrong scale before it"])
def test_a_play_beside_a_wrong_gain_is_as_uncertain_as_its_place_in_the_chain(behind: bool) -> None:
    # 2 % of the play lie between both: the table cannot tell a lever's error from a scale's.
    time_s = np.arange(0.0, 24.0, 0.04)
    stands_mm = 0.5 + 0.5 * np.interp(time_s % 12.0, [0.0, 6.0, 12.0], [-1.0, 1.0, -1.0])
    read_mm = stands_mm if behind else stands_mm / 1.02
    gap_mm = 1.2 + 7.72 * (1.02 if behind else 1.0) * play(stands_mm, 0.05, 0.3)
    gap_mm += np.random.default_rng(8).normal(0.0, 5e-4, gap_mm.size)
    columns = {"time_s": time_s.tolist(), "input_mm": read_mm.tolist(), "gap_mm": gap_mm.tolist()}
    found = fv.diagnose(measured_from_columns(columns), {"input_mm": [-0.5, 1.5], "gap_mm": [-2.66, 12.78]}).report
    assert {len(names) for names in found.alternatives} == {2}
    width = next(effect for effect in found.effects if effect.name == "backlash").parameters["play_mm"]
    assert abs(width.value - 0.05) < 2.0 * width.u < 0.004


def test_a_play_beside_a_clock_found_from_the_same_motion_is_within_its_uncertainty() -> None:
    rng = np.random.default_rng(5)
    corner_s, corner_mm = (0.0, 1.0, 2.871, 4.403, 6.127, 7.127, 8.0), (0.0, 0.0, 0.6559, 0.1048, 0.4936, 0.4936, 0.2)
    fine_s = np.arange(0.0, 8.0, 5e-4)
    moved_mm = play(np.interp(fine_s, corner_s, corner_mm), 0.066, -0.4)
    frame_s, row_s = np.arange(0.007, 8.0, 0.04), np.arange(0.0, 8.0, 0.04)
    gap_mm = 1.2 + 7.72 * np.interp(frame_s, fine_s, moved_mm) + rng.normal(0.0, 5e-4, frame_s.size)
    log, film_s = DriveHistory(row_s, np.interp(row_s, corner_s, corner_mm)), np.round(frame_s + 3.2, 3)
    clock = find_clock_offset(film_s, gap_mm, log)
    assert isinstance(clock, ClockOffset)
    states = [drive_at(log, clock.log_time_s(at)) for at in film_s]
    rows = [(at, state.input_mm, gap) for at, state, gap in zip(film_s, states, gap_mm, strict=True) if state]
    columns = dict(zip(("time_s", "input_mm", "gap_mm"), np.array(rows).T.tolist(), strict=True))
    table = replace(measured_from_columns(columns), clock=FoundClock(clock.u_time_s), stamp_s=1e-3)
    found = fv.diagnose(table, {"input_mm": [-0.5, 1.5], "gap_mm": [-2.66, 12.78]}).report
    assert [effect.name for effect in found.effects] == ["backlash"]
    width = found.effects[0].parameters["play_mm"]
    assert abs(width.value - 0.066) < 2.0 * width.u < 0.002
    assert found.disagreement.after_rms_mm < 2.0 * 5e-4


@pytest.mark.parametrize("late_s", [-0.003, 0.0029])
def test_a_play_seen_at_one_reversal_does_not_depend_on_the_offset_that_the_clock_states(late_s):
    # A straight line in the offset does not hold over 3 ms: the play is taken up within two frames.
    time_s = np.arange(0.8, 6.0, 0.04)
    fine_s = np.arange(0.0, 6.0, 5e-4)
    stands_mm = np.interp(fine_s, [0.0, 4.6, 6.0], [-0.225, 1.5, 0.975])
    gap_mm = 1.2 + 7.72 * np.interp(time_s, fine_s, play(stands_mm, 0.03, -1.0))
    gap_mm += np.random.default_rng(3).normal(0.0, 1.7e-3, time_s.size)
    columns = {"time_s": time_s, "input_mm": np.interp(time_s - late_s, fine_s, stands_mm), "gap_mm": gap_mm}
    table = replace(measured_from_columns({k: v.tolist() for k, v in columns.items()}), clock=FoundClock(0.0021))
    found = fv.diagnose(table, {"input_mm": [-0.5, 1.6], "gap_mm": [-2.66, 13.552]}).report
    assert [effect.name for effect in found.effects] == ["backlash"]
    width = found.effects[0].parameters["play_mm"]
    assert abs(width.value - 0.03) < 2.0 * width.u < 0.001


@pytest.mark.parametrize("has_log", [True, False])
def test_a_run_of_one_row_beside_a_clock_is_no_obstacle(has_log):
    time_s = np.arange(0.0, 8.0, 0.04)
    stands_mm = np.interp(time_s, [0.0, 4.0, 8.0], [0.0, 1.2, 0.0])
    gap_mm = 1.2 + 7.72 * play(stands_mm, 0.05, 0.3) + np.random.default_rng(4).normal(0.0, 1e-3, time_s.size)
    columns = {"time_s": time_s.tolist(), "input_mm": stands_mm.tolist(), "gap_mm": gap_mm.tolist()}
    runs = ["there and back"] * (time_s.size - 1) + ["again"]
    log = DriveHistory(time_s, stands_mm, tuple(runs)) if has_log else None
    table = replace(measured_from_columns(columns | {"run": runs}), clock=FoundClock(1e-3), log=log)
    found = fv.diagnose(table, {"input_mm": [-0.5, 1.6], "gap_mm": [-2.66, 13.552]}).report
    assert [effect.name for effect in found.effects] == ["backlash"]
    assert abs(found.effects[0].parameters["play_mm"].value - 0.05) < 2e-3
    assert any("drive_log.csv" in note for note in found.notes) != has_log


@pytest.mark.parametrize(
    ("seed", "noise_mm"),
    [(7303004, 3.43e-3), (7303005, 2.45e-3), (7301011, 6e-4), (7306016, 3e-4)],
    ids=["10 Hz", "encoder", "7 Hz", "one speed"],
)
def test_a_play_beside_a_clock_and_its_log_is_named_within_its_uncertainty(seed, noise_mm):
    # At the frames alone, the path between the rows is lost: the first was unknown, the second was 4.6 u too narrow.
    # With triangles at one speed, play and offset differ only in the frames beside a reversal.
    one = draw(seed, **PLAY_ALONE, noise_mm=noise_mm)
    drive = DriveHistory(one.log_s, one.input_mm)
    width = named_play(one, drive, find_clock_offset(one.time_s, one.gap_mm, drive))
    assert abs(width.value - one.kind.play_mm) < 2.0 * width.u < 0.01


def test_a_log_of_ten_rows_a_second_lets_a_sound_model_agree():
    one = draw(7301003, **PLAY_ALONE)
    drive = DriveHistory(one.log_s, one.input_mm)
    assert one.kind.play_mm == 0.0
    assert named_play(one, drive, find_clock_offset(one.time_s, one.gap_mm, drive)) == "agrees []"


def test_an_encoder_with_one_step_from_row_to_row_is_no_limit_of_speed():
    # A limit at the stage's own speed removes most of the error of the path, although nothing was hidden.
    one = draw(7305012, **PLAY_ALONE)
    drive = DriveHistory(one.log_s, one.input_mm)
    assert one.kind.play_mm == 0.0
    found = named_play(one, drive, find_clock_offset(one.time_s, one.gap_mm, drive))
    assert found.endswith("[]")
