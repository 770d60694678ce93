"""Tables with poor data: no wrong effect is named with confidence, and a sentence states the fault, if any."""

import re
from pathlib import Path

import numpy as np
import pytest

import fingervision as fv
from fingervision.diagnosis.diagnose import diagnose
from fingervision.domain.errors import DataError
from fingervision.domain.report import DiagnosisReport, Verdict
from tests.diagnosis.tables import written

PLAY_MM, NOISE_MM, GAP_MM = 0.04, 0.002, 3.0
SAMPLE = Path(__file__).parents[2] / "sample_frames" / "opening"
TARGETS = np.linspace(0.0, 2.0, 9)
Columns = dict[str, np.ndarray]
EVERY_S = 20.0
CONSTANTS = {"rest_gap_error", "input_offset", "edge_bias"}


def stage(directions: str, cycles: int, play_mm: float = PLAY_MM, offset_mm: float = 0.0) -> Columns:
    """Readings of a stage with play, at rest: the gap is 3 mm plus the position; `+` and `-` are the directions of
    approach.
    """
    rng = np.random.default_rng(11)
    strokes = [(TARGETS if way == "+" else TARGETS[::-1], 1.0 if way == "+" else -1.0) for way in directions] * cycles
    u = np.concatenate([targets for targets, _ in strokes])
    place = np.concatenate([targets - 0.5 * way * play_mm for targets, way in strokes])
    gap = GAP_MM + offset_mm + place + NOISE_MM * rng.standard_normal(u.size)
    return {"time_s": EVERY_S * np.arange(u.size), "input_mm": u, "gap_mm": gap}


def asked(folder: Path, table: Columns, slope: float = 1.0, scale: float = 1.0) -> DiagnosisReport:
    """Diagnose a table with a model whose gap is 3 mm plus `slope` times the input, with lengths in a unit set by
    `scale`.
    """
    rows = (",".join(f"{value:.6f}" for value in row) for row in zip(*table.values(), strict=True))
    ends = "\n".join(f"{u},{scale * (GAP_MM + slope * u)}" for u in (-0.5, 2.5))
    return diagnose(*written(folder, ",".join(table), rows, ends)).report


def singles(report: DiagnosisReport) -> set[str]:
    """Names of the effects that alone explain the table."""
    assert all(len(names) == 1 for names in report.alternatives)
    return {name for names in report.alternatives for name in names}


@pytest.mark.parametrize("cycles", [5, 1], ids=["one direction", "one visit"])
def test_play_seen_from_one_side_is_one_of_several_constants(tmp_path: Path, cycles: int) -> None:
    report = asked(tmp_path, stage("+", cycles))
    assert report.verdict is Verdict.AMBIGUOUS
    assert singles(report) >= CONSTANTS
    if cycles == 1:
        assert "backlash" in singles(report)
    shift = next(e for e in report.effects if e.name in CONSTANTS).parameters["offset_mm"]
    assert shift.value == pytest.approx(-PLAY_MM / 2, abs=4 * NOISE_MM / np.sqrt(cycles * TARGETS.size))
    assert any("cannot be distinguished from an offset" in note for note in report.notes)


def test_one_visit_of_nine_places_agrees_only_if_its_noise_is_stated(tmp_path: Path) -> None:
    table = stage("+", 1, play_mm=0.0)
    report = asked(tmp_path, table)
    assert report.verdict is Verdict.UNKNOWN
    assert not report.effects
    assert report.pure_error_mm is None
    assert "no position was read twice" in report.sentence
    assert "state u_random_mm" in report.sentence
    assert report.remaining.endswith("random noise or an error of the model.")
    stated = asked(tmp_path, table | {"u_random_mm": np.full(TARGETS.size, NOISE_MM)})
    assert stated.verdict is Verdict.AGREES


def test_a_run_of_one_row_is_diagnosed_with_the_others(tmp_path: Path) -> None:
    table = stage("+-", 3)
    last = np.arange(table["input_mm"].size) == table["input_mm"].size - 1
    report = asked(tmp_path, {"run": np.where(last, 2.0, 1.0)} | table)
    assert "backlash" in singles(report)


def test_without_times_the_effects_that_need_an_order_are_said_to_be_hidden(tmp_path: Path) -> None:
    table = stage("+-", 3)
    del table["time_s"]
    assert any("the table has no times" in note for note in asked(tmp_path, table).notes)


