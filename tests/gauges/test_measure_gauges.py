"""`measure --gauges` writes gauges.csv next to gaps.csv, in millimetres, for frames of any kind."""

import csv
import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli import cli
from tests.commands import printed
from tests.csv_rows import csv_rows
from tests.gauges.drawn import bar, drawn, half_plane, seen

SHAPE = (96, 128)
EDGE = '[[gauge]]\nname = "the, edge"\nkind = "edge"\nx_px = 40\ny_px = 48\ndirection_deg = 0\nlength_px = 40\n'
PAIR = (
    '[[gauge]]\nname = "bar"\nkind = "pair"\nx_px = 90\ny_px = 48\ndirection_deg = 0\ndistance_px = 20\n'
    "length_px = 30\nreach_px = 6\n"
)
GAP = '[[gauge]]\nname = "gap"\nkind = "gap"\nx_px = 64\ny_px = 48\nwidth_px = 120\nheight_px = 90\n'


def _folder(tmp_path: Path, gauges: str) -> tuple[Path, Path]:
    frames = tmp_path / "frames"
    frames.mkdir()
    rng = np.random.default_rng(3)
    for number, x in enumerate((40.0, 42.5, 45.25)):
        light = drawn(SHAPE, 60, [(half_plane(x, 48, 0.0), 160), (bar(90, 48, 0.0, 20), 60)])
        cv2.imwrite(str(frames / f"{number:03d}.png"), seen(light, 1.0, rng))
    path = tmp_path / "gauges.toml"
    path.write_text("schema = 1\n" + gauges, encoding="utf-8")
    return frames, path


def _measured(tmp_path: Path, gauges: str, *options: str) -> tuple[int, str, Path]:
    frames, path = _folder(tmp_path, gauges)
    out = tmp_path / "out"
    arguments = ["measure", str(frames), "--px-per-mm", "20", "--gauges", str(path), "--out", str(out), *options]
    done = CliRunner().invoke(cli, arguments, catch_exceptions=True)
    return done.exit_code, f"{done.output}{done.stderr}{done.exception}", out


