"""Print the table of `fingervision/models/flexure_stress.py`: largest stress at a fillet over nominal stress of a neck.

A neck of thickness 1 between blocks is loaded in tension and in pure bending, in plane stress.
"""

import numpy as np
from scipy.sparse.linalg import spsolve

from fingervision.domain.gripper import Material
from fingervision.models.flexure import Flexure
from fingervision.models.flexure_stress import DEPTHS, RADII
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.plane_shapes import box
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.triangulate import triangulate
from tests.benchmarks.frame import Namespace, benchmark

UNIT = Material("unit", 1.0, 0.3, 1.0, 1.0)
STRAIGHT = 2.0
"""Length of the straight neck on each side of its middle, in thicknesses; the fillets do not influence each other."""
BLOCK = 1.5
"""Length of the blocks over their height, large enough that the ends have no influence."""
ACROSS = 12.0


def factors(radius: float, depth: float, straight: float = STRAIGHT) -> tuple[float, float]:
    """Stress concentration factors in tension and bending, for a fillet radius and a shoulder depth in thicknesses."""
    half = straight + radius
    flexure = Flexure("neck", "filleted", (0.0, 0.0), 0.0, 1.0, half, depth, radius)
    high = 0.5 + depth
    end = half + BLOCK * 2.0 * high
    region = PlanarRegion(((True, box(-end, end, -high, high)), *flexure.steps()))
    mesh = triangulate(region, ACROSS, 0.05 * region.size_mm)
    plate = PlaneStressPlate(mesh, UNIT, 1.0)
    x, y = plate.nodes_mm
    left, right = np.flatnonzero(x < -end + 1e-6), np.flatnonzero(x > end - 1e-6)
    middle = left[np.argmin(np.abs(y[left]))]
    free = np.setdiff1d(np.arange(plate.unknowns), np.concatenate(
        [plate.x_dofs[left], plate.x_dofs[right], [plate.y_dofs[middle]]]))  # fmt: skip
    K = plate.stiffness_n_mm
    found = []
    # The left end is fixed at x = 0, and the right end is displaced or rotated relative to it.
    for motion in (np.ones(right.size), y[right]):
        moved = np.zeros(plate.unknowns)
        moved[plate.x_dofs[right]] = motion
        moved[free] = spsolve(K[free][:, free].tocsc(), -(K @ moved)[free])
        load = (K @ moved)[plate.x_dofs[right]]
        nominal = abs(load.sum()) if np.ptp(motion) == 0.0 else 6.0 * abs(load @ y[right])
        found.append(float(plate.von_mises_mpa(moved).max()) / nominal)
    return found[0], found[1]


@benchmark()
def main(_: Namespace) -> None:
    """Print one row per radius: factors in tension and bending for each ratio of depth to radius."""
    print(f"r / t | tension, bending at depth / r of {DEPTHS}")
    for radius in RADII:
        cells = [factors(radius, depth * radius) for depth in DEPTHS]
        print(f"{radius:6g} | " + ", ".join(f"({a:.4f}, {b:.4f})" for a, b in cells), flush=True)
