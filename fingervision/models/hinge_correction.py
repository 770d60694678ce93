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

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from math import inf, sqrt

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from fingervision.domain.errors import DataError
from fingervision.domain.gripper import Gripper, Material

Array = NDArray[np.float64]

# Shape of a notch on both sides of a bar: circular or elliptic.

_FINE = 400
"""Points along half a notch at which the bending compliance is accumulated."""


@dataclass(frozen=True, slots=True)
class Notch:
    """A notch that thins a bar of constant depth from both sides; x runs along the bar's axis from the middle.

    Parameters
    ----------
    thickness_mm : float
        Smallest height t.
    half_length_mm : float
        Half axis of the ellipse along the bar; the radius R of a circular notch.
    depth_mm : float
        Half axis of the ellipse across the bar; also the radius R for a circular notch.
    plate_mm : float
        Depth b of the bar, out of the plane.
    web_mm : float
        Height of the bar, if it is less than the notch's height at its ends: the notch then ends where it reaches the
        bar's faces, before its half axis.
    """

    thickness_mm: float
    half_length_mm: float
    depth_mm: float
    plate_mm: float
    web_mm: float = inf

    def __post_init__(self) -> None:
        if not self.web_mm > self.thickness_mm:
            raise DataError(
                f"The thickness left by a notch must be below the height of its bar, {self.web_mm:g} mm, but is "
                f"{self.thickness_mm:g} mm."
            )
        for name in ("thickness_mm", "half_length_mm", "depth_mm", "plate_mm"):
            value = getattr(self, name)
            if not value > 0.0:
                raise DataError(f"A notch's {name} must be positive, but is {value:g}.")

    @property
    def curvature_ratio(self) -> float:
        """Thickness over radius of curvature of the neck: R of a circle, a^2 / c of an ellipse with half axes a, c."""
        return self.thickness_mm * self.depth_mm / self.half_length_mm**2

    @property
    def reach_mm(self) -> float:
        """Half of the length of the notch's arc along the bar (mm)."""
        share = 1.0 - 0.5 * (self.web_mm - self.thickness_mm) / self.depth_mm
        return self.half_length_mm * sqrt(1.0 - max(share, 0.0) ** 2)

    def stations_mm(self, pieces: int) -> Array:
        """Ends of pieces along the notch, more densely where it bends; shape (pieces + 1,), symmetric about the middle.

        Each piece contributes the same amount to the mean of two fractions: the fraction of the bending compliance (the
        integral of 1 / h^3 for the height h) and the fraction of the length.
        """
        # Space the points by a sinh, closest at the neck: the part that bends is sqrt(t R) long and must be sampled
        # finely.
        fine = np.sinh(np.linspace(0.0, np.arcsinh(20.0 * self.reach_mm / self._bending_mm), _FINE))
        x = self.reach_mm * fine / fine[-1]
        middle = 0.5 * (x[1:] + x[:-1])
        bending = np.concatenate([[0.0], np.cumsum(np.diff(x) / self.height_mm(middle) ** 3)])
        share = 0.5 * bending / bending[-1] + 0.5 * x / x[-1]
        odd = np.concatenate([-share[:0:-1], share])
        return np.asarray(np.interp(np.linspace(-1.0, 1.0, pieces + 1), odd, np.concatenate([-x[:0:-1], x])))

    @property
    def _bending_mm(self) -> float:
        """Length over which the notch mainly bends: sqrt(t R), with R the radius of curvature at the neck (mm)."""
        return min(sqrt(self.thickness_mm * self.half_length_mm**2 / self.depth_mm), self.reach_mm)

    @property
    def bending_share(self) -> float:
        """Bending length over half length: sqrt(t / c) for an ellipse, sqrt(t / R) for a circle; at most 1."""
        return min(sqrt(self.thickness_mm / self.depth_mm), 1.0)

    def height_mm(self, x_mm: Array) -> Array:
        """Height t + 2 c (1 - sqrt(1 - x^2 / a^2)), with thickness t and half axes a (along) and c (across)."""
        along = np.clip(1.0 - (x_mm / self.half_length_mm) ** 2, 0.0, 1.0)
        return np.asarray(self.thickness_mm + 2.0 * self.depth_mm * (1.0 - np.sqrt(along)))


def notches_of(gripper: Gripper) -> tuple[Notch, Notch]:
    """The notches of hinge 1 (in the pillar) and of hinge 2 (in the shuttle)."""
    hinge, links = gripper.hinge, gripper.links
    x0, x1, _, _ = links.pillar_and_root_mm
    first, second = (
        Notch(hinge.thickness_mm, hinge.radius_mm, hinge.radius_mm, gripper.body.plate_mm, web_mm)
        for web_mm in (x1 - x0, links.shuttle_width_mm)
    )
    return first, second


