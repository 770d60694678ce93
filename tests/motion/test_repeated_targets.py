"""Cycles of target visits are recognised in the path of the stage, and continuous motions are not taken for cycles."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingervision.diagnosis.report.positioning_accuracy import positioning_accuracy
from fingervision.motion.repeated_targets import NoRepeatedTargets, RepeatedTargets, repeated_targets
from tests.csv_rows import csv_rows

RIGS = Path(__file__).parents[3] / "shared" / "real" / "rigs"
PLACES = np.array([0.0, 1.0, 2.0, 3.0, 4.0])


def path(
    count: int = 5, *, overshoot_mm: float | None = 0.1, rows: int = 1, places: np.ndarray = PLACES
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Input, flags of measured rows, and true directions of `count` cycles, with or without rows beyond the ends."""
    inputs: list[float] = []
    sides: list[int] = []
    for _ in range(count):
        for side, leg in ((1, places), (-1, places[::-1])):
            if overshoot_mm is not None:
                inputs.append(leg[0] - side * overshoot_mm)
                sides.append(0)
            inputs += list(np.repeat(leg, rows))
            sides += [side] * (leg.size * rows)
    truth = np.array(sides)
    return np.array(inputs), truth != 0, truth[truth != 0]


def found(*given: object) -> RepeatedTargets:
    out = repeated_targets(*given)
    assert isinstance(out, RepeatedTargets), out
    return out


@pytest.mark.parametrize("overshoot_mm", [0.1, 0.001, None])
@pytest.mark.parametrize("rows", [1, 2])
@pytest.mark.parametrize("slope", [1.0, -1.0])
def test_targets_directions_and_cycles(overshoot_mm: float | None, rows: int, slope: float) -> None:
    inputs, measured, truth = path(overshoot_mm=overshoot_mm, rows=rows)
    cycle = np.repeat(np.arange(5), 10 * rows)
    out = found(slope * inputs, measured, (slice(0, inputs.size),))
    assert np.array_equal(out.direction, slope * truth)
    assert np.array_equal(out.cycle, cycle)
    assert np.allclose(out.target_mm, slope * inputs[measured])
    assert bool(out.notes) == (overshoot_mm is None)


def test_recorded_inputs_that_scatter_about_the_targets_are_gathered() -> None:
    inputs, measured, truth = path()
    noisy = inputs + np.random.default_rng(1).normal(0.0, 0.003, inputs.size)
    out = found(noisy, measured, (slice(0, inputs.size),))
    assert np.array_equal(out.direction, truth)
    assert np.unique(out.target_mm).size == PLACES.size
    assert np.allclose(out.target_mm, inputs[measured], atol=0.005)


@given(st.integers(0, 10**6), st.integers(3, 30), st.integers(2, 6), st.booleans(), st.integers(1, 5))
def test_any_cycle_is_recognised(seed: int, places: int, count: int, overshoots: bool, rows: int) -> None:
    # Uneven spacing, inputs that scatter by up to 1 % of the spacing, 3 % of the readings missing, one run per cycle or
    # one run in all.
    rng = np.random.default_rng(seed)
    spacing = 10.0 ** rng.uniform(-2.0, 1.0)
    targets = (np.arange(places) + rng.uniform(-0.3, 0.3, places)) * spacing
    beyond = rng.uniform(0.1, 1.0) * spacing if overshoots else None
    inputs, measured, truth = path(count, overshoot_mm=beyond, rows=rows, places=targets)
    inputs = inputs + rng.choice([0.0, 1e-4, 1e-2]) * spacing * rng.standard_normal(inputs.size)
    kept = rng.random(truth.size) >= 0.03
    measured[np.flatnonzero(measured)[~kept]] = False
    each = inputs.size // rng.choice([1, count])
    out = found(inputs, measured, tuple(slice(k, k + each) for k in range(0, inputs.size, each)))
    told = out.direction != 0
    assert np.array_equal(out.direction[told], truth[kept][told])
    assert np.mean(told) > (0.4 if rows > 3 else 0.9)


def test_a_turn_that_lacks_a_row_has_no_side() -> None:
    # There are no rows beyond the ends, and one of the two readings at a reversal is missing: the table does not show
    # which one.
    inputs, _, truth = path(overshoot_mm=None)
    at = 14
    inputs, truth = np.delete(inputs, at), np.delete(truth, at)
    out = found(inputs, np.ones(inputs.size, dtype=bool), (slice(0, inputs.size),))
    assert out.direction[at] == 0
    assert np.array_equal(np.delete(out.direction, at), np.delete(truth, at))
    assert any("not known" in note for note in out.notes)


def test_targets_need_not_be_evenly_spaced() -> None:
    inputs, measured, truth = path(places=np.array([0.0, 0.9, 2.3, 3.0, 4.4]), overshoot_mm=0.3)
    out = found(inputs, measured, (slice(0, inputs.size),))
    assert np.array_equal(out.direction, truth)


def test_a_missing_reading_does_not_shift_the_cycles_after_it() -> None:
    inputs, measured, truth = path()
    measured[3] = False
    out = found(inputs, measured, (slice(0, inputs.size),))
    assert np.array_equal(out.direction, np.delete(truth, 2))
    assert np.array_equal(out.cycle, np.delete(np.repeat(np.arange(5), 10), 2))


