"""Beam theory of the notch hinge corrected by finite elements: the default of the models.

The compliance in each direction is multiplied by ratios that `tests/benchmarks/models_hinge_table.py` prints for nu =
0.34. The first ratio is the compliance in plane stress, between rigid end planes, over the compliance by beam theory.
The second ratio is the restraint of a hinge by the plate's width, from quadratic brick elements; the restraint scales
with nu^2 (nu: Poisson's ratio). The third ratio, for a hinge in a body, is the compliance between elastic blocks over
the compliance between rigid planes, because the blocks deform where the notch joins them. For a neck of thickness t in
a notch of radius R and a plate of width b, with t / R = 0.25 and b / t = 3, the brick model is 1.05 times as compliant
as beam theory in bending, and 1.08 times in tension. Between the nodes of the table, ratios are interpolated over log(t
/ R) and log(b / t); beyond the ends of the table they are constant.
"""

from enum import StrEnum
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from fingervision.domain.gripper import Material
from fingervision.models.notch import Notch

Array = NDArray[np.float64]


class HingeTheory(StrEnum):
    """Source of a hinge's compliance: beam theory alone, or beam theory corrected by finite elements."""

    CORRECTED = "corrected"
    BEAM = "beam"


_T_OVER_R = (0.0125, 0.025, 0.05, 0.1, 0.25, 0.5, 0.8, 1.6)
_B_OVER_T = (0.5, 1.0, 3.0, 10.0, 30.0, 100.0)
_POISSON = 0.34
"""Poisson's ratio of the tables. The effect of the width on the in-plane compliance is proportional to nu^2: the factor
for plane strain is 1 - nu^2."""
_X, _TURN = 0, 2

# First index: t / R; second index: b / t; third index: along, across, rotation.
_BRICKS_OVER_BEAM = (
    (
        (1.0352, 1.0013, 1.0013),
        (1.0352, 1.0013, 1.0013),
        (1.0351, 0.9992, 0.9992),
        (1.0345, 0.9707, 0.9707),
        (1.0289, 0.9169, 0.9169),
        (0.9938, 0.8939, 0.8939),
    ),
    (
        (1.0471, 1.0089, 1.0088),
        (1.0471, 1.0088, 1.0087),
        (1.0468, 1.0048, 1.0048),
        (1.0453, 0.9633, 0.9631),
        (1.0332, 0.9151, 0.9150),
        (0.9787, 0.8980, 0.8979),
    ),
    (
        (1.0610, 1.0193, 1.0191),
        (1.0608, 1.0191, 1.0188),
        (1.0599, 1.0118, 1.0115),
        (1.0562, 0.9578, 0.9573),
        (1.0285, 0.9186, 0.9183),
        (0.9652, 0.9053, 0.9051),
    ),
    (
        (1.0749, 1.0374, 1.0372),
        (1.0742, 1.0370, 1.0367),
        (1.0723, 1.0240, 1.0237),
        (1.0618, 0.9611, 0.9605),
        (1.0062, 0.9305, 0.9302),
        (0.9591, 0.9200, 0.9197),
    ),
    (
        (1.0843, 1.0762, 1.0808),
        (1.0825, 1.0748, 1.0794),
        (1.0761, 1.0484, 1.0527),
        (1.0311, 0.9815, 0.9852),
        (0.9725, 0.9604, 0.9639),
        (0.9500, 0.9526, 0.9561),
    ),
    (
        (1.0729, 1.0962, 1.1229),
        (1.0689, 1.0923, 1.1193),
        (1.0484, 1.0474, 1.0730),
        (0.9765, 0.9910, 1.0124),
        (0.9401, 0.9755, 0.9959),
        (0.9279, 0.9699, 0.9899),
    ),
    (
        (1.0500, 1.0787, 1.1399),
        (1.0423, 1.0704, 1.1321),
        (1.0016, 1.0149, 1.0692),
        (0.9311, 0.9732, 1.0191),
        (0.9070, 0.9618, 1.0054),
        (0.8990, 0.9578, 1.0006),
    ),
    (
        (0.9924, 0.9917, 1.1120),
        (0.9720, 0.9736, 1.0883),
        (0.9008, 0.9292, 1.0145),
        (0.8537, 0.9096, 0.9806),
        (0.8410, 0.9042, 0.9712),
        (0.8366, 0.9025, 0.9681),
    ),
)
# Plane stress between rigid planes, by t / R: along, across, rotation.
_PLANES_OVER_BEAM = (
    (1.0359, 1.0050, 1.0050),
    (1.0480, 1.0100, 1.0099),
    (1.0622, 1.0199, 1.0196),
    (1.0767, 1.0384, 1.0380),
    (1.0883, 1.0793, 1.0834),
    (1.0801, 1.1034, 1.1294),
    (1.0610, 1.0904, 1.1513),
    (1.0149, 1.0129, 1.1381),
)
# Plane stress, elastic blocks over rigid planes, by t / R: along, rotation.
_BLOCKS_OVER_PLANES = (
    (1.0245, 1.0000),
    (1.0353, 1.0001),
    (1.0512, 1.0003),
    (1.0749, 1.0014),
    (1.1247, 1.0105),
    (1.1826, 1.0397),
    (1.2326, 1.0857),
    (1.3083, 1.2094),
)


