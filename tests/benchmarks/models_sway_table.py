"""Print the shear ratio of a notch with parallel ends, for which the lumped model agrees with finite elements."""

import tomllib

import numpy as np

from fingervision.models.finite_element import MechanismPlate
from fingervision.models.hinge_correction import SWAY_SHEAR
from fingervision.models.lumped import MechanismFrame
from fingervision.storage.mechanism_toml import mechanism_from_tables
from tests.benchmarks.frame import Namespace, benchmark

RADIUS_MM = 10.0
DRAWING = """name = "notch between blocks"
plate_mm = 1.0
[material]
name = "any"
youngs_modulus_mpa = 1000.0
poisson_ratio = {poisson}
density_kg_m3 = 1000.0
yield_mpa = 10.0
[lengths]
t = {thickness}
half = "{depth} + t / 2"
[[body]]
box_mm = [-40, 0, "-half", "half"]
[[body]]
box_mm = [0, 40, "-half", "half"]
[[flexure]]
name = "notch"
kind = "elliptic"
at_mm = [0, 0]
axis_deg = 0
thickness_mm = "t"
half_length_mm = 10.0
depth_mm = {depth}
[[fixed]]
box_mm = [-40, -40, "-half", "half"]
[drive]
box_mm = [40, 40, "-half", "half"]
direction = {direction}
"""


def stiffnesses(
    thickness_mm: float, direction: tuple[int, int], *, poisson: float = 0.34, depth_mm: float = RADIUS_MM
) -> tuple[float, float]:
    """Stiffness (N/mm), in plane stress, of a notch between parallel blocks: by finite elements and by the lumped
    model.
    """
    text = DRAWING.format(thickness=thickness_mm, direction=list(direction), poisson=poisson, depth=depth_mm)
    mechanism = mechanism_from_tables(tomllib.loads(text), "notch")
    plate, frame = (kind(mechanism, width_effect=False) for kind in (MechanismPlate, MechanismFrame))
    return plate.stiffness_n_mm, frame.stiffness_n_mm


@benchmark()
def main(_: Namespace) -> None:
    """Print for every t / R the ratio required, and the error of the force with the present ratio in per cent."""
    from fingervision.models.hinge_correction import _sway_ratio

    for t_over_r in (0.0125, 0.025, 0.05, 0.1, 0.25, 0.5, 0.8):
        t = t_over_r * RADIUS_MM
        angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 20_001)
        height = t + 2.0 * RADIUS_MM * (1.0 - np.cos(angle))
        along = float(np.trapezoid(RADIUS_MM * np.cos(angle) / height, angle)) / 1000.0
        plate, frame = stiffnesses(t, (0, 1))
        ratio = _sway_ratio(t_over_r) + (1.0 / plate - 1.0 / frame) / (SWAY_SHEAR * along)
        print(f"t / R {t_over_r:6.4f}: ratio {ratio:.4f}; force {100.0 * (frame / plate - 1.0):+.2f} %", flush=True)
