"""Milliseconds to draw a frame and to find its truth: `python -m tests.benchmarks.rendering`."""

from collections.abc import Callable
from time import perf_counter

import numpy as np

from fingervision.rendering import (
    Camera,
    EllipticTip,
    Highlight,
    RadialLens,
    Rim,
    Tilt,
    dust,
    exact_grey,
    render,
    truth,
    two_fingers,
)
from tests.benchmarks.frame import Namespace, benchmark

REPEATS = 15


def milliseconds(work: Callable[[], object]) -> float:
    """Median time of one call."""
    times_s = []
    for _ in range(REPEATS):
        start_s = perf_counter()
        work()
        times_s.append(perf_counter() - start_s)
    return 1000.0 * sorted(times_s)[REPEATS // 2]


@benchmark()
def main(_: Namespace) -> None:
    """Print the table."""
    rng = np.random.default_rng(0)
    plain = two_fingers(100.3, radius_px=30.0, tilt_deg=(3.0, -8.0))
    full = two_fingers(
        100.3,
        radius_px=30.0,
        tilt_deg=(3.0, -8.0),
        before=dust(30, rng),
        rim=Rim(3.0, 250.0),
        highlight=Highlight(180.0),
    )
    lens = Camera(noise_grey=2.0, lens=RadialLens(-0.06), tilt=Tilt(8.0, -12.0))
    cases = [
        ("two tilted fingers, blur 0.3", plain, Camera(blur_px=0.3, noise_grey=2.0)),
        ("two tilted fingers, blur 0.9", plain, Camera(noise_grey=2.0)),
        ("two tilted fingers, blur 5", plain, Camera(blur_px=5.0, noise_grey=2.0)),
        ("elliptic tips, touching", two_fingers(10.0, tip=EllipticTip(40.0)), Camera(noise_grey=2.0)),
        ("with rim, highlights, 30 specks", full, Camera(noise_grey=2.0)),
        ("through lens and tilt", plain, lens),
        (
            "3840 x 2160",
            two_fingers(1000.3, radius_px=180.0, width_px=600.0, frame=(3840, 2160)),
            Camera(noise_grey=2.0),
        ),
    ]
    print(f"{'scene':34}{'exact ms':>10}{'frame ms':>10}{'truth ms':>10}")
    for name, scene, camera in cases:
        exact_ms = milliseconds(lambda scene=scene, camera=camera: exact_grey(scene, camera))
        frame_ms = milliseconds(lambda scene=scene, camera=camera: render(scene, camera, rng))
        truth_ms = milliseconds(lambda scene=scene, camera=camera: truth(scene, camera, 10.2))
        print(f"{name:34}{exact_ms:10.1f}{frame_ms:10.1f}{truth_ms:10.1f}")
