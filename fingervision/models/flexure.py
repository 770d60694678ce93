"""One flexure of a drawing: the shapes that it adds or cuts, its height along its axis, and the effect of its width."""

from dataclasses import dataclass
from math import cos, radians, sin
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gripper import PointMm
from fingervision.models.hinge_correction import plane_strain_share
from fingervision.models.notch import Notch
from fingervision.models.plane_shapes import Ellipse, Polygon, Shape, bar
from fingervision.models.width_effect import ConstrainedZone

Array = NDArray[np.float64]

FlexureKind = Literal["circular", "elliptic", "filleted", "leaf"]
_LEAF_IN_NOTCHES = 1.178
"""3 pi / 8: a thin notch bends as a leaf of its thickness and 1.178 sqrt(t R) of length (Paros and Weisbord)."""


@dataclass(frozen=True, slots=True)
class Flexure:
    """One flexure, with its own dimensions.

    Parameters
    ----------
    name : str
        For messages.
    kind : str
        `circular` and `elliptic`: two discs or ellipses cut into the body; `filleted`: two slots with rounded corners
        cut into the body; `leaf`: a thin bar added between bodies.
    at_mm : (float, float)
        Its middle.
    axis_deg : float
        Direction of its axis from x.
    thickness_mm : float
        Least height.
    half_length_mm, depth_mm : float
        Half extent along the axis, and how far the cut goes in from the surface of the neck: both the radius of a
        circular flexure. A leaf has no depth.
    fillet_mm : float
        Radius of the corners of a filleted flexure.
    """

    name: str
    kind: FlexureKind
    at_mm: PointMm
    axis_deg: float
    thickness_mm: float
    half_length_mm: float
    depth_mm: float = 0.0
    fillet_mm: float = 0.0

    def point_mm(self, along: Any, across: Any) -> tuple[Any, Any]:
        """A point, or array of points, from its coordinates along and across the axis."""
        c, s = cos(radians(self.axis_deg)), sin(radians(self.axis_deg))
        return self.at_mm[0] + c * along - s * across, self.at_mm[1] + s * along + c * across

    def _box(self, along: float, low: float, high: float) -> Polygon:
        places = ((-along, low), (along, low), (along, high), (-along, high))
        return Polygon(tuple(self.point_mm(a, b) for a, b in places))

    def steps(self) -> list[tuple[bool, Shape]]:
        """Shapes that the flexure adds to or cuts from the region."""
        half = 0.5 * self.thickness_mm
        if self.kind == "leaf":
            ends = (*self.point_mm(-self.half_length_mm, 0.0), *self.point_mm(self.half_length_mm, 0.0))
            return [(True, bar(*ends, self.thickness_mm))]
        steps: list[tuple[bool, Shape]] = []
        for side in (-1.0, 1.0):
            if self.kind != "filleted":
                centre = self.point_mm(0.0, side * (half + self.depth_mm))
                steps.append((False, Ellipse(centre, (self.half_length_mm, self.depth_mm), self.axis_deg)))
                continue
            r, length, deep = self.fillet_mm, self.half_length_mm, half + self.depth_mm
            steps.append((False, self._box(length - r, side * half, side * deep)))
            steps.append((False, self._box(length, side * (half + r), side * deep)))
            corners = [self.point_mm(end * (length - r), side * (half + r)) for end in (-1.0, 1.0)]
            steps += [(False, Ellipse(corner, (r, r))) for corner in corners]
        return steps

    @property
    def is_notch(self) -> bool:
        """Whether its surfaces are circular or elliptic arcs over the whole length."""
        return self.kind in ("circular", "elliptic")

    def height_mm(self, x_mm: Array) -> Array:
        """Height at positions along the axis, counted from the middle (mm)."""
        t, a = self.thickness_mm, self.half_length_mm
        if self.is_notch:
            return self.notch(1.0).height_mm(x_mm)
        if self.fillet_mm == 0.0:
            return np.full(np.shape(x_mm), t)
        within = np.clip((np.abs(x_mm) - (a - self.fillet_mm)) / self.fillet_mm, 0.0, 1.0)
        return np.asarray(t + 2.0 * self.fillet_mm * (1.0 - np.sqrt(1.0 - within**2)))

    def notch(self, plate_mm: float) -> Notch:
        """The notch with the same bending behaviour: itself, or an equivalent of a leaf or straight neck."""
        t = self.thickness_mm
        if self.is_notch:
            return Notch(t, self.half_length_mm, self.depth_mm, plate_mm)
        radius = (2.0 * self.half_length_mm / _LEAF_IN_NOTCHES) ** 2 / t
        return Notch(t, radius, radius, plate_mm)

    def zone(self, plate_mm: float) -> ConstrainedZone:
        """Zone in which the plate's width restrains the flexure, and how strongly."""
        share = plane_strain_share(self.notch(plate_mm))
        height = 0.5 * self.thickness_mm + self.depth_mm
        return ConstrainedZone(self.at_mm, self.axis_deg, self.half_length_mm, height, share)