def test_times_in_whole_seconds_that_repeat_are_refused_and_others_are_used(tmp_path: Path) -> None:
    table = stage("+-", 3)
    step = table["time_s"] / EVERY_S
    with pytest.raises(DataError, match="write the times with more digits"):
        asked(tmp_path, table | {"time_s": np.floor(0.4 * step)})
    report = asked(tmp_path, table | {"time_s": np.floor(1.3 * step)})
    assert report.verdict in (Verdict.NAMED, Verdict.AMBIGUOUS)
    assert "backlash" in singles(report)


def test_times_that_are_all_equal_are_refused(tmp_path: Path) -> None:
    table = stage("+-", 3)
    with pytest.raises(DataError, match="time_s must be unique within a run, but 7 s occurs in every row"):
        asked(tmp_path, table | {"time_s": np.full(table["time_s"].size, 7.0)})


def test_a_model_of_reversed_sign_is_said_and_nothing_is_named(tmp_path: Path) -> None:
    report = asked(tmp_path, stage("+-", 2), slope=-1.0)
    assert report.verdict is Verdict.UNKNOWN
    assert report.effects == ()
    assert "is mirrored" in (report.unknown or "")


def rubbed(input_mm: np.ndarray, reach_mm: float) -> np.ndarray:
    """Deflection of a band that rubs on the stage, and slips beyond `reach_mm`."""
    out, at = np.empty_like(input_mm), 0.0
    for k, step in enumerate(np.diff(input_mm, prepend=input_mm[0])):
        at = float(np.clip(at + step, -reach_mm, reach_mm))
        out[k] = at
    return out


@pytest.mark.slow
def test_a_loop_larger_than_its_spring_is_no_exchange_of_directions(tmp_path: Path) -> None:
    # Force against displacement of a friction damper, which grips harder to one side; the model is its best spring.
    rng = np.random.default_rng(7)
    time_s = 0.02 * np.arange(400)
    u = 0.5 * np.sin(2.0 * np.pi * time_s) * np.minimum(1.0, time_s / 0.5)
    force = u + 12.0 * rubbed(u, 0.1) * (1.0 + 0.6 * np.sign(rubbed(u, 0.3)) * u) + 0.01 * rng.standard_normal(u.size)
    report = asked(tmp_path, {"time_s": time_s, "input_mm": u, "gap_mm": GAP_MM + force}, np.polyfit(u, force, 1)[0])
    assert report.verdict is Verdict.UNKNOWN
    assert "swapped" not in str(report.unknown)


def test_exchanged_directions_are_asked_about(tmp_path: Path) -> None:
    report = asked(tmp_path, stage("+-", 4, play_mm=-PLAY_MM))
    assert report.verdict is Verdict.UNKNOWN
    assert "swapped" in str(report.unknown)
    assert not report.effects


@pytest.mark.parametrize("scale", [1e3, 1.0 / 25.4, 2.0])
def test_a_model_in_another_unit_is_said_and_nothing_is_named(tmp_path: Path, scale: float) -> None:
    report = asked(tmp_path, stage("+-", 2, play_mm=0.0), scale=scale)
    assert report.verdict is Verdict.UNKNOWN
    assert report.effects == ()
    said = re.search(r"moves (\S+) times as far as the model predicts: check the units", report.unknown or "")
    assert said is not None
    assert float(said.group(1)) == pytest.approx(1.0 / scale, rel=0.01)


@pytest.mark.parametrize("gain", [1.0, -1.0, 1.0 / 25.4])
def test_a_servo_that_lags_far_does_not_hide_a_mistaken_column(tmp_path: Path, gain: float) -> None:
    # A dead time and a speed limit leave half of the motion unexplained: no gain alone explains the other half.
    rng = np.random.default_rng(11)
    time_s = 0.1 * np.arange(120)
    u = np.repeat(rng.uniform(0.0, 2.0, 12), 10)
    late = np.interp(time_s - 0.3, time_s, u)
    gap = np.empty_like(late)
    at = late[0]
    for k, aim in enumerate(late):
        at = float(np.clip(aim, at - 0.25, at + 0.25))
        gap[k] = at
    gap = GAP_MM + gain * (gap + NOISE_MM * rng.standard_normal(u.size))
    report = asked(tmp_path, {"time_s": time_s, "input_mm": u, "gap_mm": gap})
    asks = re.search("is mirrored|0.0394 times as far", report.unknown or "")
    assert (asks is not None) == (gain != 1.0)
    assert bool(report.effects) == (gain == 1.0)


