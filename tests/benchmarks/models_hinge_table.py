"""Print the tables of `fingervision/models/hinge_correction.py`: brick elements and plane stress over beam theory."""

import numpy as np

from fingervision.domain.gripper import Material
from fingervision.models.hinge_correction import Notch, bar_compliance, beam_compliance
from tests.benchmarks.frame import Namespace, benchmark
from tests.benchmarks.hinge_solid import plane_compliance, solid_compliance

MATERIAL = Material("PA2200", 1650.0, 0.34, 930.0, 48.0)
PLANAR = [0, 1, 5]


@benchmark()
def main(_: Namespace) -> None:
    """Print for each t / R the ratios in plane stress and with elastic blocks, then three ratios for each b / t."""
    for t_over_r in (0.0125, 0.025, 0.05, 0.1, 0.25, 0.5, 0.8, 1.6):
        notch, height = Notch(t_over_r, 1.0, 1.0, 1.0), 2.0 + t_over_r
        beam = np.diag(beam_compliance(notch, MATERIAL))
        planes = np.diag(plane_compliance(notch, MATERIAL, 120, 6))
        blocks = np.diag(plane_compliance(notch, MATERIAL, 120, 6, block_mm=2.0 * height))
        bars = np.diag(bar_compliance(2.0 * height, height, 1.0, MATERIAL))
        added = (blocks - 2.0 * bars)[[0, 2]] / planes[[0, 2]]
        print(f"{t_over_r:6.4f} plane / beam", np.round(planes / beam, 4), "blocks / planes", np.round(added, 4))
        for b_over_t in (0.5, 1.0, 3.0, 10.0, 30.0, 100.0):
            notch = Notch(t_over_r, 1.0, 1.0, t_over_r * b_over_t)
            solid = np.diag(solid_compliance(notch, MATERIAL, 36, 3, 6))[PLANAR]
            factors = solid / np.diag(beam_compliance(notch, MATERIAL))
            print(f"{t_over_r:6.4f} {b_over_t:5.1f} |", ", ".join(f"{factor:.5f}" for factor in factors), flush=True)
