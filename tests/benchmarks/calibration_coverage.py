"""Does the 95 % interval of a calibrated gap hold the truth? Rendered calibrations and gaps, drawn within the budget.

Every trial draws a camera (scale, blooming, lens), references with certificates that are a little wrong, and a gripper
that is a little out of their plane and tilted; calibrates on the rendered references at another temperature, measures
the rendered gap, and asks whether value +- 1.96 u holds the true gap. Imperfections are drawn twice over: from normal
distributions with the budget's standard uncertainties, and evenly between the stated limits (where an interval of
1.96 u is too long as soon as one source dominates: a uniform error never leaves its limits).

The edges are straight at the measuring height unless --radius-mm is 0.3 or more. There blooming moves the tip as well
as the edge, and the edge bias of a straight reference is no longer that of the gap; the budget does not know the slope.

    python -m tests.benchmarks.calibration_coverage [--trials 1000] [--jobs 2] [--seed 20261]
"""

from concurrent.futures import ProcessPoolExecutor
from math import sqrt

import numpy as np
from scipy.stats import beta

from calib.known_widths import KnownSize, find_widths
from calib.limits import Limits
from calib.measured_scale import Reference
from calib.scale_from_sizes import MeasuredSize, scale_from_sizes
from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.measuring.gap_budget import bias_shares
from fingervision.rendering.camera import Camera, RadialLens, Tilt
from fingervision.rendering.picture import render
from fingervision.rendering.scene import Light, Patch, Scene
from fingervision.rendering.targets import bar, slot
from fingervision.rendering.two_fingers import two_fingers
from fingervision.vision.pipeline import Settings, measure_frame
from tests.benchmarks.frame import Namespace, benchmark

FRAME = (640, 480)
U_SIZE_MM = 0.001
# What a user might calibrate on; sizes in mm at about 34 px/mm.
SETS = {
    "one bar": (("bar", 5.0),),
    "three bars": (("bar", 3.0), ("bar", 8.0), ("bar", 14.0)),
    "bars and a slot": (("bar", 4.0), ("slot", 3.0), ("bar", 10.0)),
    "six bars": tuple(("bar", size) for size in (2.0, 5.0, 8.0, 11.0, 14.0, 17.0)),
}
FACTOR_95 = 1.96


def draw(rng: np.random.Generator, shape: str, limit: float) -> float:
    """One imperfection, by its limit."""
    return float(rng.uniform(-limit, limit) if shape == "even" else rng.normal(0.0, limit / sqrt(3.0)))


