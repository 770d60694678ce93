"""Camera response from one wedge, or from the shape of edges, in pictures that are drawn by independent code."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from calib.errors import CalibrationError
from calib.measured_response import response_from_wedge
from calib.response_from_edges import response_from_edges
from fingervision.cli import cli
from tests.commands import printed

Grey = NDArray[np.uint8]
FINER = 4
DENSITIES = np.arange(0.05, 1.96, 0.1)


def coded(light: NDArray[np.float64], exponent: float, noise: float, rng: np.random.Generator) -> Grey:
    levels = 255.0 * np.clip(light, 0.0, 1.0) ** (1.0 / exponent) + rng.normal(0.0, noise, light.shape)
    return np.clip(np.rint(levels), 0, 255).astype(np.uint8)


def bar(blur_px: float, angle: float, dark: float = 0.05, light: float = 0.7) -> NDArray[np.float64]:
    """Light of a dark bar, with each pixel as the mean of 16 points."""
    height, width = 240, 320
    y, x = np.mgrid[0 : height * FINER, 0 : width * FINER].astype(np.float32)
    x, y = (x + 0.5) / FINER - 0.5 - width / 2, (y + 0.5) / FINER - 0.5 - height / 2
    across, along = x * np.cos(angle) + y * np.sin(angle), -x * np.sin(angle) + y * np.cos(angle)
    seen = np.where((np.abs(across) < 45) & (np.abs(along) < 100), dark, light).astype(np.float32)
    seen = gaussian_filter(seen, blur_px * FINER)
    return np.asarray(seen.reshape(height, FINER, width, FINER).mean(axis=(1, 3)), dtype=np.float64)


def wedge(exponent: float, noise: float, rng: np.random.Generator, reverse: bool = False) -> Grey:
    light = 0.9 * 10.0 ** -np.repeat(DENSITIES, 30)
    light = light[::-1] if reverse else light
    return coded(np.tile(light, (60, 1)), exponent, noise, rng)


@pytest.mark.parametrize("exponent", [1.0, 1.8, 2.2])
@pytest.mark.parametrize("reverse", [False, True])
def test_a_wedge_tells_the_light_of_every_level(exponent: float, reverse: bool) -> None:
    rng = np.random.default_rng(3)
    found = response_from_wedge(wedge(exponent, 1.5, rng, reverse), DENSITIES.tolist(), 255, "wedge")
    level = np.linspace(*found.covered, 50)
    light = np.interp(level, found.response.level, found.response.light)
    # Up to the one factor that a wedge leaves open.
    ratio = light / level**exponent
    assert np.std(np.log(ratio)) < 0.02
    assert found.exponent == pytest.approx(exponent, rel=0.05)


def test_a_wedge_that_is_not_in_the_region_is_refused() -> None:
    picture = wedge(2.2, 1.0, np.random.default_rng(4))
    with pytest.raises(CalibrationError):
        response_from_wedge(picture, DENSITIES.tolist(), 255, "wedge", (0, 0, 310, 60))
    with pytest.raises(CalibrationError):
        response_from_wedge(picture, DENSITIES[:13].tolist(), 255, "wedge")
    with pytest.raises(CalibrationError):
        response_from_wedge(picture, DENSITIES[::-1].tolist(), 255, "wedge")
    with pytest.raises(CalibrationError):
        response_from_wedge(np.full((60, 600), 128, np.uint8), DENSITIES.tolist(), 255, "wedge")


@pytest.mark.slow
def test_the_shape_of_edges_tells_the_exponent_within_its_uncertainty() -> None:
    away = []
    for seed in range(10):
        rng = np.random.default_rng([seed, 8])
        exponent, blur_px, noise = rng.choice([1.0, 1.8, 2.2]), rng.uniform(0.8, 2.5), rng.uniform(0.5, 2.0)
        pictures = [coded(bar(blur_px, rng.uniform(-0.3, 0.3)), exponent, noise, rng) for _ in range(1)]
        found = response_from_edges(pictures, 255, "edges")
        assert found.u_exponent is not None
        away.append((found.exponent - exponent) / found.u_exponent)
    # Of ten true 95 % intervals three or more fail once in a hundred times.
    assert np.sum(np.abs(away) > 2.0) <= 2
    assert np.max(np.abs(away)) < 4.0


def test_edges_that_a_sharpening_camera_bends_are_refused_or_wide() -> None:
    rng = np.random.default_rng(9)
    light = bar(1.2, 0.12)
    soft = 255.0 * light ** (1.0 / 2.2)
    sharpened = soft + 1.5 * (soft - gaussian_filter(soft, 1.5)) + rng.normal(0.0, 1.0, soft.shape)
    picture = np.clip(np.rint(sharpened), 0, 255).astype(np.uint8)
    try:
        found = response_from_edges([picture], 255, "edges")
    except CalibrationError:
        return
    assert found.u_exponent is not None
    assert abs(found.exponent - 2.2) < 2.0 * found.u_exponent


def test_no_edges_no_response() -> None:
    rng = np.random.default_rng(10)
    with pytest.raises(CalibrationError):
        response_from_edges([rng.integers(0, 255, (240, 320)).astype(np.uint8)], 255, "edges")
    with pytest.raises(CalibrationError):
        response_from_edges([np.full((240, 320), 99, np.uint8)], 255, "edges")


def test_the_command_takes_a_wedge_and_its_result_is_a_response(tmp_path: Path) -> None:
    rng = np.random.default_rng(11)
    cv2.imwrite(str(tmp_path / "wedge.png"), wedge(2.2, 1.0, rng))
    out = tmp_path / "response.csv"
    arguments = ["calibrate", "response", "--densities", "0.05:1.95:0.1", str(tmp_path / "wedge.png"), "-o", str(out)]
    printed(*arguments)
    rows = np.loadtxt(out, delimiter=",", skiprows=1)
    assert np.all(np.diff(rows, axis=0) > 0.0)


@pytest.mark.parametrize(
    "arguments",
    [
        ["--densities", "0.05:1.95:0.1", "--edges", "wedge.png"],
        ["--densities", "a:b", "wedge.png"],
        ["--densities", "0:1:0", "wedge.png"],
        ["--densities", "0:1e9:0.1", "wedge.png"],
        ["--densities", "0.05:1.95:0.1", "wedge.png", "bar.png"],
        ["--roi", "1,2,3,4", "wedge.png=1"],
        ["--edges", "wedge.png=0.5"],
        ["--edges", "nothing.png"],
        ["wedge.png"],
    ],
)
def test_wrong_words_are_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str]) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("wedge.png", "bar.png"):
        cv2.imwrite(name, wedge(2.2, 1.0, np.random.default_rng(12)))
    done = CliRunner().invoke(cli, ["calibrate", "response", *arguments])
    assert done.exit_code != 0
    assert "Traceback" not in done.output
    assert not Path("response.csv").exists()
