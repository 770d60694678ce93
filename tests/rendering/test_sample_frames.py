"""The sample frames agree with their notes, and their scripts reproduce them."""

import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from tests.csv_rows import csv_rows

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "sample_frames"
PX_PER_MM = 34.0
# The files give six decimals.
PRINTED = 1e-6

pytestmark = pytest.mark.skipif(not SAMPLES.is_dir(), reason="sample_frames is not part of this installation")


def rows(path: Path) -> list[dict[str, str]]:
    return csv_rows(path)


def column(path: Path, name: str) -> np.ndarray:
    return np.array([float(row[name]) for row in rows(path)])


@pytest.mark.slow
@pytest.mark.parametrize("case", ["table1", "reference"])
def test_a_script_makes_its_pictures_again(case: str, tmp_path: Path) -> None:
    """Grey levels and tables are reproduced; the bytes of a PNG also depend on the version of zlib."""
    script = SAMPLES / f"make_{case}.py"
    run = [sys.executable, "-c", f"import runpy; runpy.run_path({str(script)!r}, run_name='__main__')", str(tmp_path)]
    subprocess.run(run, check=True, cwd=ROOT)
    made = sorted(path.name for path in tmp_path.iterdir())
    kept = sorted(path.name for path in (SAMPLES / case).iterdir() if path.name not in ("NOTE.md", "calibration.json"))
    assert made == kept
    for name in made:
        if name.endswith(".png"):
            one, two = (cv2.imread(str(folder / name), cv2.IMREAD_UNCHANGED) for folder in (tmp_path, SAMPLES / case))
            assert np.array_equal(one, two), name
        else:
            assert (tmp_path / name).read_text() == (SAMPLES / case / name).read_text()


def test_table1_holds_the_papers_experiment() -> None:
    table, expected = SAMPLES / "paper" / "table1.csv", SAMPLES / "table1" / "expected_gaps.csv"
    assert len(rows(expected)) == 17
    assert np.max(np.abs(column(expected, "gap_mm") - column(table, "experiment_mm"))) <= PRINTED
    assert np.max(np.abs(column(expected, "gap_px") - PX_PER_MM * column(table, "experiment_mm"))) <= PRINTED
    assert np.max(np.abs(column(expected, "input_mm") - 1000.0 * column(table, "input_m"))) <= PRINTED
    for row in rows(expected):
        assert cv2.imread(str(SAMPLES / "table1" / row["file"]), cv2.IMREAD_UNCHANGED).shape == (480, 640)


def test_the_clip_is_small_and_keeps_its_clock() -> None:
    folder = SAMPLES / "opening"
    assert (folder / "opening.mp4").stat().st_size < 2_000_000
    with av.open(folder / "opening.mp4") as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264"
        times_s = [float(packet.pts * packet.time_base) for packet in container.demux(stream) if packet.pts is not None]
    expected = folder / "expected_gaps.csv"
    assert sorted(times_s) == pytest.approx(column(expected, "time_s").tolist(), abs=1e-5)
    assert {round(b - a, 4) for a, b in pairwise(sorted(times_s))} == {0.04}
    assert 10.0 <= len(times_s) / 25.0 <= 15.0


def test_the_clip_follows_its_drive_behind_the_play() -> None:
    """Model of a play, independent of the script: its output is never farther than half its width away."""
    folder = SAMPLES / "opening"
    expected, drive, simulation = (folder / f"{name}.csv" for name in ("expected_gaps", "drive", "simulation"))
    input_mm = np.interp(column(expected, "time_s"), column(drive, "time_s"), column(drive, "input_mm"))
    assert column(expected, "input_mm") == pytest.approx(input_mm, abs=PRINTED)
    assert (input_mm.min(), input_mm.max()) == pytest.approx((-0.45, 1.5), abs=0.01)
    simulated = np.interp(input_mm, column(simulation, "input_mm"), column(simulation, "gap_mm"))
    behind_mm = (simulated - column(expected, "gap_mm")) / 7.7212
    assert np.max(np.abs(behind_mm)) == pytest.approx(0.015, abs=1e-5)
    assert behind_mm[50] == pytest.approx(0.015, abs=1e-5)
    assert behind_mm[180] == pytest.approx(-0.015, abs=1e-5)


def test_the_references_are_six_bars_and_a_slot() -> None:
    sizes = rows(SAMPLES / "reference" / "sizes.csv")
    assert [(row["kind"], float(row["size_mm"])) for row in sizes] == [
        *(("bar", size) for size in (2.0, 5.0, 8.0, 11.0, 14.0, 17.0)),
        ("slot", 3.0),
    ]
    for row in sizes:
        picture = cv2.imread(str(SAMPLES / "reference" / row["file"]), cv2.IMREAD_UNCHANGED)
        light = 40.0 if row["kind"] == "bar" else 200.0
        # The row's sum of grey levels is the object's width along the row: noise of 2 on 640 pixels, 0.3 px.
        width_px = ((picture[100:380].mean(axis=0) - (240.0 - light)) / (2 * light - 240.0)).sum()
        turned_px = float(row["size_px"]) / np.cos(np.radians(float(row["turn_deg"])))
        assert width_px == pytest.approx(turned_px, abs=0.1)


def test_every_case_says_how_it_was_made() -> None:
    for case in ("table1", "opening", "reference", "paper"):
        assert (SAMPLES / case / "NOTE.md").read_text().startswith("# ")
