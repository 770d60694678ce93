"""From a table and its model to the quantities of a published report and the causes of each quantity."""

import json
from pathlib import Path

import numpy as np
import pytest

from fingervision.diagnosis.diagnose import diagnose
from fingervision.diagnosis.report.positioning_accuracy import DEFINITIONS
from fingervision.diagnosis.report.positioning_of_data import (
    MODEL,
    PositioningReport,
    positioning_document,
    positioning_html,
    positioning_of_data,
    positioning_of_table,
    positioning_section,
    positioning_words,
)
from fingervision.motion.repeated_targets import NoRepeatedTargets
from fingervision.storage.model_toml import read_model
from fingervision.tables.read import read_measured_table
from tests.csv_rows import csv_rows

RIGS = Path(__file__).parents[3] / "shared" / "real" / "rigs"
PATH = np.tile(np.concatenate([[-0.5], np.arange(5.0), [4.5], np.arange(5.0)[::-1]]), 5)
MEASURED = np.abs(PATH - 2.0) <= 2.0
SIDE = np.tile(np.repeat([1, -1], 5), 5)


def columns(path: Path) -> dict[str, np.ndarray]:
    rows = csv_rows(path)
    return {
        name: np.array([float(row[name] or "nan") for row in rows])
        for name in ("time_s", "input_mm", "gap_mm")
        if name in rows[0]
    }


def report(
    gap_mm: np.ndarray, model: object, answer: dict[str, dict[str, float]] | None = None, path: np.ndarray = PATH
) -> PositioningReport:
    def predict(acting: dict[str, dict[str, float]]) -> np.ndarray:
        return model(path[MEASURED]) - 0.5 * SIDE * acting.get("backlash", {"play_mm": 0.0})["play_mm"]

    found = positioning_of_table(path, MEASURED, (slice(0, path.size),), None, gap_mm, predict, answer or {})
    assert isinstance(found, PositioningReport)
    return found


@pytest.mark.skipif(not RIGS.exists(), reason="the measured tables of real rigs are not here (../shared/real/rigs)")
@pytest.mark.parametrize("name", ["ess_x_line", "ess_x_map_path"])
def test_a_published_report_whatever_the_model(name: str) -> None:
    # The quantities of the axis are the same for an ideal line without overshoots and for the map of the axis with
    # overshoots.
    measured, model = columns(RIGS / name / "measured.csv"), columns(RIGS / name / "simulation.csv")
    read = np.isfinite(measured["gap_mm"])
    inputs = measured["input_mm"]
    found = positioning_of_table(
        inputs,
        read,
        (slice(0, inputs.size),),
        measured["time_s"],
        measured["gap_mm"][read],
        lambda acting: (
            np.interp(inputs[read], model["input_mm"], model["gap_mm"])
            - 0.5 * 0.0254 * np.where(np.arange(read.sum()) % 18 < 9, 1, -1) * ("backlash" in acting)
        ),
        {"backlash": {"play_mm": 0.0254}},
    )
    assert isinstance(found, PositioningReport)
    axis = {s: found.measured.value_mm(s) for s in ("B_mean", "B", "R_down", "E_down", "M")}
    published = {"B_mean": -0.02537, "B": 0.03358, "R_down": 0.02831, "E_down": 0.09065, "M": 0.09365}
    assert axis == pytest.approx(published, abs=0.5e-5)
    assert found.share_mm("backlash", "B_mean") == pytest.approx(-0.0254)
    assert found.after.value_mm("B_mean") == pytest.approx(0.00003, abs=1e-5)
    if name == "ess_x_map_path":
        # The map of the axis is the whole cause of M.
        assert found.share_mm(MODEL, "M") == pytest.approx(0.09365, abs=2e-6)
        assert found.share_mm(MODEL, "B_mean") == pytest.approx(0.0, abs=1e-6)
    else:
        assert set(found.without) == {"backlash"}


def test_a_gripper_is_compared_with_its_model() -> None:
    def model(inputs: np.ndarray) -> np.ndarray:
        return 4.0 + 7.7 * inputs + 0.1 * inputs**2

    found = report(model(PATH[MEASURED]) - 0.01 * SIDE, model, {"backlash": {"play_mm": 0.02}})
    assert found.reference == "model"
    assert found.measured.value_mm("E") == pytest.approx(0.02)
    assert found.after.value_mm("E") == pytest.approx(0.0, abs=1e-12)
    document = positioning_document(found)
    assert document["reference"] == "model"
    assert "not the axis alone" in document["notes"][0]
    assert "as play causes them" in positioning_words(found)[0]


