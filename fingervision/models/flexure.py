"""Geometry of one flexure: the shapes that it adds or removes, its height along its axis, its out-of-plane width."""

from dataclasses import dataclass
from math import cos, radians, sin, sqrt
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gripper import PointMm
from fingervision.models.hinge_correction import plane_strain_share
from fingervision.models.notch import Notch
from fingervision.models.plane_shapes import Ellipse, Polygon, Shape, bar
from fingervision.models.strip_width import stretched_share, strip_share
from fingervision.models.width_effect import ConstrainedZone

Array = NDArray[np.float64]

FlexureKind = Literal["circular", "elliptic", "filleted", "leaf"]
_HEIGHT_THAT_BENDS = 0.13
"""Largest height that a fillet adds on either side, in thicknesses, for a section that still counts as bending: such a
section is 1.26 times as high as the neck and twice as stiff in bending."""
_POISSON = 0.34
"""Poisson's ratio for which the plane-strain share is computed: the share changes by only 0.006 between Poisson's
ratios nu = 0.2 and 0.34, and is multiplied by nu^2."""


@dataclass(frozen=True, slots=True)
class Flexure:
    """One flexure with its dimensions.

    Parameters
    ----------
    name : str
        Name of the flexure in messages.
    kind : str
        `circular` and `elliptic`: two discs or ellipses cut into the body; `filleted`: two slots with rounded corners
        cut into the body; `leaf`: a thin bar added between bodies.
    at_mm : (float, float)
        Centre of the flexure.
    axis_deg : float
        Angle of the flexure's axis from x.
    thickness_mm : float
        Least height of the flexure.
    half_length_mm, depth_mm : float
        Half extent along the axis, and depth of the cut, measured from the surface of the neck. For a circular flexure,
        both are its radius. A leaf has no depth.
    fillet_mm : float
        Radius of the corners of a filleted flexure.
    used : (float, float, float) or None
        Shares of the flexure's strain energy from three deformations: ends that rotate against each other, ends that
        sway, and elongation. None where the shares are unknown.
    """

    name: str
    kind: FlexureKind
    at_mm: PointMm
    axis_deg: float
    thickness_mm: float
    half_length_mm: float
    depth_mm: float = 0.0
    fillet_mm: float = 0.0
    used: tuple[float, float, float] | None = None

    def point_mm(self, along: Any, across: Any) -> tuple[Any, Any]:
        """Convert coordinates along and across the flexure's axis to a point, or to an array of points."""
        c, s = cos(radians(self.axis_deg)), sin(radians(self.axis_deg))
        return self.at_mm[0] + c * along - s * across, self.at_mm[1] + s * along + c * across

    def _box(self, along: float, low: float, high: float) -> Polygon:
        places = ((-along, low), (along, low), (along, high), (-along, high))
        return Polygon(tuple(self.point_mm(a, b) for a, b in places))

    def steps(self) -> list[tuple[bool, Shape]]:
        """Shapes that the flexure adds to the drawing's region or removes from it."""
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
        """Whether the flexure's surfaces are circular or elliptic arcs over its whole length."""
        return self.kind in ("circular", "elliptic")

    def height_mm(self, x_mm: Array) -> Array:
        """Height at positions along the axis, measured from the flexure's centre (mm)."""
        t, a = self.thickness_mm, self.half_length_mm
        if self.is_notch:
            return self.notch(1.0).height_mm(x_mm)
        if self.fillet_mm == 0.0:
            return np.full(np.shape(x_mm), t)
        within = np.clip((np.abs(x_mm) - (a - self.fillet_mm)) / self.fillet_mm, 0.0, 1.0)
        return np.asarray(t + 2.0 * self.fillet_mm * (1.0 - np.sqrt(1.0 - within**2)))

    def notch(self, plate_mm: float) -> Notch:
        """Notch with the dimensions of a circular or elliptic flexure, for a plate thickness."""
        return Notch(self.thickness_mm, self.half_length_mm, self.depth_mm, plate_mm)

    @property
    def bent_mm(self) -> float:
        """Length of a leaf or straight neck that bends, with the part of its fillets that is at most twice as stiff."""
        straight, r = self.half_length_mm - self.fillet_mm, self.fillet_mm
        if r == 0.0:
            return 2.0 * straight
        rise = min(_HEIGHT_THAT_BENDS * self.thickness_mm / r, 1.0)
        return 2.0 * (straight + r * sqrt(1.0 - (1.0 - rise) ** 2))

    def width_share(self, plate_mm: float) -> float:
        """Degree to which the plate's width constrains the bending: 0 for plane stress, 1 for plane strain.

        For a leaf or a straight neck, the degree of constraint is a mean of two cases, ends that rotate and ends that
        keep their direction. Rotating and parallel ends are weighted by their shares of the strain energy, or equally
        where these shares are unknown.
        """
        if self.is_notch:
            return plane_strain_share(self.notch(plate_mm))
        bent, swayed = strip_share(plate_mm / self.bent_mm, _POISSON)
        if self.used is None:
            return 0.5 * (bent + swayed)
        return (self.used[0] * bent + self.used[1] * swayed) / max(self.used[0] + self.used[1], 1e-300)

    def width_doubt(self, plate_mm: float) -> float:
        """Half of the range in which `width_share` may lie, because the conditions at a strip's ends are unknown."""
        if self.is_notch or self.used is not None:
            return 0.0
        bent, swayed = strip_share(plate_mm / self.bent_mm, _POISSON)
        return 0.5 * (swayed - bent)

    def zone(self, plate_mm: float) -> ConstrainedZone:
        """Zone in which the plate's width restrains the flexure, with the degree of restraint that the models use."""
        share = self.width_share(plate_mm)
        if self.used is not None:
            stretched = stretched_share(plate_mm / self.bent_mm, _POISSON)
            share += self.used[2] * (stretched - share)
        height = 0.5 * self.thickness_mm + self.depth_mm
        return ConstrainedZone(self.at_mm, self.axis_deg, self.half_length_mm, height, share)
