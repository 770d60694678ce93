"""`measure --gauges` writes gauges.csv next to gaps.csv, in millimetres, for frames of any kind."""

import csv
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli import cli
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
    assert lines[0] == "time_s,gauge,quantity,value,u,unit,status"
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