def test_the_table(tmp_path: Path) -> None:
    code, words, out = _measured(tmp_path, EDGE + PAIR + GAP, "--rate-hz", "25", "--overlay", "--steps", "1")
    assert code == 0, words
    lines = (out / "gauges.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "time_s,gauge,quantity,value,u,unit,status,u_random,u_motion"
    rows = list(csv.DictReader(lines))
    assert len(rows) == 9
    edges = [row for row in rows if row["gauge"] == "the, edge"]
    for row, x, time_s in zip(edges, (40.0, 42.5, 45.25), (0.0, 0.04, 0.08), strict=True):
        assert float(row["time_s"]) == pytest.approx(time_s)
        assert (row["quantity"], row["unit"], row["status"]) == ("position", "mm", "ok")
        assert float(row["value"]) == pytest.approx((x - 63.5) / 20, abs=5 * float(row["u"]))
        assert 0.0 < float(row["u"]) < 0.001
    bars = [row for row in rows if row["gauge"] == "bar"]
    assert all(float(row["value"]) == pytest.approx(1.0, abs=5 * float(row["u"])) for row in bars)
    gaps = [row for row in rows if row["gauge"] == "gap"]
    assert all(row["status"] != "ok" and row["value"] == "" and row["u"] == "" for row in gaps)
    assert (out / "gaps.csv").exists()
    assert (out / "overlay.mp4").stat().st_size > 0
    assert (out / "steps" / "07_gauges.png").exists()
    assert "bar" in words


@pytest.mark.parametrize("given", [(), ("--fingers", "none")])
def test_where_no_frame_shows_fingers_the_report_is_about_the_gauges(tmp_path: Path, given: tuple[str, ...]) -> None:
    code, words, out = _measured(tmp_path, EDGE + PAIR, "--rate-hz", "25", *given)
    assert code == 0, words
    assert "finger " not in words
    assert "one_finger" not in words
    assert not (out / "gap.png").exists()
    assert cv2.imread(str(out / "gauges.png")) is not None
    assert ({row["status"] for row in csv_rows(out / "gaps.csv")} == {"not_asked"}) == bool(given)
    summary = json.loads((out / "summary.json").read_text())
    assert summary["settings"]["fingers"] == "none"
    assert summary["gauges"]["bar"]["counts"] == {"ok": 3}
    for line in ("3 frames", "Gauge the, edge (edge): 3 of 3 frames", "gauges.png"):
        assert line in words


def test_fingers_are_measured_beside_gauges_where_they_are_seen(tmp_path: Path) -> None:
    gauge = '[[gauge]]\nname = "edge"\nkind = "edge"\nx_px = 320\ny_px = 100\ndirection_deg = 0\nlength_px = 20\n'
    (tmp_path / "gauges.toml").write_text("schema = 1\n" + gauge)
    given = ["--px-per-mm", "34", "--gauges", str(tmp_path / "gauges.toml"), "--out", str(tmp_path / "out")]
    words = printed("measure", "sample_frames/table1", *given)
    assert words.startswith("17 of 17 frames measured.")
    assert "Gauge edge" in words
    assert {row["status"] for row in csv_rows(tmp_path / "out" / "gaps.csv")} == {"ok"}


@pytest.mark.parametrize("asks", [("--fingers", "auto"), ("--roi", "0,0,128,96"), ("--tips", "up"), ("--steps", "0")])
def test_an_option_about_fingers_asks_for_them(tmp_path: Path, asks: tuple[str, ...]) -> None:
    _, words, out = _measured(tmp_path, PAIR, *asks)
    assert "not_asked" not in {row["status"] for row in csv_rows(out / "gaps.csv")}
    assert (out / "gap.png").exists()
    assert "frames measured" in words


def test_gauges_alone_have_no_height_below_tips(tmp_path: Path) -> None:
    """At the scale of a microscope, 0.3 mm below a tip may lie outside the picture."""
    code, words, out = _measured(tmp_path, PAIR, "--px-per-mm", "2000")
    assert code == 0, words
    assert float(csv_rows(out / "gauges.csv")[0]["value"]) == pytest.approx(0.01, abs=1e-4)


def test_gauges_alone_without_any_number_say_why(tmp_path: Path) -> None:
    far = PAIR.replace("x_px = 90", "x_px = 20").replace("distance_px = 20", "distance_px = 8")
    code, words, _ = _measured(tmp_path, far)
    assert code == 1
    assert "No gauge has a value in any of the 3 frames: bar is" in words
    assert "low_contrast in frame 0: the object has too little contrast" in words


def test_a_drive_needs_the_gap(tmp_path: Path) -> None:
    (tmp_path / "drive.csv").write_text("time_s,input_mm\n0,0\n1,1\n")
    code, words, _ = _measured(tmp_path, PAIR, "--fingers", "none", "--drive", str(tmp_path / "drive.csv"))
    assert code
    assert "--drive" in words
    assert "none" in words


def test_a_gauge_outside_of_the_picture_is_refused(tmp_path: Path) -> None:
    code, words, out = _measured(tmp_path, EDGE.replace("x_px = 40", "x_px = 400"))
    assert code == 1
    assert "the, edge" in words
    assert "128x96" in words
    assert not (out / "gauges.csv").exists()


def test_gauges_without_any_number_end_as_gaps_do(tmp_path: Path) -> None:
    code, words, out = _measured(tmp_path, GAP)
    assert code == 1
    assert "None of the 3 frames" in words
    assert (out / "gauges.csv").exists()


def test_results_are_replaced_by_the_next_measurement(tmp_path: Path) -> None:
    _measured(tmp_path, EDGE)
    frames, out = tmp_path / "frames", tmp_path / "out"
    CliRunner().invoke(cli, ["measure", str(frames), "--px-per-mm", "20", "--out", str(out)])
    assert (out / "gaps.csv").exists()
    assert not (out / "gauges.csv").exists()
