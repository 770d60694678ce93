"""The shape of a two-sided notch: circular, or elliptic."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import FingervisionError
from fingervision.domain.gripper import Gripper, Material

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Notch:
    """A bar of constant depth, thinned from both sides; x along its axis from the middle.

    Parameters
    ----------
    thickness_mm : float
        Smallest height t.
    half_length_mm : float
        Half axis of the ellipse along the bar; the radius R of a circular notch.
    depth_mm : float
        Half axis of the ellipse across the bar; the radius again of a circular one.
    plate_mm : float
        Depth b of the bar, out of the plane.
    """

    thickness_mm: float
    half_length_mm: float
    depth_mm: float
    plate_mm: float

    def __post_init__(self) -> None:
        for name in ("thickness_mm", "half_length_mm", "depth_mm", "plate_mm"):
            value = getattr(self, name)
            if not value > 0.0:
                raise FingervisionError(f"A notch's {name} must be positive, but is {value:g}.")

    @property
    def is_circular(self) -> bool:
        """Whether the closed forms of circular notches hold."""
        return self.half_length_mm == self.depth_mm

    @property
    def slenderness(self) -> float:
        """Thickness over half length: t / R of a circular notch."""
        return self.thickness_mm / self.half_length_mm

    def height_mm(self, x_mm: Array) -> Array:
        """Height h(x) = t + 2 c (1 - sqrt(1 - x^2 / a^2))."""
        along = np.clip(1.0 - (x_mm / self.half_length_mm) ** 2, 0.0, 1.0)
        return np.asarray(self.thickness_mm + 2.0 * self.depth_mm * (1.0 - np.sqrt(along)))


def circular_notch(radius_mm: float, thickness_mm: float, plate_mm: float) -> Notch:
    """Cut a notch with two discs."""
    return Notch(thickness_mm, radius_mm, radius_mm, plate_mm)


def notch_of(gripper: Gripper) -> Notch:
    """Take the notch that all hinges of a gripper share."""
    return circular_notch(gripper.hinge.radius_mm, gripper.hinge.thickness_mm, gripper.body.plate_mm)


def segment_mass_t(notch: Notch, material: Material, segments: int) -> Array:
    """Masses of equal segments of the notch, equation (1) of the paper: density times depth times area.

    The integral of h has a closed form; int sqrt(1 - s^2) ds = (s sqrt(1 - s^2) + asin s) / 2.
    """
    edges = np.linspace(-1.0, 1.0, segments + 1)
    under_arc = 0.5 * (edges * np.sqrt(1.0 - edges**2) + np.arcsin(edges))
    area = notch.half_length_mm * (
        (notch.thickness_mm + 2.0 * notch.depth_mm) * np.diff(edges) - 2.0 * notch.depth_mm * np.diff(under_arc)
    )
    return np.asarray(material.density_t_mm3 * notch.plate_mm * area)
