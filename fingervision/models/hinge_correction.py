"""Beam theory of the notch hinge corrected by finite elements: what the models use unless told otherwise.

Each direction's compliance is multiplied by the ratio of a model of quadratic bricks between rigid end planes to beam
theory, as `tests/benchmarks/models_hinge_table.py` prints it for nu = 0.34; interpolated between, held at the table's
ends. At t / R = 0.25 and b / t = 3 the ratio is 1.05 in bending, 1.08 along and 0.78 in torsion, where warping is
restrained. Between blocks of elastic material instead of rigid planes the notch is softer still, because the blocks
yield where it joins them; those factors are ratios of plane-stress models with and without blocks.
"""

from enum import StrEnum

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from fingervision.domain.gripper import Material
from fingervision.models.hinge_compliance import beam_compliance
from fingervision.models.notch import Notch

Array = NDArray[np.float64]


class HingeTheory(StrEnum):
    """Where a hinge's compliance comes from."""

    CORRECTED = "corrected"
    BEAM = "beam"


_T_OVER_R = (0.05, 0.1, 0.25, 0.5, 0.8)
_B_OVER_T = (1.0, 3.0, 10.0)

# Order of the six: displacements x, y, z, rotations about x, y, z.
_BRICKS_OVER_BEAM = (
    (
        (1.0616, 1.0160, 1.0444, 0.9880, 1.0339, 1.0157),
        (1.0610, 1.0087, 1.0609, 0.9256, 1.0477, 1.0084),
        (1.0571, 0.9534, 1.0709, 0.5142, 1.0571, 0.9529),
    ),
    (
        (1.0755, 1.0366, 1.0644, 0.9826, 1.0498, 1.0364),
        (1.0738, 1.0235, 1.0834, 0.8742, 1.0655, 1.0232),
        (1.0629, 0.9589, 1.0782, 0.3663, 1.0702, 0.9582),
    ),
    (
        (1.0845, 1.0750, 1.0875, 0.9728, 1.0673, 1.0794),
        (1.0776, 1.0483, 1.0958, 0.7797, 1.0789, 1.0525),
        (1.0311, 0.9791, 1.0392, 0.2026, 1.0672, 0.9826),
    ),
    (
        (1.0705, 1.0933, 1.0846, 0.9794, 1.0644, 1.1200),
        (1.0491, 1.0475, 1.0690, 0.6761, 1.0648, 1.0730),
        (0.9751, 0.9887, 0.9783, 0.1204, 1.0248, 1.0098),
    ),
    (
        (1.0432, 1.0714, 1.0627, 0.9953, 1.0459, 1.1330),
        (1.0011, 1.0146, 1.0295, 0.5867, 1.0344, 1.0688),
        (0.9294, 0.9712, 0.9406, 0.0866, 0.9730, 1.0165),
    ),
)
# Directions x, y, about z; the others are left as between rigid planes.
_BLOCKS_OVER_PLANES = (
    (1.0512, 1.0004, 1.0003),
    (1.0748, 1.0019, 1.0014),
    (1.1246, 1.0121, 1.0105),
    (1.1824, 1.0349, 1.0396),
    (1.2324, 1.0475, 1.0854),
)


def bricks_over_beam(notch: Notch) -> Array:
    """Ratio of the compliance between rigid end planes to beam theory, shape (6,)."""
    at = (
        np.clip(notch.slenderness, _T_OVER_R[0], _T_OVER_R[-1]),
        np.clip(notch.plate_mm / notch.thickness_mm, _B_OVER_T[0], _B_OVER_T[-1]),
    )
    table = RegularGridInterpolator((np.log(_T_OVER_R), np.log(_B_OVER_T)), np.array(_BRICKS_OVER_BEAM))
    return np.asarray(table(np.log(at))[0])


def blocks_over_planes(notch: Notch) -> Array:
    """Ratio of the compliance between elastic blocks to that between rigid planes, shape (6,)."""
    ratio = np.ones(6)
    for place, column in zip((0, 1, 5), np.array(_BLOCKS_OVER_PLANES).T, strict=True):
        ratio[place] = np.interp(np.log(notch.slenderness), np.log(_T_OVER_R), column)
    return ratio


def corrected_compliance(notch: Notch, material: Material) -> Array:
    """Compliance of a notch between rigid end planes, corrected by finite elements.

    Congruence with a diagonal keeps the matrix symmetric and positive definite; the entries that couple displacement
    and rotation are then within 0.3 % of the bricks' own.

    Returns
    -------
    ndarray of float, shape (6, 6)
        Order and units as in `beam_compliance`.
    """
    return _scaled(beam_compliance(notch, material), bricks_over_beam(notch))


def hinge_compliance(notch: Notch, material: Material, theory: HingeTheory) -> Array:
    """Compliance of a notch as a part of a body: between elastic blocks where corrected, by beam theory where asked."""
    compliance = beam_compliance(notch, material)
    if theory is HingeTheory.BEAM:
        return compliance
    return _scaled(compliance, bricks_over_beam(notch) * blocks_over_planes(notch))


def _scaled(compliance: Array, ratio: Array) -> Array:
    root = np.sqrt(ratio)
    return np.asarray(np.outer(root, root) * compliance)
