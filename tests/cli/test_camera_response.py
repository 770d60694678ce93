"""A camera with gamma, from its calibration to the gap: known, assumed, measured, and another camera's."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner, Result

from fingervision.cli.calibrate import command as calibrate
from fingervision.cli.measure import command as measure
from fingervision.domain.errors import FingervisionError
from tests.benchmarks.camera_artefacts.classes import BELOW_PX, NOISE, SIZE_PX
from tests.benchmarks.camera_artefacts.electronics import noisy, power_law, stored
from tests.benchmarks.camera_artefacts.optics import Surface, light_on_sensor
from tests.benchmarks.camera_artefacts.scene import Finger, true_gap
from tests.csv_rows import csv_rows

PX_PER_MM = 34.0
LIGHT = Surface(ground=0.7, finger=0.06)
GAMMA = 2.2
# Bars of 3, 6 and 9 mm, and what the issue asks of scale and gap.
BARS_MM = (3.0, 6.0, 9.0)
SCALE_RELATIVE, GAP_PX = 1e-4, 0.02


def run(command: object, *arguments: str | Path) -> Result:
    return CliRunner().invoke(command, [str(argument) for argument in arguments])  # type: ignore[arg-type]


def shoot(folder: Path, name: str, fingers: tuple[Finger, Finger], blur_px: float, rng: np.random.Generator) -> Path:
    light = light_on_sensor(fingers, LIGHT, blur_px, SIZE_PX, rng)
    path = folder / name
    assert cv2.imwrite(str(path), stored(power_law(noisy(light, 0.6 * NOISE, rng), GAMMA)))
    return path


def bars(folder: Path, rng: np.random.Generator) -> list[str]:
    """Pictures of bars that leave the picture above and below; the second bar stands far outside."""
    items = []
    for size in BARS_MM:
        bar = Finger(0.5 * SIZE_PX[0] + rng.uniform(-1, 1), -400.0, size * PX_PER_MM, 0.0, rng.uniform(-1.0, 1.0))
        items.append(f"{shoot(folder, f'bar{size:g}.png', (bar, Finger(9e3, 0.0, 10.0, 0.0)), 0.9, rng)}={size}")
    return items


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str], list[float]]:
    """Bars, four frames of a gripper, and the true gaps (mm)."""
    folder = tmp_path_factory.mktemp("gamma")
    rng = np.random.default_rng(22)
    items, gaps = bars(folder, rng), []
    (folder / "frames").mkdir()
    for k in range(4):
        gap = 60.0 + 20.0 * k + rng.uniform()
        left = Finger(220.0 - 0.5 * (gap + 90.0), 90.3, 90.0, 0.0)
        right = Finger(220.0 + 0.5 * (gap + 90.0), 90.3, 90.0, 0.0)
        shoot(folder / "frames", f"{k}.png", (left, right), 0.9, rng)
        gaps.append(true_gap(left, right, BELOW_PX) / PX_PER_MM)
    share = np.linspace(0.0, 1.0, 256)
    rows = "\n".join(f"{255 * level:g},{level**GAMMA:.7f}" for level in share)
    (folder / "response.csv").write_text(f"level,light\n{rows}\n")
    return folder, items, gaps


def measured(folder: Path, calibration: Path, out: Path, *more: str | Path) -> tuple[list[dict[str, str]], dict]:
    result = run(measure, folder / "frames", "--rate-hz", "25", "--calibration", calibration, "--out", out, *more)
    assert result.exit_code == 0, result.output
    return csv_rows(out / "gaps.csv"), json.loads((out / "summary.json").read_text())


def test_a_calibration_with_the_same_camera_takes_the_bias_away(
    bench: tuple[Path, list[str], list[float]], tmp_path: Path
) -> None:
    folder, items, gaps = bench
    for response in ("auto", folder / "response.csv"):
        out = tmp_path / f"{Path(response).stem}.json"
        result = run(calibrate, "bar", *items, "--no-picture", "--response", response, "-o", out)
        assert result.exit_code == 0, result.output
        assert json.loads(out.read_text())["px_per_mm"] == pytest.approx(PX_PER_MM, rel=SCALE_RELATIVE)
        rows, summary = measured(folder, out, tmp_path / Path(response).stem)
        error_px = PX_PER_MM * (np.array([float(row["gap_mm"]) for row in rows]) - gaps)
        assert abs(error_px.mean()) < GAP_PX
        is_known = response != "auto"
        assert summary["settings"]["response_known"] is is_known
        assert all((float(row["u_shift_px"]) == 0.0) is is_known for row in rows)
        assert all(row["fingers"] == "dark" and row["held_px"] == "" for row in rows)


def test_a_single_bar_leaves_the_response_in_the_budget(
    bench: tuple[Path, list[str], list[float]], tmp_path: Path
) -> None:
    folder, items, gaps = bench
    out = tmp_path / "c.json"
    assert run(calibrate, "bar", items[1], "--no-picture", "-o", out).exit_code == 0
    sources = [part["source"] for part in json.loads(out.read_text())["budget"]["parts"]]
    assert "camera response" in sources
    rows, _ = measured(folder, out, tmp_path / "m")
    for row, gap in zip(rows, gaps, strict=True):
        assert abs(float(row["gap_mm"]) - gap) < 2.0 * float(row["u_gap_mm"])


def test_another_cameras_calibration_is_said(bench: tuple[Path, list[str], list[float]], tmp_path: Path) -> None:
    folder, items, _ = bench
    out = tmp_path / "c.json"
    assert run(calibrate, "bar", *items, "--no-picture", "--response", "linear", "-o", out).exit_code == 0
    _, summary = measured(folder, out, tmp_path / "m", "--response", "srgb")
    (words,) = summary["advice"]
    assert "linear" in words
    assert "srgb" in words
    assert " px " in words


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("level,light\n0,0\n128,0.2\n255,1\n", "at least"),
        ("level,light\n" + "\n".join(f"{k},{k % 7}" for k in range(256)), "rise"),
        ("level,light\n" + "\n".join(f"{k},{k}" for k in range(100)), "full scale"),
        ("level,light\n0,zero\n", "line 2"),
        ("grey,light\n0,0\n", "column level"),
        ("level,light\n" + "\n".join(f"{k},{k}" for k in range(0, 1024, 33)), "1023"),
    ],
)
def test_response_files_that_are_none(
    bench: tuple[Path, list[str], list[float]], tmp_path: Path, content: str, words: str
) -> None:
    path = tmp_path / "r.csv"
    path.write_text(content)
    result = run(
        measure,
        bench[0] / "frames",
        "--px-per-mm",
        "34",
        "--rate-hz",
        "25",
        "--response",
        path,
        "--out",
        tmp_path / "m",
    )
    assert isinstance(result.exception, FingervisionError)
    assert words in str(result.exception)
