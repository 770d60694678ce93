"""Width effect: restraint of flexures by the width of the plate, between plane stress and plane strain.

A bar in bending becomes narrower on its stretched side and wider on the compressed side. A flexure that is short
compared with its width cannot become narrower or wider, because of the thick material at its ends. A flexure that is
short compared with its width is therefore stiffer than in plane stress, by a factor of up to 1 / (1 - nu^2) in plane
strain (nu: Poisson's ratio). The weight w of plane strain (0 to 1) comes from brick elements (`hinge_correction`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, radians, sin

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from fingervision.domain.gripper import Material, PointMm

Array = NDArray[np.float64]

SHARE_UNCERTAINTY = 0.05
"""Standard uncertainty of the weight w of plane strain. The bending stiffness is within 0.42 % of brick elements
between elastic blocks for width over thickness 1 to 20 and t / R 0.0125 to 0.5, which is 0.04 of w at nu = 0.34
(`tests/models/test_thin_necks.py` holds it). The resulting uncertainty of the force is 0.05 nu^2, 0.6 %."""


@dataclass(frozen=True, slots=True)
class ConstrainedZone:
    """A flexure seen in the plane of the plate: a rectangle in which lateral contraction is restrained.

    Parameters
    ----------
    centre_mm : (float, float)
        Centre of the rectangle.
    axis_deg : float
        Angle of the flexure's axis from x.
    half_length_mm, half_height_mm : float
        Half extents along the axis and across it.
    share, stressed : float
        Share of plane strain, 0 for plane stress and 1 for plane strain: in the stiffness, and in the largest von Mises
        stress over the plate's depth.
    """

    centre_mm: PointMm
    axis_deg: float
    half_length_mm: float
    half_height_mm: float
    share: float
    stressed: float

    def grown(self, factor: float) -> "ConstrainedZone":
        """The zone with both extents multiplied by a factor."""
        length, height = factor * self.half_length_mm, factor * self.half_height_mm
        return replace(self, half_length_mm=length, half_height_mm=height)

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Whether points, shape (2, n), lie in the zone."""
        c, s = cos(radians(self.axis_deg)), sin(radians(self.axis_deg))
        x, y = points[0] - self.centre_mm[0], points[1] - self.centre_mm[1]
        return np.asarray(
            (np.abs(c * x + s * y) <= self.half_length_mm) & (np.abs(c * y - s * x) <= self.half_height_mm)
        )


@dataclass(frozen=True, slots=True, eq=False)
class HeldBodies:
    """Restraint of bodies by their width, where they bend: shares of plane strain that differ from place to place.

    Parameters
    ----------
    points_mm : ndarray of float, shape (2, n)
        Places at which the shares are known.
    shares : ndarray of float, shape (n,)
        Shares of plane strain.
    mean : float
        Mean of the shares, weighted by the strain energy.
    """

    points_mm: Array
    shares: Array
    mean: float

    def at(self, points: Array) -> Array:
        """Shares at other places, shape (2, m): those of the nearest known ones."""
        return np.asarray(self.shares[KDTree(self.points_mm.T).query(points.T)[1]])


def shares_at(zones: Sequence[ConstrainedZone], points: Array, bodies: HeldBodies | None = None) -> Array:
    """Shares of plane strain in stiffness and stress at given points, shape (2, n); `bodies` outside the zones."""
    shares = np.zeros((2, points.shape[1])) if bodies is None else np.tile(bodies.at(points), (2, 1))
    inside = np.zeros(points.shape[1], dtype=bool)
    for zone in zones:
        own, here = np.array([[zone.share], [zone.stressed]]), zone.holds(points)
        shares = np.where(here, np.where(inside, np.maximum(shares, own), own), shares)
        inside |= here
    return shares


def held_moduli(material: Material, share: Array) -> tuple[Array, Array]:
    """Young's modulus and Poisson's ratio of the in-plane material law for a weight w of plane strain.

    With sigma_z = w nu (sigma_x + sigma_y), Hooke's law in the plane is that of plane stress with E' = E / (1 - w nu^2)
    and nu' = nu (1 + w nu) / (1 - w nu^2); the shear modulus is unchanged.
    """
    E, nu = material.youngs_modulus_mpa, material.poisson_ratio
    held = 1.0 - share * nu**2
    return E / held, nu * (1.0 + share * nu) / held


def force_uncertainty(material: Material) -> float:
    """Relative standard uncertainty, from the width effect, of the force and of the squared frequency."""
    return SHARE_UNCERTAINTY * material.poisson_ratio**2