def test_runs_of_one_direction_come_from_beyond_the_end() -> None:
    inputs = np.tile(PLACES, 3)
    runs = tuple(slice(5 * k, 5 * k + 5) for k in range(3))
    out = found(inputs, np.ones(15, dtype=bool), runs)
    assert np.all(out.direction == 1)
    assert np.array_equal(out.cycle, np.repeat([0, 1, 2], 5))
    assert any("beyond" in note for note in out.notes)
    assert np.all(found(-inputs, np.ones(15, dtype=bool), runs).direction == -1)


def test_a_staircase_that_turns_at_its_ends_has_one_direction_there() -> None:
    # There is one rest at each end: the first visit has no direction, and all later visits of an end came from within
    # the range.
    inputs = np.concatenate([[0.0], np.tile([1.0, 2.0, 3.0, 2.0, 1.0, 0.0], 4)])
    out = found(inputs, np.ones(inputs.size, dtype=bool), (slice(0, inputs.size),))
    assert out.direction[0] == 0
    assert any("1 readings" in note for note in out.notes)
    assert np.all(out.direction[inputs == 3.0] == 1)
    assert np.all(out.direction[1:][inputs[1:] == 0.0] == -1)
    figures = positioning_accuracy(out.target_mm, np.zeros(inputs.size), out.direction, out.cycle)
    assert any("one side only" in note for note in figures.notes)


def test_the_first_half_of_a_long_rest_is_settling() -> None:
    inputs, measured, truth = path(rows=8)
    out = found(inputs, measured, (slice(0, inputs.size),))
    assert np.array_equal(out.direction, np.where(np.arange(truth.size) % 8 < 4, 0, truth))


@pytest.mark.parametrize(
    ("inputs", "words"),
    [
        (np.linspace(0.0, 1.0, 200), "form no targets"),
        (np.sin(np.linspace(0.0, 60.0, 1000)), "."),
        (np.random.default_rng(1).uniform(0.0, 1.0, 300), "."),
        (np.tile([0.0, 4.0], 40), "only 2 different"),
        (np.array([0.0, 1.0, 2.0, 3.0, 4.0]), "form no targets"),
        (np.array([0.0, 1.0, 2.0, 3.0, 2.0, 1.0]), "form no targets"),
        (np.full(20, 1.5), "never changes"),
        (np.array([1.0, 2.0]), "fewer than four"),
        (np.tile(0.01 * np.concatenate([np.arange(300), np.arange(300)[::-1]]), 3), "."),
        (np.concatenate([np.linspace(0.0, 3.0, 400) ** 1.3, np.tile([10.0, 11.0, 12.0], 3)]), "."),
    ],
)
def test_what_is_no_repeated_target_says_why(inputs: np.ndarray, words: str) -> None:
    out = repeated_targets(inputs, np.ones(inputs.size, dtype=bool), (slice(0, inputs.size),))
    assert isinstance(out, NoRepeatedTargets)
    assert re.search(words, out.reason)


def test_times_tell_a_motion_from_rests() -> None:
    inputs, measured, _ = path()
    times = 0.05 * np.arange(inputs.size)
    out = repeated_targets(inputs, measured, (slice(0, inputs.size),), times)
    assert isinstance(out, NoRepeatedTargets)
    assert "in motion" in out.reason
    assert isinstance(repeated_targets(inputs, measured, (slice(0, inputs.size),), 100 * times), RepeatedTargets)


@pytest.mark.parametrize("seed", range(5))
def test_a_triangle_recorded_by_an_encoder_is_no_cycle(seed: int) -> None:
    # Samples at 20 Hz with encoder steps of 30 um and a jitter of 3 um: values repeat, although the stage never rests.
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, 40.0, 0.05)
    travelled = np.abs((0.25 * times + 1.0) % 2.0 - 1.0)
    inputs = 0.03 * np.round((travelled + rng.normal(0.0, 0.003, times.size)) / 0.03)
    out = repeated_targets(inputs, np.ones(times.size, dtype=bool), (slice(0, times.size),), times)
    assert isinstance(out, NoRepeatedTargets)


@pytest.mark.skipif(not RIGS.exists(), reason="the measured tables of real rigs are not here (../shared/real/rigs)")
@pytest.mark.parametrize(
    ("name", "cycle_counts"),
    [
        ("ess_x_line", (45, 45)),
        ("ess_x_map_path", (45, 45)),
        ("muts_y50_map_path", (25, 25)),
        ("ess_z_fwd", (10, 0)),
        ("slit_11358_1_res", (42, 42)),
        ("slit_resolver_ripple", None),
        ("vac_zero_forw", None),
        ("sts3215_M3", None),
        ("servo_stop_low", None),
    ],
)
def test_measured_tables_of_real_rigs(name: str, cycle_counts: tuple[int, int] | None) -> None:
    rows = csv_rows(RIGS / name / "measured.csv")
    names = [row.get("run", "") for row in rows]
    runs = tuple(slice(names.index(n), names.index(n) + names.count(n)) for n in dict.fromkeys(names))
    inputs = np.array([float(row["input_mm"]) for row in rows])
    measured = np.array([bool(row["gap_mm"]) for row in rows])
    out = repeated_targets(inputs, measured, runs, np.array([float(row["time_s"]) for row in rows]))
    if cycle_counts is None:
        assert isinstance(out, NoRepeatedTargets)
    else:
        assert isinstance(out, RepeatedTargets)
        assert (np.sum(out.direction > 0), np.sum(out.direction < 0)) == cycle_counts
