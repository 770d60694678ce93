"""A planar flexure mechanism as its drawing states it: bodies, flexures, supports, drive, probes."""

from dataclasses import dataclass
from math import cos, hypot, radians, sin
from typing import Literal

import numpy as np

from fingervision.domain.errors import FingervisionError
from fingervision.domain.gripper import Material, PointMm
from fingervision.models.hinge_correction import plane_strain_share
from fingervision.models.notch import Notch
from fingervision.models.planar_region import Ellipse, PlanarRegion, Polygon, Shape, bar
from fingervision.models.width_effect import ConstrainedZone

FlexureKind = Literal["circular", "elliptic", "filleted", "leaf"]
_LEAF_IN_NOTCHES = 1.178
"""3 pi / 8: a thin notch bends as a leaf of its thickness and 1.178 sqrt(t R) of length (Paros and Weisbord)."""


@dataclass(frozen=True, slots=True)
class Flexure:
    """One flexure; each has its own numbers.

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

    def point_mm(self, along: float, across: float) -> PointMm:
        """Return a point by its way along the axis and across it."""
        c, s = cos(radians(self.axis_deg)), sin(radians(self.axis_deg))
        return self.at_mm[0] + c * along - s * across, self.at_mm[1] + s * along + c * across

    def _box(self, along: float, low: float, high: float) -> Polygon:
        places = ((-along, low), (along, low), (along, high), (-along, high))
        return Polygon(tuple(self.point_mm(a, b) for a, b in places))

    def steps(self) -> list[tuple[bool, Shape]]:
        """Return the shapes that it adds or cuts."""
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

    def zone(self, plate_mm: float) -> ConstrainedZone:
        """Where the plate's width holds it back, and how far."""
        t = self.thickness_mm
        if self.kind in ("circular", "elliptic"):
            notch = Notch(t, self.half_length_mm, self.depth_mm, plate_mm)
        else:
            radius = (2.0 * self.half_length_mm / _LEAF_IN_NOTCHES) ** 2 / t
            notch = Notch(t, radius, radius, plate_mm)
        height = 0.5 * t + self.depth_mm
        return ConstrainedZone(self.at_mm, self.axis_deg, self.half_length_mm, height, plane_strain_share(notch))


@dataclass(frozen=True, slots=True)
class Face:
    """Nodes of the outline in an upright box: x from, x to, y from, y to."""

    name: str
    box_mm: tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Drive:
    """A face that moves by the input.

    Parameters
    ----------
    face : Face
        Where.
    direction : (float, float)
        Unit vector of a positive input.
    across : str
        `held`: guided, as by a stage; `free`: the face may slide, only along x or y.
    """

    face: Face
    direction: PointMm
    across: Literal["held", "free"]


@dataclass(frozen=True, slots=True)
class Mechanism:
    """A planar mechanism.

    Parameters
    ----------
    name : str
        What it is called.
    material : Material
        Of the plate.
    plate_mm : float
        Its thickness.
    bodies : tuple of (bool, Shape)
        Shapes that are added (true) or cut, in order; the flexures follow them.
    flexures : tuple of Flexure
        Each with its own numbers.
    fixed : tuple of Face
        Faces that do not move.
    slides : tuple of (Face, str)
        Faces on a line of symmetry, and the component, x or y, that is held there.
    drive : Drive
        What moves.
    probes : dict of str to (float, float)
        Points whose motion is wanted.
    pairs : dict of str to (str, str)
        Pairs of probes whose distance is wanted; a gap is a pair.
    """

    name: str
    material: Material
    plate_mm: float
    bodies: tuple[tuple[bool, Shape], ...]
    flexures: tuple[Flexure, ...]
    fixed: tuple[Face, ...]
    slides: tuple[tuple[Face, str], ...]
    drive: Drive
    probes: dict[str, PointMm]
    pairs: dict[str, tuple[str, str]]

    @property
    def region(self) -> PlanarRegion:
        """The body: shapes and flexures, with corners where faces begin and end."""
        steps = (*self.bodies, *(step for flexure in self.flexures for step in flexure.steps()))
        faces = [*self.fixed, *(face for face, _ in self.slides), self.drive.face]
        marks = tuple((x, y) for face in faces for x in face.box_mm[:2] for y in face.box_mm[2:])
        return PlanarRegion(steps, marks)


def check_mechanism(mechanism: Mechanism, region: PlanarRegion) -> None:
    """Refuse a drawing that is no mechanism.

    Raises
    ------
    FingervisionError
        Where it is not one body, a flexure holds no material or its neck is no neck, or a probe lies outside.
    """
    name = mechanism.name
    try:
        outer = sum(loop.area_mm2 > 0.0 for loop in region.loops)
    except FingervisionError as error:
        raise FingervisionError(f"In {name}: {error}") from error
    if outer != 1:
        raise FingervisionError(
            f"The bodies of {name} must be one piece, but are {outer}; let bodies and flexures overlap, and "
            "no cut part them."
        )
    size = region.size_mm
    for flexure in mechanism.flexures:
        t = flexure.thickness_mm
        inside = np.array([flexure.point_mm(0.0, s * t * 0.49) for s in (-1.0, 0.0, 1.0)]).T
        beside = np.array([flexure.point_mm(0.0, s * (0.5 * t + 1e-3 * t)) for s in (-1.0, 1.0)]).T
        if not region.holds(inside).all() or region.holds(beside).any():
            raise FingervisionError(
                f"flexure {flexure.name} of {name} must be a neck of {t:g} mm at ({flexure.at_mm[0]:g}, "
                f"{flexure.at_mm[1]:g}) mm, but there the material is thinner, thicker or none; "
                "check its place and axis."
            )
    for probe, (x, y) in mechanism.probes.items():
        ring = np.array([[x + 1e-6 * size * dx, y + 1e-6 * size * dy] for dx in (-1, 0, 1) for dy in (-1, 0, 1)]).T
        if not region.holds(ring).any():
            raise FingervisionError(
                f"probe {probe} of {name} must lie on the body, but ({x:g}, {y:g}) mm is outside it."
            )
    for face in (*mechanism.fixed, mechanism.drive.face):
        if hypot(*face.box_mm) > 1e6:
            raise FingervisionError(f"face {face.name} of {name} must have a box of finite size.")
