"""Widths of rendered bars against the Cramer-Rao bound, and what blooming leaves in scale and bias.

python tests/benchmarks/calibration_accuracy.py [--pictures 40] [--seed 11]
"""

import argparse
from itertools import product

import numpy as np
from numpy.typing import NDArray

from calib.known_widths import KnownSize, find_widths
from calib.limits import Limits
from calib.measured_scale import Reference
from calib.scale_from_sizes import MeasuredSize, ScaleFit, scale_from_sizes
from calib.straight_edges import find_edge_pairs
from fingervision.rendering.camera import Camera
from fingervision.rendering.light import Light
from fingervision.rendering.picture import render
from fingervision.rendering.scene import Patch, Scene
from fingervision.rendering.targets import bar, slot

PX_PER_MM, CONTRAST = 34.0, 160.0
SETS = {
    "three bars": (("bar", 2.0), ("bar", 8.0), ("bar", 14.0)),
    "bars and a slot": (("bar", 4.0), ("slot", 3.0), ("bar", 12.0)),
    "one dark bar": (("bar", 5.0),),
}


def picture(kind: str, size_px: float, turn_deg: float, camera: Camera, rng: np.random.Generator) -> NDArray[np.uint8]:
    """A bar that leaves a frame of 640x480, or a slot that ends in it, at a random sub-pixel place."""
    place = {"x_px": 319.5 + rng.uniform(-1, 1), "y_px": 239.5 + rng.uniform(-1, 1), "turn_deg": turn_deg}
    target = bar(size_px, 1200.0, **place) if kind == "bar" else slot(size_px, 400.0, **place)
    scene = Scene(light=Light(ground=40.0 + CONTRAST), behind=(Patch(target, 40.0),))
    return render(scene, camera, rng)


def bound_px(blur_px: float, noise_grey: float, rows: int) -> float:
    """Cramer-Rao bound of a width: two edges, unknown levels and blur (measuring.md, section 2), a long window."""
    spread, noise = np.hypot(blur_px, 12**-0.5), np.hypot(noise_grey, 12**-0.5)
    window = 2 * np.ceil(4 * spread + 4) + 1
    return float(np.sqrt(2 * (noise / CONTRAST) ** 2 / (rows * (1 / (2 * np.sqrt(np.pi) * spread) - 1 / window))))


def widths(pictures: int, rng: np.random.Generator) -> None:
    """Print the error of the width over blur, noise and direction."""
    print("blur, px  noise  turn, deg   bias, px  RMS, px  bound, px   ratio   stated u, px")
    for blur, noise, turn in product((0.5, 0.9, 2.0, 4.0), (1.0, 4.0), (0.3, 30.0)):
        errors, stated, rows = [], [], []
        for _ in range(pictures):
            size_px = 100.0 + float(rng.uniform(0.0, 1.0))
            (found,) = find_edge_pairs(picture("bar", size_px, turn, Camera(blur_px=blur, noise_grey=noise), rng))
            errors.append(found.width_px - size_px)
            stated.append(found.u_width_px)
            # Rows of a slanted edge are longer than it by the cosine, and each is steeper by it: the two cancel.
            rows.append(found.count)
        bias, rms, bound = (
            np.mean(errors),
            np.sqrt(np.mean(np.square(errors))),
            bound_px(blur, noise, int(np.mean(rows))),
        )
        bound *= np.cos(np.radians(turn)) ** 0.5
        print(
            f"{blur:8.1f} {noise:6.1f} {turn:10.1f} {bias:+10.4f} {rms:8.4f} {bound:10.4f} {rms / bound:7.2f} "
            f"{np.median(stated):14.4f}"
        )


def calibrated(sizes: tuple[tuple[str, float], ...], rng: np.random.Generator) -> ScaleFit:
    """Calibrate on rendered references with a blooming of 0.3 px an edge."""
    camera = Camera(noise_grey=2.0, bloom_px=0.3)
    pictures = [
        KnownSize(
            f"{kind} {size:g}", kind, size, 0.001, picture(kind, size * PX_PER_MM, rng.uniform(-1, 1), camera, rng)
        )
        for kind, size in sizes
    ]
    measured = [
        MeasuredSize(
            Reference(each.name, each.size_mm, each.u_size_mm),
            edge.width_px,
            edge.u_width_px,
            edge.points_px,
            edge.light,
        )
        for each, edge in zip(pictures, find_widths(pictures), strict=True)
    ]
    return scale_from_sizes(measured, (640, 480), Limits())


def blooming(calibrations: int, rng: np.random.Generator) -> None:
    """Print the error of scale and bias for a camera that blooms by 0.3 px an edge, so that b = -0.6 px."""
    print("\ncalibrated on      largest scale error, %   largest bias error, px   scale held by 2 u")
    for name, sizes in SETS.items():
        fits = [calibrated(sizes, rng) for _ in range(calibrations)]
        scale = np.array([fit.calibration.px_per_mm / PX_PER_MM - 1 for fit in fits])
        bias = np.array([fit.calibration.edge_bias_px + 0.6 for fit in fits])
        u = np.array([fit.calibration.u_px_per_mm / PX_PER_MM for fit in fits])
        held = np.count_nonzero(np.abs(scale) < 2 * u)
        print(f"{name:<18} {100 * np.abs(scale).max():20.5f} {np.abs(bias).max():24.4f} {held:>17} of {len(fits)}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pictures", type=int, default=40)
    parser.add_argument("--seed", type=int, default=11)
    wish = parser.parse_args()
    rng = np.random.default_rng(wish.seed)
    widths(wish.pictures, rng)
    blooming(max(1, wish.pictures // 4), rng)


if __name__ == "__main__":
    main()