def masses_t(notch: Notch, material: Material, edges_mm: Array) -> Array:
    """Masses between positions along the notch, by equation (1) of Hricko & Havlik (2015): density x depth x area.

    The integral of the notch's height h(x) has a closed form; int sqrt(1 - s^2) ds = (s sqrt(1 - s^2) + asin s) / 2.
    """
    edges = np.clip(edges_mm / notch.half_length_mm, -1.0, 1.0)
    under_arc = 0.5 * (edges * np.sqrt(1.0 - edges**2) + np.arcsin(edges))
    area = notch.half_length_mm * (
        (notch.thickness_mm + 2.0 * notch.depth_mm) * np.diff(edges) - 2.0 * notch.depth_mm * np.diff(under_arc)
    )
    return np.asarray(material.density_t_mm3 * notch.plate_mm * area)


# Compliance of a notch hinge: beam theory integrated along the notch.
#
# The load acts at the right end of the notch, x = R; the left end is fixed. The components are displacements along x
# and y, and rotation, with x along the hinge and y across it in the plane. For circular notches, Paros and Weisbord
# (1965) and Wu and Zhou (2002, Review of Scientific Instruments 73, 3101) give closed formulas, which the quadrature
# reproduces to ten digits. Beam theory is too stiff, and more so for thicker hinges: compared with a finite-element
# model at t / R = 0.25, by 5 % in bending and 7 % in tension. `hinge_correction` corrects these errors.

_GAUSS = leggauss(160)
"""Gauss-Legendre points and weights: accurate to thirteen digits from t / R = 0.002 to 1."""
_SHEAR = 6.0 / 5.0
"""Shear factor of a rectangle: Timoshenko, Strength of Materials, part 1."""


def beam_compliance(notch: Notch, material: Material, span_mm: tuple[float, float] | None = None) -> Array:
    """Integrate the compliance of a notch by beam theory, including shear.

    Parameters
    ----------
    notch : Notch
        Shape of the notch.
    material : Material
        Linear elastic material.
    span_mm : (float, float) or None
        Start and end of a part of the notch, as positions along its axis from its middle; the load acts at the part's
        right end. The parts in series have the compliance of the whole notch to rounding, wherever the notch is
        divided. None for the whole notch.

    Returns
    -------
    ndarray of float, shape (3, 3)
        Symmetric matrix with entries in mm/N, rad/N = mm/(N mm) and rad/(N mm).
    """
    # With x = a sin(angle) the integrands are smooth at the notch's ends; with sin(angle / 2) = c sinh(s) the peak of 1
    # / h^3 at the neck, which is sqrt(t R) wide, becomes as wide as the range, so that no digits are lost for thin
    # necks.
    nodes, weights = _GAUSS
    a, b = notch.half_length_mm, notch.plate_mm
    c = notch.bending_share
    low, high = (np.arcsin(np.clip(end / a, -1.0, 1.0)) for end in span_mm or (-notch.reach_mm, notch.reach_mm))
    s_low, s_high = np.arcsinh(np.sin(low / 2.0) / c), np.arcsinh(np.sin(high / 2.0) / c)
    s = 0.5 * (s_high + s_low) + 0.5 * (s_high - s_low) * nodes
    angle = 2.0 * np.arcsin(c * np.sinh(s))
    d_angle = 2.0 * c * np.cosh(s) / np.cos(angle / 2.0)
    x = a * np.sin(angle)
    dx = weights * 0.5 * (s_high - s_low) * d_angle * a * np.cos(angle)
    h = notch.height_mm(x)
    E, G = material.youngs_modulus_mpa, material.shear_modulus_mpa
    arm = a * np.sin(high) - x
    return timoshenko_compliance(
        float(np.sum(dx / (E * b * h))),
        float(_SHEAR * np.sum(dx / (G * b * h))),
        [float(np.sum(dx * arm**k * 12.0 / (E * b * h**3))) for k in range(3)],
    )


def bar_compliance(length_mm: float, width_mm: float, plate_mm: float, material: Material) -> Array:
    """Compliance of a straight bar (Timoshenko beam) at its loaded end, with the other end fixed.

    The order of components and the units are the same as in `beam_compliance`.
    """
    E, G = material.youngs_modulus_mpa, material.shear_modulus_mpa
    area = width_mm * plate_mm
    powers = [length_mm ** (k + 1) / (k + 1) for k in range(3)]
    return timoshenko_compliance(
        length_mm / (E * area),
        _SHEAR * length_mm / (G * area),
        [12.0 * p / (E * plate_mm * width_mm**3) for p in powers],
    )


def timoshenko_compliance(along: float, shear: float, bending: Sequence[float]) -> Array:
    """Compliance (x, y, rotation) of a beam at its loaded end.

    Parameters
    ----------
    along, shear : float
        Compliances in tension and in shear.
    bending : sequence of float
        Moments 0, 1 and 2 of the curvature per unit moment about the loaded end.
    """
    return np.array([[along, 0.0, 0.0], [0.0, bending[2] + shear, bending[1]], [0.0, bending[1], bending[0]]])


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
