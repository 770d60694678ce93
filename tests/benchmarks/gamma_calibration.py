"""What a calibration with the same camera does to a gamma that nobody has stated.

    python tests/benchmarks/gamma_calibration.py [--benches 20] [--seed 1] [--drawn]

Every bench is a camera with a gamma of 2.2 and its own blur (0.7 to 2.5 px): bars of 3, 6 and 9 mm, and frames of a
gripper, drawn by `camera_artefacts`. Printed: error of the scale and of the gap after a calibration on three bars, and,
after one on the middle bar alone, the error, its stated uncertainty, and the share of gaps that 1.96 u and 2 u hold.

A gamma of 2.2 is the farthest from linear that the budget allows for, and the budget's other large limits are not used
up at all: the error after one bar is nearly the same share of u on every bench. The share of gaps held says something
about the budget only if its limits are drawn: with --drawn the camera's exponent lies evenly between 1 and 2.2, the
edge bias (blooming) and the gripper's distance from the calibrated plane evenly within their limits (`calib.limits`).
"""

import argparse
import csv
import json
import tempfile
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from click.testing import CliRunner

from calib.limits import Limits
from fingervision.cli.calibrate import command as calibrate
from fingervision.cli.measure import command as measure
from tests.benchmarks.camera_artefacts.classes import BELOW_PX, NOISE, SIZE_PX
from tests.benchmarks.camera_artefacts.electronics import noisy, power_law, stored
from tests.benchmarks.camera_artefacts.optics import Surface, light_on_sensor
from tests.benchmarks.camera_artefacts.scene import Finger, true_gap

PX_PER_MM, GAMMA, FRAMES, BARS_MM = 34.0, 2.2, 2, (3.0, 6.0, 9.0)


def run(command: object, *arguments: object) -> None:
    result = CliRunner().invoke(command, [str(argument) for argument in arguments])  # type: ignore[arg-type]
    if result.exit_code:
        raise SystemExit(f"{result.output}{result.exception}")


def one(
    folder: Path, rng: np.random.Generator, is_drawn: bool = False
) -> dict[str, tuple[float, list[float], list[float]]]:
    """Relative error of the scale, errors of the gaps (px) and their uncertainties, by three bars and by one."""
    blur, surface = rng.uniform(0.7, 2.5), Surface(ground=rng.uniform(0.5, 0.8), finger=rng.uniform(0.04, 0.1))

    limits = Limits()
    exponent, bias_px, nearer = GAMMA, 0.0, 1.0
    if is_drawn:
        exponent = rng.uniform(1.0, GAMMA)
        bias_px = rng.uniform(-limits.edge_bias_px, limits.edge_bias_px)
        nearer += rng.uniform(-limits.plane_mm, limits.plane_mm) / limits.camera_distance_mm

    def shoot(path: Path, fingers: tuple[Finger, Finger]) -> Path:
        bloomed = [
            replace(each, width_px=each.width_px - bias_px, radius_px=max(each.radius_px - 0.5 * bias_px, 0.0))
            for each in fingers
        ]
        light = light_on_sensor((bloomed[0], bloomed[1]), surface, blur, SIZE_PX, rng)
        cv2.imwrite(str(path), stored(power_law(noisy(light, 0.6 * NOISE, rng), exponent)))
        return path

    items = []
    for size in BARS_MM:
        middle = 0.5 * SIZE_PX[0] + rng.uniform(-1, 1)
        bar = Finger(middle, -400.0, size * PX_PER_MM, 0.0, rng.uniform(-1.0, 1.0))
        items.append(f"{shoot(folder / f'bar{size:g}.png', (bar, Finger(9e3, 0.0, 10.0, 0.0)))}={size}")
    (folder / "frames").mkdir()
    gaps = []
    for k in range(FRAMES):
        gap = rng.uniform(50.0, 130.0)
        tip, x = 90.0 + rng.uniform(-1, 1), 0.5 * SIZE_PX[0] + rng.uniform(-2, 2)
        fingers = tuple(
            Finger(x + s * 0.5 * nearer * (gap + 90.0), tip, nearer * 90.0, nearer * rng.uniform(0.0, 8.0))
            for s in (-1.0, 1.0)
        )
        shoot(folder / "frames" / f"{k}.png", fingers)
        gaps.append(true_gap(*fingers, nearer * BELOW_PX) / PX_PER_MM / nearer)
    found = {}
    for name, chosen in (("three bars", items), ("one bar", items[1:2])):
        calibration, out = folder / f"{name}.json", folder / name
        run(calibrate, "bar", *chosen, "--no-picture", "-o", calibration)
        run(measure, folder / "frames", "--rate-hz", 25, "--calibration", calibration, "--out", out)
        rows = list(csv.DictReader((out / "gaps.csv").open()))
        kept = [(row, gap) for row, gap in zip(rows, gaps, strict=True) if row["gap_mm"]]
        scale = json.loads(calibration.read_text())["px_per_mm"] / PX_PER_MM - 1.0
        error = [PX_PER_MM * (float(row["gap_mm"]) - gap) for row, gap in kept]
        found[name] = (scale, error, [PX_PER_MM * float(row["u_gap_mm"]) for row, _ in kept])
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--benches", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--drawn", action="store_true", help="draw the camera and its place within the budget's limits")
    options = parser.parse_args()
    rng, all_found = np.random.default_rng(options.seed), []
    for _ in range(options.benches):
        with tempfile.TemporaryDirectory() as folder:
            all_found.append(one(Path(folder), rng, options.drawn))
    for name in ("three bars", "one bar"):
        scale = np.array([found[name][0] for found in all_found])
        error, u = (np.concatenate([found[name][k] for found in all_found]) for k in (1, 2))
        print(
            f"{name}: scale off by {100 * np.abs(scale).max():.4f} % at most; gap {error.mean():+.4f} px mean, "
            f"{np.sqrt(np.mean(error**2)):.4f} px RMS, stated u {np.median(u):.3f} px; 1.96 u holds "
            f"{100 * np.mean(np.abs(error) < 1.96 * u):.1f} %, 2 u {100 * np.mean(np.abs(error) < 2 * u):.1f} % of "
            f"{error.size}"
        )


if __name__ == "__main__":
    main()
