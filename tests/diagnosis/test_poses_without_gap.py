"""Tables of poses alone: the displacement of the body that moves most stands for the gap."""

from pathlib import Path

import numpy as np
import pytest

import fingervision as fv
from fingervision.domain.report import Verdict
from fingervision.models.lumped import MechanismFrame
from fingervision.storage.mechanism_toml import read_mechanism
from tests.benchmarks.films_of_mechanisms import DRAWINGS

PLAY_MM = 0.01
PARTS = {"x_mm": 3e-4, "y_mm": 3e-4, "angle_mrad": 0.02}


def drawn(folder: Path, *, pairs: bool) -> Path:
    """The lever's drawing, with or without the pairs of probes, one of which is the gap."""
    text = (DRAWINGS / "lever_jaw.toml").read_text(encoding="utf-8")
    path = folder / "lever.toml"
    path.write_text(text if pairs else text.partition("[[pair]]")[0], encoding="utf-8")
    return path


def recorded(path: Path, drawing: Path, rng: np.random.Generator, *, gap: bool = False) -> Path:
    """Drive the drawing to and fro through a play; the first run begins in its middle."""
    model, time_s = MechanismFrame(read_mechanism(drawing)), np.arange(0.0, 16.0, 0.04)
    given = 0.1 * (1.0 - np.cos(2.0 * np.pi * time_s / 8.0))
    got = np.empty_like(given)
    at = given[0] - 0.5 * PLAY_MM
    for k, x in enumerate(given):
        got[k] = at = min(max(at, x - 0.5 * PLAY_MM), x + 0.5 * PLAY_MM)
    rest, moved = model.state(0.0), model.state(1.0)
    columns = {"time_s": time_s, "input_mm": given}
    if gap:
        by_input = moved.pairs_mm["gap"] - rest.pairs_mm["gap"]
        columns["gap_mm"] = rest.pairs_mm["gap"] + by_input * got + rng.normal(0.0, 3e-4, got.size)
    for part, noise in PARTS.items():
        by_input = getattr(moved.bodies["lever"], part) - getattr(rest.bodies["lever"], part)
        columns[f"lever.{part}"] = by_input * got + rng.normal(0.0, noise, got.size)
    rows = np.stack(list(columns.values()), axis=1)
    np.savetxt(path, rows, "%.6f", ",", header=",".join(columns), comments="")
    return path


def test_a_play_is_named_from_poses_alone_and_the_corrected_model_agrees(tmp_path: Path) -> None:
    drawing = drawn(tmp_path, pairs=False)
    table = recorded(tmp_path / "poses.csv", drawing, np.random.default_rng(3))
    done = fv.diagnose(table, drawing)
    assert done.verdict is Verdict.NAMED
    assert [each.name for each in done.effects] == ["backlash"]
    play = done.effects[0].parameters["play_mm"]
    assert play.value == pytest.approx(PLAY_MM, abs=3.0 * play.u)
    done.save(tmp_path / "out")
    assert fv.diagnose(table, tmp_path / "out" / "model.toml").verdict is Verdict.AGREES


@pytest.mark.parametrize("seed", [3, 5])
def test_a_play_before_the_mechanism_is_no_fault_of_a_flexure(tmp_path: Path, seed: int) -> None:
    # The motion begins within the play: before its place there was known to the poses, a leaf had 8 um of play.
    drawing = drawn(tmp_path, pairs=True)
    table = recorded(tmp_path / "both.csv", drawing, np.random.default_rng(seed), gap=True)
    done = fv.diagnose(table, drawing)
    assert [(each.name, each.place) for each in done.effects] == [("backlash", "")]
