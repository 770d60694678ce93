"""Print the width effect of hinges between elastic blocks: brick elements compared with the plane model."""

import time
from dataclasses import replace

from fingervision.domain.gripper import Material
from fingervision.models.hinge_correction import plane_strain_share
from fingervision.models.notch import circular_notch
from tests.benchmarks.frame import Namespace, benchmark
from tests.benchmarks.hinge_solid import plane_compliance, solid_compliance

PA2200 = Material("PA2200", 1650.0, 0.34, 930.0, 48.0)
ABOUT_Z = 5
NARROW = 0.25
"""Width over thickness at which brick elements are in plane stress; the error of their mesh cancels in the ratio."""


@benchmark()
def main(_: Namespace) -> None:
    """Print one line for each t / R, width over thickness, and Poisson's ratio."""
    print(
        "t/R  b/t  nu | bending, bricks over narrow bricks | plane model over plane stress | difference | plane stress"
    )
    for nu in (0.34, 0.2):
        material = replace(PA2200, poisson_ratio=nu)
        for ratio in (0.0125, 0.05, 0.125, 0.25, 0.5):
            block_mm = 2.0 + ratio
            bricks = {}
            for width in (NARROW, 1.0, 3.0, 6.0, 12.0, 20.0):
                began = time.perf_counter()
                notch = circular_notch(1.0, ratio, ratio * width)
                solid = solid_compliance(notch, material, along=20, across=2, through=4, block_mm=block_mm)
                bricks[width] = float(solid[ABOUT_Z, ABOUT_Z]) * notch.plate_mm
                if width == NARROW:
                    continue
                share = plane_strain_share(notch)
                plane = [float(plane_compliance(notch, material, 60, 4, block_mm, s)[2, 2]) for s in (0.0, share)]
                found, expected = plane[1] / plane[0], bricks[width] / bricks[NARROW]
                print(
                    f"{ratio:6.4f} {width:5.1f} {nu:5.2f} | {expected:8.4f} | {found:8.4f} | "
                    f"{100.0 * (found / expected - 1.0):+6.2f} % | {100.0 * (1.0 / expected - 1.0):+6.2f} % "
                    f"({time.perf_counter() - began:.1f} s)",
                    flush=True,
                )
