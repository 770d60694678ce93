"""The path of the input: motions without measured gaps also move the play, and readings at rest show no lag."""

from pathlib import Path

import numpy as np
import pytest

from fingervision.diagnosis.diagnose import Diagnosis, diagnose
from fingervision.diagnosis.input.observations import stalled_ends
from fingervision.diagnosis.input.preparation import prepare
from fingervision.domain.report import Verdict
from fingervision.motion.encoder import on_lines
from fingervision.motion.recorded_input import is_commanded
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model
from tests.diagnosis.tables import written

PLAY_MM, NOISE_MM = 0.026, 0.002
TARGETS = np.arange(-20.0, 21.0, 5.0)
GAP_AT_ZERO_MM = 25.0


def staged(
    folder: Path,
    *,
    play_mm: float,
    listed: bool,
    sign: float = 1.0,
    step_s: float = 28.0,
    bent_mm: float = 0.0,
    warming_mm: float = 0.0,
) -> Diagnosis:
    """Five ISO 230-2 cycles of a stage with engaged play; overshoots are rows without a gap, or are missing."""
    rng = np.random.default_rng(4)
    lines, clock = ["time_s,input_mm,gap_mm"], 0.0
    for _ in range(5):
        for targets, way in ((TARGETS, 1.0), (TARGETS[::-1], -1.0)):
            bent = bent_mm * np.sin(np.pi * targets / 13.0 + 0.7)
            rows = [
                (targets[0] - 0.5 * way, None),
                *zip(targets, targets + bent - 0.5 * sign * way * play_mm, strict=True),
            ]
            for u, at in rows:
                clock += step_s
                warm = warming_mm * (1.0 - np.exp(-clock / 900.0))
                gap = "" if at is None else f"{GAP_AT_ZERO_MM + at + warm + NOISE_MM * rng.standard_normal():.6f}"
                if listed or at is not None:
                    lines.append(f"{clock:.2f},{u:.4f},{gap}")
    (folder / "measured.csv").write_text("\n".join(lines) + "\n")
    (folder / "sim.csv").write_text("input_mm,gap_mm\n-25,0\n25,50\n")
    return diagnose(read_measured_table(folder / "measured.csv"), read_model(folder / "sim.csv"))


@pytest.mark.parametrize("listed", [True, False])
def test_play_is_named_with_its_size_whether_overshoots_are_listed_or_not(tmp_path: Path, listed: bool) -> None:
    report = staged(tmp_path, play_mm=PLAY_MM, listed=listed).report
    assert report.verdict in (Verdict.NAMED, Verdict.AMBIGUOUS)
    assert ("backlash",) in report.alternatives
    play = next(e for e in report.effects if e.name == "backlash").parameters["play_mm"]
    assert play.value == pytest.approx(PLAY_MM, abs=4 * NOISE_MM / np.sqrt(90))
    assert report.pure_error_mm == pytest.approx(NOISE_MM, rel=0.25)
    assert report.explained_share > 0.95


@pytest.mark.parametrize("larger", [pytest.param("bent_mm", marks=pytest.mark.slow), "warming_mm"])
def test_play_between_overshoots_that_are_not_listed_is_named_beside_a_larger_error(
    tmp_path: Path, larger: str
) -> None:
    report = staged(tmp_path, play_mm=PLAY_MM, listed=False, **{larger: 4.0 * PLAY_MM}).report
    assert report.verdict in (Verdict.NAMED, Verdict.AMBIGUOUS)
    play = next(e for e in report.effects if e.name == "backlash").parameters["play_mm"]
    assert play.value == pytest.approx(PLAY_MM, abs=4 * NOISE_MM / np.sqrt(90))
    beside = "position_error_map" if larger == "bent_mm" else "thermal_drift"
    assert all(beside in names for names in report.alternatives)


def test_a_lag_is_excluded_where_readings_are_taken_at_rest(tmp_path: Path) -> None:
    report = staged(tmp_path, play_mm=PLAY_MM, listed=True).report
    reasons = {str(entry["name"]): str(entry["reason"]) for entry in report.excluded}
    assert "14" in reasons["drive_lag"]
    assert {"drive_lag", "camera_latency", "slew_limit"} <= set(reasons)


def test_nothing_hidden_agrees(tmp_path: Path) -> None:
    report = staged(tmp_path, play_mm=0.0, listed=True).report
    assert report.verdict is Verdict.AGREES
    assert report.effects == ()


def test_swapped_directions_are_asked_about_and_nothing_is_named(tmp_path: Path) -> None:
    report = staged(tmp_path, play_mm=PLAY_MM, listed=True, sign=-1.0).report
    assert report.verdict is Verdict.UNKNOWN
    assert report.effects == ()
    assert any("are the directions swapped" in note for note in report.notes)


def moved(folder: Path, u: np.ndarray, gap: np.ndarray, rate_hz: float = 25.0) -> Diagnosis:
    rows = [f"{k / rate_hz:.4f},{x:.7f},{g:.7f}" for k, (x, g) in enumerate(zip(u, gap, strict=True))]
    return diagnose(*written(folder, "time_s,input_mm,gap_mm", rows, "-3,1\n6,10"))


