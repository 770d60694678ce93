"""--fingers, the polarity of every frame, and the sentence where the frames disagree."""

import json
from pathlib import Path

import cv2
import numpy as np
from click.testing import CliRunner

from fingervision.cli.measure import command
from tests.benchmarks.camera_artefacts.classes import plain
from tests.benchmarks.camera_artefacts.optics import Surface
from tests.csv_rows import csv_rows


def run(folder: Path, *more: str) -> tuple[list[str], dict]:
    out = folder / "m"
    arguments = [str(folder / "*.png"), "--rate-hz", "25", "--px-per-mm", "34", "--out", str(out), *more]
    CliRunner().invoke(command, arguments)
    return [row["fingers"] for row in csv_rows(out / "gaps.csv")], json.loads((out / "summary.json").read_text())


def test_frames_that_disagree_about_the_fingers(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    dark, light = Surface(), Surface(ground=0.12, finger=0.75)
    for k, surface in enumerate((dark, dark, light)):
        assert cv2.imwrite(str(tmp_path / f"{k}.png"), plain(rng, surface).picture)
    fingers, summary = run(tmp_path)
    assert fingers[:2] == ["dark", "dark"]
    assert fingers[2] != "light"
    assert summary["fingers"]["dark"] == sum(one == "dark" for one in fingers)
    assert any("--fingers" in words and "dark in 2 and light in 1" in words for words in summary["advice"])
    fingers, summary = run(tmp_path, "--fingers", "dark")
    assert fingers[:2] == ["dark", "dark"]
    assert fingers[2] != "light"
    assert not any("--fingers" in words for words in summary["advice"])
    assert summary["settings"]["fingers"] == "dark"
