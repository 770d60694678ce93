"""Shape of a notch on both sides of a bar: circular or elliptic."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, sqrt

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

from fingervision.domain.errors import DataError
from fingervision.domain.gripper import Gripper, Material

Array = NDArray[np.float64]

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
    def is_circular(self) -> bool:
        """Whether the closed formulas of circular notches apply."""
        return self.half_length_mm == self.depth_mm

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


def circular_notch(radius_mm: float, thickness_mm: float, plate_mm: float) -> Notch:
    """A notch cut by two discs."""
    return Notch(thickness_mm, radius_mm, radius_mm, plate_mm)


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