def trial(seed: int, shape: str, radius_mm: float) -> tuple[str, float, float, float, float] | None:
    """Error of the gap (mm), its u, its random u, the error from the bare scale; None where nothing was measured."""
    rng = np.random.default_rng(seed)
    name = list(SETS)[seed % len(SETS)]
    limits = Limits()
    true_scale = float(rng.uniform(31.0, 35.0))
    distance_px = limits.camera_distance_mm * true_scale
    bloom_px = draw(rng, shape, limits.edge_bias_px) / 2.0
    lens = RadialLens(k1=draw(rng, shape, limits.lens_relative))
    blur, noise = float(rng.uniform(0.7, 1.6)), float(rng.uniform(1.0, 3.0))
    expansion = 1.0 + limits.expansion_per_k * draw(rng, shape, limits.temperature_k)
    camera = Camera(blur_px=blur, noise_grey=noise, bloom_px=bloom_px, lens=lens)
    pictures = []
    for number, (kind, size_mm) in enumerate(SETS[name]):
        true_mm = (size_mm + rng.normal(0.0, U_SIZE_MM)) * expansion
        drawn = bar if kind == "bar" else slot
        length_px = 620.0 if kind == "bar" else 400.0
        at = {"x_px": 319.5 + rng.uniform(-6, 6), "y_px": 239.5 + rng.uniform(-6, 6), "turn_deg": rng.uniform(-1, 1)}
        scene = Scene(
            width_px=FRAME[0],
            height_px=FRAME[1],
            light=Light(ground=200.0),
            behind=(Patch(drawn(true_mm * true_scale, length_px, **at), 40.0),),
        )
        pictures.append(KnownSize(f"{kind} {number}", kind, size_mm, U_SIZE_MM, render(scene, camera, rng)))
    edges = find_widths(pictures)
    sizes = [
        MeasuredSize(
            Reference(each.name, each.size_mm, each.u_size_mm),
            edge.width_px,
            edge.u_width_px,
            edge.points_px,
            edge.light,
        )
        for each, edge in zip(pictures, edges, strict=True)
    ]
    fit = scale_from_sizes(sizes, FRAME, limits)
    nearer = 1.0 + draw(rng, shape, limits.plane_mm) / limits.camera_distance_mm
    tilts = [draw(rng, shape, limits.tilt_deg) for _ in range(2)]
    gap_mm = float(rng.uniform(0.4, 4.0))
    gripper = two_fingers(
        gap_mm * true_scale * nearer,
        below_tip_px=0.3 * true_scale,
        radius_px=radius_mm * true_scale,
        width_px=3.0 * true_scale,
        centre_px=float(rng.uniform(-100.0, 100.0)),
        tip_at_px=float(rng.uniform(100.0, 300.0)),
        frame=FRAME,
    )
    tilted = Camera(
        blur_px=blur,
        noise_grey=noise,
        bloom_px=bloom_px,
        lens=lens,
        tilt=Tilt(about_x_deg=tilts[0], about_y_deg=tilts[1], distance_px=distance_px),
    )
    found = measure_frame(
        Frame(render(gripper, tilted, rng), 0), Settings(below_tip_px=0.3 * fit.calibration.px_per_mm)
    )
    if not isinstance(found, GapMeasurement):
        return None
    points = np.array([[[found.left.x_px, found.left.y_px], [found.right.x_px, found.right.y_px]]])
    got = fit.calibration.distances(
        points, np.array([found.u_gap_px]), np.array([found.light_gap]), bias_shares([found])
    )
    assert got.u_mm is not None
    bare_mm = found.gap_px / fit.calibration.px_per_mm
    return name, float(got.value_mm[0]) - gap_mm, float(got.u_mm[0]), float(got.u_random_mm[0]), bare_mm - gap_mm


def interval(held: int, count: int) -> str:
    """Share with its 95 % interval (Clopper & Pearson, Biometrika 26, 1934, 404-413)."""
    low = beta.ppf(0.025, held, count - held + 1) if held else 0.0
    high = beta.ppf(0.975, held + 1, count - held) if held < count else 1.0
    return f"{100 * held / count:5.1f} % ({100 * low:.1f} to {100 * high:.1f})"


@benchmark(
    trials=1000,
    jobs=2,
    seed=20261,
    radius_mm={"type": float, "default": 0.2, "help": "Of the tips; 0.5 shows what a curved edge adds."},
    drawn={"choices": ("normal", "even"), "action": "append", "help": "Only this; both by default."},
)
def main(wish: Namespace) -> None:
    seeds = [wish.seed * 100_000 + number for number in range(wish.trials)]
    for shape in wish.drawn or ("normal", "even"):
        with ProcessPoolExecutor(wish.jobs) as pool:
            trials = list(pool.map(trial, seeds, [shape] * len(seeds), [wish.radius_mm] * len(seeds), chunksize=20))
        measured = [each for each in trials if each is not None]
        print(f"\nimperfections drawn {shape}: {len(measured)} of {len(trials)} gaps measured")
        held_by = f"{'held by 1.96 u':<24} {'bare px/mm, held by 1.96 u_random':<36}"
        print(f"{'calibrated on':<18} {'gaps':>5}  {held_by} RMS, um   u, um")
        for name in (*SETS, "all"):
            rows = np.array([each[1:] for each in measured if name in (each[0], "all")])
            if not len(rows):
                continue
            held = int(np.count_nonzero(np.abs(rows[:, 0]) <= FACTOR_95 * rows[:, 1]))
            bare = int(np.count_nonzero(np.abs(rows[:, 3]) <= FACTOR_95 * rows[:, 2]))
            rms, u = 1e3 * float(np.sqrt(np.mean(rows[:, 0] ** 2))), 1e3 * float(np.sqrt(np.mean(rows[:, 1] ** 2)))
            shares = f"{interval(held, len(rows)):<24} {interval(bare, len(rows)):<36}"
            print(f"{name:<18} {len(rows):>5}  {shares} {rms:7.2f} {u:7.2f}")