def test_exchanged_columns_within_the_model_are_asked_about() -> None:
    # The inverse of a bent curve was named: an offset of the input, a large deflection and another rest gap.
    rng = np.random.default_rng(5)
    model_mm = np.linspace(-0.2, 3.0, 65)
    model = {"input_mm": model_mm, "gap_mm": 0.3 + 0.65 * model_mm + 0.05 * model_mm**2}
    time_s = 0.1 * np.arange(150)
    u = 0.7 - 0.6 * np.cos(2.0 * np.pi * time_s / 7.0)
    gap = np.interp(u, *model.values()) + NOISE_MM * rng.standard_normal(u.size)
    found = fv.diagnose({"time_s": time_s, "input_mm": gap, "gap_mm": u}, model)
    assert found.verdict is Verdict.UNKNOWN
    assert "better if they are exchanged" in found.report.sentence
    assert fv.diagnose({"time_s": time_s, "input_mm": u, "gap_mm": gap}, model).verdict is Verdict.AGREES


def test_an_end_stop_that_holds_a_model_in_micrometres_still_explains_nothing() -> None:
    measured = fv.read_table(SAMPLE / "expected_gaps.csv", "measured")
    simulation = fv.read_table(SAMPLE / "simulation.csv", "simulation")
    gap_um = 1e3 * (simulation.right_mm - simulation.left_mm)
    found = fv.diagnose(measured, {"input_mm": simulation.input_mm, "gap_mm": gap_um})
    assert found.verdict is Verdict.UNKNOWN
    assert "0.001 times as far as the model predicts" in found.report.sentence


@pytest.mark.parametrize(("gain", "asks"), [(0.5, True), (1.25, False)])
def test_a_gain_that_effects_hardly_have_is_asked_about(tmp_path: Path, gain: float, asks: bool) -> None:
    # Half of the motion within one minute was named a creep of half of the opening with 64 s.
    rng = np.random.default_rng(5)
    time_s = 0.2 * np.arange(200)
    u = 1.0 + np.arcsin(np.sin(2.0 * np.pi * time_s / 12.0)) / np.pi
    gap = GAP_MM + gain * u + NOISE_MM * rng.standard_normal(u.size)
    report = asked(tmp_path, {"time_s": time_s, "input_mm": u, "gap_mm": gap})
    assert (report.verdict is Verdict.UNKNOWN) == asks
    assert ("check the units" in str(report.unknown)) == asks


@pytest.mark.parametrize("timed", [True, False])
@pytest.mark.parametrize("offset_mm", [0.0, 0.5])
def test_two_thirds_of_wrong_rows_are_no_noise(tmp_path: Path, offset_mm: float, timed: bool) -> None:
    rng = np.random.default_rng(3)
    table = stage("+-", 4, play_mm=0.0, offset_mm=offset_mm)
    wrong = rng.random(table["gap_mm"].size) < 2.0 / 3.0
    table["gap_mm"] = table["gap_mm"] + np.where(wrong, 0.3 * rng.standard_normal(wrong.size), 0.0)
    report = asked(tmp_path, table if timed else {name: table[name] for name in ("input_mm", "gap_mm")})
    assert report.verdict is Verdict.UNKNOWN
    assert report.effects == ()
    assert "the rows are not one measurement with one noise" in (report.unknown or "")


@pytest.mark.parametrize(("share", "agrees"), [(0.1, False), (0.01, True)])
def test_a_scatter_of_a_tenth_of_the_motion_shows_no_agreement(tmp_path: Path, share: float, agrees: bool) -> None:
    rng = np.random.default_rng(8)
    time_s = 0.3 * np.arange(160)
    u = 1.0 + np.arcsin(np.sin(2.0 * np.pi * time_s / 12.0)) / np.pi
    gap = GAP_MM + u + share * np.ptp(u) * rng.standard_normal(u.size)
    report = asked(tmp_path, {"time_s": time_s, "input_mm": u, "gap_mm": gap})
    assert (report.verdict is Verdict.AGREES) == agrees
    assert ("too large to tell" in report.sentence) == (not agrees)