@pytest.mark.parametrize("slope", [1.0, -1.0])
@pytest.mark.parametrize("play_mm", [0.02, -0.02])
def test_a_reversal_of_the_wrong_sign_is_asked_about(slope: float, play_mm: float) -> None:
    # With play, a stage that approaches from below lags; the gap may increase or decrease with the position.
    rng = np.random.default_rng(4)
    gap = 10.0 + slope * (PATH[MEASURED] - 0.5 * play_mm * SIDE) + rng.normal(0.0, 1e-3, SIDE.size)
    found = report(gap, lambda inputs: 10.0 + slope * inputs)
    assert found.reference == "target"
    assert found.after is None
    assert ("swapped?" in positioning_words(found)[0]) == (play_mm < 0.0)
    assert ("as play causes them" in positioning_words(found)[0]) == (play_mm > 0.0)


def test_a_reversal_within_its_uncertainty_has_no_side() -> None:
    gap = PATH[MEASURED] + np.random.default_rng(4).normal(0.0, 1e-3, SIDE.size)
    words = positioning_words(report(gap, lambda inputs: inputs))[0]
    assert "readings" not in words


def test_a_rest_gap_changes_no_figure() -> None:
    gap = PATH[MEASURED] - 0.01 * SIDE + 0.003 * np.sin(PATH[MEASURED])
    plain, shifted = (report(gap + c, lambda inputs: inputs + 3.0).measured for c in (0.0, 25.0))
    for symbol, figure in plain.figures.items():
        assert shifted.figures[symbol].value_mm == pytest.approx(figure.value_mm, abs=1e-12)


def test_a_sweep_has_no_figures_and_says_why() -> None:
    inputs = np.linspace(0.0, 4.0, 60)
    ones = np.ones(60, dtype=bool)
    found = positioning_of_table(inputs, ones, (slice(0, 60),), None, inputs, lambda _: inputs, {})
    assert isinstance(found, NoRepeatedTargets)
    assert "form no targets" in found.reason


def test_a_diagnosed_table_of_targets_tells_the_play(tmp_path: Path) -> None:
    # A table of seven targets and five cycles with directions, with 20 um of play and 1 um of scatter.
    rng = np.random.default_rng(8)
    lines = ["target_mm,cycle,direction,deviation_um"]
    for cycle in range(1, 6):
        for side, word in ((1, "up"), (-1, "down")):
            lines += [f"{t},{cycle},{word},{-10.0 * side + rng.normal():.3f}" for t in np.linspace(-3.0, 3.0, 7)]
    targets, model = (tmp_path / name for name in ("targets.csv", "simulation.csv"))
    targets.write_text("\n".join(lines) + "\n")
    model.write_text("input_mm,gap_mm\n-4,-4\n4,4\n")
    done = diagnose(read_measured_table(targets), read_model(model))
    answer = {e.name: {name: known.value for name, known in e.parameters.items()} for e in done.report.effects}
    found = positioning_of_data(done.data, answer)
    assert found.cycles == (5, 5)
    assert found.measured.value_mm("B_mean") == pytest.approx(-0.02, abs=0.001)
    # E is a range over fourteen means of five readings with 1 um of scatter; the tolerance is five times this scatter.
    assert found.measured.value_mm("E") == pytest.approx(0.02, abs=0.005)
    assert found.share_mm("backlash", "B_mean") == pytest.approx(-0.02, abs=0.002)
    assert "backlash" in found.without
    section = json.loads(json.dumps(positioning_section(found), allow_nan=False))
    assert section["figures"]["R"]["value"] == found.measured.value_mm("R")
    page = positioning_html(found)
    assert all(symbol in page for symbol in DEFINITIONS)


def test_a_table_without_targets_has_a_section_with_the_reason() -> None:
    section = positioning_section(NoRepeatedTargets("the inputs do not repeat"))
    assert section["figures"] is None
    assert section["reason"] == "the inputs do not repeat"
    assert positioning_html(NoRepeatedTargets("the inputs do not repeat")) is None