_SWAY = (1.4026, 1.3674, 1.3122, 1.2233, 1.0407, 0.8454, 0.6979)
"""Ratio of the shear compliance of a notch between elastic blocks to that of a Timoshenko beam, by t / R up to 0.8. The
shear compliance is chosen so that the notch, with ends that stay parallel, is as compliant across its axis as a mesh of
plane-stress elements (`tests/benchmarks/models_sway_table.py`). The sections of a notch widen quickly, so that their
shear differs from that of a straight beam."""


def sway_shear(notch: Notch) -> float:
    """Shear compliance of a notch in a body, as a multiple of the integral of 1 / (E b h) over its length.

    In plane stress, the shear compliance as such a multiple does not depend on Poisson's ratio, because the stresses
    under given loads do not depend on this ratio (Michell's theorem).
    """
    return SWAY_SHEAR * _sway_ratio(notch.curvature_ratio)


SWAY_SHEAR = 6.0 / 5.0 * 2.0 * (1.0 + _POISSON)
"""Shear compliance of a Timoshenko beam with the Poisson's ratio of the tables, as a multiple of the integral of 1 / (E
b h)."""


@lru_cache(maxsize=512)
def _sway_ratio(t_over_r: float) -> float:
    at = np.log(_T_OVER_R[: len(_SWAY)])
    return float(PchipInterpolator(at, _SWAY)(np.clip(np.log(t_over_r), at[0], at[-1])))


@lru_cache(maxsize=1)
def _by_t_over_r() -> tuple[PchipInterpolator, PchipInterpolator, PchipInterpolator]:
    """Curves over log(t / R): shares of plane strain by b / t, plane stress over beam theory, blocks over planes."""
    table = np.array(_BRICKS_OVER_BEAM)
    shares = (1.0 - table / table[:, :1, :]) / _POISSON**2
    tables = (shares, np.array(_PLANES_OVER_BEAM), np.array(_BLOCKS_OVER_PLANES))
    bricks, plane, blocks = (PchipInterpolator(np.log(_T_OVER_R), rows, axis=0) for rows in tables)
    return bricks, plane, blocks


@lru_cache(maxsize=512)
def _shares(t_over_r: float, b_over_t: float) -> tuple[float, ...]:
    """Interpolate shares of plane strain."""
    if t_over_r < _T_OVER_R[0]:
        # The ratio that matters is that of the width to the length that bends, sqrt(t R).
        b_over_t *= np.sqrt(t_over_r / _T_OVER_R[0])
    at = np.log(np.clip(t_over_r, _T_OVER_R[0], _T_OVER_R[-1]))
    curves = PchipInterpolator(np.log(_B_OVER_T), _by_t_over_r()[0](at), axis=0)
    return tuple(curves(np.log(np.clip(b_over_t, _B_OVER_T[0], _B_OVER_T[-1]))).tolist())


def plane_strain_share(notch: Notch) -> float:
    """Degree to which the width restrains the notch in bending: 0 for plane stress, 1 for plane strain."""
    share = _shares(notch.curvature_ratio, notch.plate_mm / notch.thickness_mm)[_TURN]
    return min(max(share, 0.0), 1.0)


def planes_ratio(notch: Notch, material: Material) -> Array:
    """Ratio of the compliance between rigid end planes to beam theory: along, across, rotation, shape (3,)."""
    shares = np.array(_shares(notch.curvature_ratio, notch.plate_mm / notch.thickness_mm))
    at = np.log(np.clip(notch.curvature_ratio, _T_OVER_R[0], _T_OVER_R[-1]))
    return np.asarray(_by_t_over_r()[1](at) * (1.0 - shares * material.poisson_ratio**2))


def hinge_ratio(notch: Notch, material: Material, theory: HingeTheory) -> Array:
    """Ratio of the compliance of a notch in a body to that by beam theory, shape (3,); all ratios are 1 for `BEAM`."""
    if theory is HingeTheory.BEAM:
        return np.ones(3)
    at = np.log(np.clip(notch.curvature_ratio, _T_OVER_R[0], _T_OVER_R[-1]))
    along, bending = planes_ratio(notch, material)[[_X, _TURN]] * _by_t_over_r()[2](at)
    # Across the hinge, use the ratio of bending, so that the segments of a notch together are as compliant as the whole
    # notch.
    return np.array([along, bending, bending])
