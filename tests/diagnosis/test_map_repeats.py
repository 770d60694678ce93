"""A map of position errors is accepted only if it is the same in every run."""

from dataclasses import replace

import numpy as np
import pytest

import fingervision as fv
from fingervision.diagnosis.inference.map_identifiability import foretells_other_passes
from fingervision.diagnosis.inference.position_map import likeliest_map, why_no_map
from fingervision.diagnosis.input.preparation import prepare
from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import History
from fingervision.domain.measured_table import FoundClock, MeasuredTable
from fingervision.interface.column_tables import measured_from_columns
from fingervision.models.corrected import CorrectedModel
from fingervision.models.table import TableModel
from fingervision.motion.clock.alignment import find_clock_offset
from tests.benchmarks.clock import PLAY_ALONE, named_play
from tests.benchmarks.drawn_recordings import draw

NOISE_MM = 0.002
ROWS = 60


def loops(reaches_mm: tuple[float, ...], seed: int) -> tuple[np.ndarray, tuple[slice, ...], np.ndarray]:
    """Runs with two loops each, to the end of the range and back; also the noise of the readings."""
    shape = 0.5 - 0.5 * np.cos(np.linspace(0.0, 4.0 * np.pi, ROWS))
    input_mm = np.concatenate([reach * shape for reach in reaches_mm])
    runs = tuple(slice(ROWS * k, ROWS * (k + 1)) for k in range(len(reaches_mm)))
    return input_mm, runs, NOISE_MM * np.random.default_rng(seed).standard_normal(input_mm.size)


def mapped(
    input_mm: np.ndarray, runs: tuple[slice, ...], error_mm: np.ndarray, noise_mm: np.ndarray
) -> tuple[bool, float]:
    """Whether a map predicts passes that were not used for its fit, and its gain."""
    time_s = 0.5 * np.arange(input_mm.size)
    names = tuple(str(k) for k in range(len(runs)))
    table = MeasuredTable(input_mm, 5.0 + 2.0 * input_mm + error_mm + noise_mm, None, time_s, runs, names)
    at = np.array([-1.0, 12.0])
    model = CorrectedModel("line", TableModel("line", at, -2.5 - at, 2.5 + at), "line.csv", (-1.0, 12.0), {})
    data = prepare(table, model)
    problem = data.problem(noise_mm, 0, explained=True)
    found, gain = likeliest_map(problem, problem.nothing())
    return foretells_other_passes(problem, problem.nothing(), found), gain


@pytest.mark.parametrize("runs", [1, 3])
def test_a_map_that_repeats_foretells_the_other_passes(runs: int) -> None:
    input_mm, parts, noise_mm = loops((10.0,) * runs, 3)
    repeats, gain = mapped(input_mm, parts, 0.02 * np.sin(2.0 * np.pi * input_mm / 7.0), noise_mm)
    assert repeats
    assert gain > 10.0


def test_runs_of_different_gain_and_reach_are_no_map() -> None:
    input_mm, parts, noise_mm = loops((4.0, 7.0, 10.0), 4)
    gains = np.repeat([0.02, -0.015, 0.01], ROWS)
    repeats, gain = mapped(input_mm, parts, 2.0 * gains * input_mm, noise_mm)
    assert gain > 10.0, "the curve gains more than its price, and must be refused for another reason"
    assert not repeats


@pytest.mark.parametrize(("times", "words"), [(1, "commanded only once"), (2, None)])
def test_set_points_commanded_once_show_no_map(times: int, words: str | None) -> None:
    set_points = np.tile(np.random.default_rng(6).permutation(12).astype(float), times)
    input_mm = np.repeat(set_points, 20)
    time_s = 0.1 * np.arange(input_mm.size)
    history = History(input_mm, time_s, (slice(0, input_mm.size),), 1.0, 12.0, commanded=True)
    reason = why_no_map(history)
    assert reason is None if words is None else words in str(reason)


def test_a_log_of_few_rows_is_no_map_of_position_errors():
    # Between rows six times a second, the path of triangles is uncertain by more than the play of 10 um.
    one = draw(3305000, **PLAY_ALONE, noise_mm=1e-3, duration_s=12.0, missing=0.0)
    drive = DriveHistory(one.log_s, one.input_mm)
    found = named_play(one, drive, find_clock_offset(one.time_s, one.gap_mm, drive))
    assert found == "unknown []"


def test_a_map_larger_than_the_errors_of_the_log_is_named():
    rng = np.random.default_rng(4)
    fine_s, row_s, frame_s = np.arange(0.0, 24.0, 1e-3), np.arange(0.0, 24.0, 0.09), np.arange(0.02, 23.9, 0.04)
    corner_mm = np.interp(fine_s % 8.0, [0.0, 3.0, 4.0, 7.0, 8.0], [0.0, 1.0, 1.0, 0.0, 0.0])
    stage_mm = np.convolve(np.pad(corner_mm, (25, 25), mode="edge"), np.ones(51) / 51, "valid")
    place_mm = np.interp(frame_s, fine_s, stage_mm)
    bumps_mm = 0.012 * np.exp(-(((place_mm - 0.3) / 0.15) ** 2)) - 0.009 * np.exp(-(((place_mm - 0.75) / 0.2) ** 2))
    gap_mm = 1.2 + 7.72 * (place_mm + bumps_mm) + rng.normal(0.0, 1e-3, frame_s.size)
    log = DriveHistory(row_s, np.interp(row_s, fine_s, stage_mm))
    input_mm = np.interp(frame_s, row_s, log.input_mm)
    columns = {"time_s": frame_s.tolist(), "input_mm": input_mm.tolist(), "gap_mm": gap_mm.tolist()}
    table = replace(measured_from_columns(columns), clock=FoundClock(1e-3), log=log)
    found = fv.diagnose(table, {"input_mm": [-0.5, 1.6], "gap_mm": [-2.66, 13.552]}).report
    # A map has no straight line, so that offset and ratio may stand beside it.
    assert found.alternatives
    assert all("position_error_map" in names for names in found.alternatives)
