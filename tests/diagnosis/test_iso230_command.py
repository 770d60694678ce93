"""`diagnose` reads a table of targets, cycles and directions and reports the quantities of ISO 230-2."""

import json
from pathlib import Path

import numpy as np

from tests.commands import printed


def test_targets_in_figures_out_with_an_effect_on_request(tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    lines = ["target_mm,cycle,direction,deviation_um"]
    for cycle in range(1, 6):
        for side, word in ((1, "up"), (-1, "down")):
            lines += [f"{t},{cycle},{word},{-10.0 * side + rng.normal():.3f}" for t in np.linspace(-3.0, 3.0, 7)]
    measured, model, out = (tmp_path / name for name in ("measured.csv", "simulation.csv", "out"))
    measured.write_text("\n".join(lines) + "\n")
    model.write_text("input_mm,gap_mm\n-3,-3\n3,3\n")
    words = ["--model", str(model), "--out", str(out), "--with", "input_offset"]
    said = printed("diagnose", str(measured), *words)
    assert "Read as an ISO 230-2 table: 7 targets, 5 cycles" in said
    report = json.loads((out / "report.json").read_text())
    assert "input_offset" in [effect["name"] for effect in report["effects"]]
    section = report["iso230"]
    readings = {(w, t): [] for w in ("up", "down") for t in range(-3, 4)}
    for line in lines[1:]:
        target, _, word, deviation = line.split(",")
        readings[word, round(float(target))].append(float(deviation))
    reversals = [np.mean(readings["up", t]) - np.mean(readings["down", t]) for t in range(-3, 4)]
    assert np.isclose(section["figures"]["B_mean"]["value"], 1e-3 * np.mean(reversals), rtol=0.0, atol=1e-12)
    page = (out / "report.html").read_text()
    assert "ISO 230-2" in page
    assert "as play causes them" in page