@pytest.mark.slow
@pytest.mark.parametrize("wrong", ["mirrored", "micrometres", "unrelated"])
def test_columns_that_cannot_be_right_get_a_sentence_and_no_name(tmp_path: Path, wrong: str) -> None:
    rng = np.random.default_rng(8)
    u = 2.0 * np.sin(np.arange(400) / 25.0)
    gap = {"mirrored": 4.0 - u, "micrometres": 1e3 * (4.0 + u), "unrelated": 4.0 + rng.standard_normal(400)}[wrong]
    report = moved(tmp_path, u, gap + 0.001 * rng.standard_normal(400)).report
    assert report.verdict is Verdict.UNKNOWN
    assert report.effects == ()
    assert {"mirrored": "mirrored", "micrometres": "units", "unrelated": "does not follow"}[wrong] in (
        report.unknown or ""
    )


@pytest.mark.slow
def test_a_resonance_that_hardly_follows_the_model_is_no_mistake_of_the_table(tmp_path: Path) -> None:
    """The motion lies on both sides of the resonance, so that the gap hardly follows the input."""
    time = np.arange(300) / 25.0
    inside = np.arange(0.0, time[-1], 1e-3)
    drive = sum(np.sin(2.0 * np.pi * f * inside + f**2) for f in (1.6, 2.3, 3.1, 3.7))
    state, places = np.zeros(2), []
    for force in drive:
        acting = (2.0 * np.pi * 2.9) ** 2 * (force - state[0]) - 2.0 * 0.1 * 2.0 * np.pi * 2.9 * state[1]
        state = state + 1e-3 * np.array([state[1] + 1e-3 * acting, acting])
        places.append(state[0])
    u, x = (np.interp(time, inside, each) / 4.0 for each in (drive, places))
    report = moved(tmp_path, u, 4.0 + 1.5 * x + 0.002 * np.random.default_rng(3).standard_normal(300)).report
    assert "structural_resonance" in {effect.name for effect in report.effects}, report.unknown


@pytest.mark.slow
def test_step_commands_are_no_encoder_and_their_dead_time_is_named(tmp_path: Path) -> None:
    rng = np.random.default_rng(9)
    time = np.arange(500) / 25.0
    u = np.where((time // 2.0) % 2 == 0, 0.0, 4.0)
    late = np.where(((time - 0.18) // 2.0) % 2 == 0, 0.0, 4.0)
    done = moved(tmp_path, u, 4.0 + np.where(time < 0.18, 0.0, late) + 0.002 * rng.standard_normal(500))
    assert done.data.recorded.commanded
    assert done.data.recorded.step_mm == 0.0
    named = {name for names in done.report.alternatives for name in names}
    assert {"drive_lag", "camera_latency"} <= named


def test_an_encoder_in_a_slow_motion_is_no_command() -> None:
    """Records of an encoder and of a command are constant between jumps; the gap of an encoder changes in between."""
    true = np.linspace(0.0, 1.0, 1000)
    record = 0.05 * np.round(true / 0.05)
    runs = (slice(0, 1000),)
    assert not is_commanded(record, runs, 4.0 + record, 4.0 + true)
    assert is_commanded(record, runs, 4.0 + record, 4.0 + record)


@pytest.mark.parametrize("zero", [0.0, 0.3, 0.5, 0.81])
def test_the_lines_of_an_encoder_are_found_off_zero_and_under_jitter(zero: float) -> None:
    rng = np.random.default_rng(10)
    step = 0.03
    true = 0.9 * np.sin(np.linspace(0.0, 14.0, 1500))
    lines = step * (np.round(true / step - zero) + zero)
    snapped = on_lines(lines + 0.1 * step * rng.standard_normal(1500), (slice(0, 1500),))
    assert np.mean(np.abs(snapped - lines) < 0.05 * step) > 0.995


@pytest.mark.parametrize("record", ["noise", "ramps"])
def test_what_lies_on_no_lines_stays_as_it_is(record: str) -> None:
    rng = np.random.default_rng(11)
    ramps = 0.9 * np.abs(((np.arange(1500) / 311.7) % 2.0) - 1.0)
    u = ramps if record == "ramps" else 0.9 * np.sin(np.linspace(0.0, 14.0, 1500)) + 0.002 * rng.standard_normal(1500)
    np.testing.assert_array_equal(on_lines(u, (slice(0, 1500),)), u)


def test_readings_that_stand_at_an_end_are_a_stop_and_stairs_are_none() -> None:
    u = np.linspace(1.0, 0.0, 120)
    stairs = 0.01 * np.round((2.0 + u) / 0.01)
    assert stalled_ends(u, 2.0 + u, stairs) == frozenset()
    stopped = np.maximum(stairs, 2.2)
    assert stalled_ends(u, 2.0 + u, stopped) == {"end_stop", "finger_contact"}


def test_rows_without_a_gap_are_the_path_and_are_not_compared(tmp_path: Path) -> None:
    done = staged(tmp_path, play_mm=PLAY_MM, listed=True)
    assert done.data.table.path is not None
    assert done.data.table.path.input_mm.size == done.data.table.input_mm.size + 10
    assert done.after_mm.size == done.data.table.input_mm.size
    again = prepare(done.data.table, read_model(tmp_path / "sim.csv"))
    assert any("10 of 100 rows" in note for note in again.notes)
