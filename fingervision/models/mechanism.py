"""Description of a planar flexure mechanism, as given by its drawing: bodies, flexures, supports, drive, probes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import hypot, pi, sqrt
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DataError, FingervisionError
from fingervision.domain.gripper import Material, PointMm
from fingervision.models.flexure import Flexure
from fingervision.models.layers import Joint, Sheet, pieces_of, points_in
from fingervision.models.planar_region import PlanarRegion, sharp_corners_mm
from fingervision.models.plane_shapes import Shape, box, crossings
from fingervision.models.width_effect import HeldBodies, force_uncertainty

SIZES_MM = (0.3, 5000.0)
"""Sizes of flexure mechanisms, from etched silicon to large machines: drawings in metres or micrometres lie outside."""
_OVER_DEPTH = 0.02
"""Variation of the stress over the plate's depth beside that by restraint, from wedge elements of CalculiX
(`tests/benchmarks/models_three_dimensions.py`)."""
_AT_CORNER = 1.01
"""Size, over that of a flexure, of the rectangle in which corners belong to it."""
_MOST_NAMED = 3
"""Pieces of a drawing that a message names."""
_BETWEEN_ROOTS = 0.8
"""Part of a flexure's length that a clamp must leave free: its ends lie in bodies, at whose faces a box may end."""
_SAME_AREA = 1e-2
"""Relative difference below which two areas count as equal: areas of regions with arcs are computed from polygons, with
an error of 1e-3."""


Box = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Face:
    """A face of the body: the nodes of the outline inside a box with sides parallel to x and y (mm).

    A pin (`is_pin`) is instead the part of the body, on its outline or inside it, within the largest circle in the box.
    """

    name: str
    box_mm: tuple[float, float, float, float]
    is_pin: bool = False

    def holds(self, points_mm: NDArray[np.float64], near_mm: float) -> NDArray[np.bool_]:
        """Whether points, shape (2, n), lie in the box, or at most a distance outside it."""
        (x0, x1, y0, y1), (x, y) = self.box_mm, points_mm
        inside = (x >= x0 - near_mm) & (x <= x1 + near_mm) & (y >= y0 - near_mm) & (y <= y1 + near_mm)
        return np.asarray(inside)

    @property
    def middle_mm(self) -> PointMm:
        """Middle of the box."""
        x0, x1, y0, y1 = self.box_mm
        return 0.5 * (x0 + x1), 0.5 * (y0 + y1)


@dataclass(frozen=True, slots=True)
class Drive:
    """A driven face, which moves by the input times `per_input`.

    Parameters
    ----------
    face : Face
        The face that moves.
    direction : (float, float)
        Unit vector of the motion for a positive input.
    across : str
        Motion across `direction`: `held` for a face guided as by a stage; `free` for a face that may slide (only with a
        direction along x or y).
    per_input : float
        Motion of the face along `direction` per 1 mm of input; 0 for a drive that stands still.
    turns : str
        Rotation of the face: `free` for a rod or a pin, which moves the face in the mean, with a force spread evenly
        over it, while the face may turn and bend; `held` for a clamp or a flat plate, with which every point of the
        face moves alike.
    stiffness_n_mm : float or None
        Stiffness of the actuator between its own motion, which is the input, and the face; None for a stage, whose
        stiffness counts as infinite.
    force_n_per_input : float or None
        Force of the actuator at rest per unit of input, for an actuator that prescribes a force (a voice coil, a
        weight); None for one that prescribes a motion. With a stiffness, the force decreases by it as the face moves.
    preload_n : float
        Force along `direction` with which the actuator presses on the face at rest, before its input: inputs are
        counted from where the mechanism then is.
    """

    face: Face
    direction: PointMm
    across: Literal["held", "free"]
    per_input: float = 1.0
    turns: Literal["held", "free"] = "held"
    stiffness_n_mm: float | None = None
    force_n_per_input: float | None = None
    preload_n: float = 0.0

    @property
    def is_soft(self) -> bool:
        """Whether the face moves less than the input, because the actuator yields or prescribes a force."""
        return self.stiffness_n_mm is not None or self.force_n_per_input is not None

    @property
    def spring_n_mm(self) -> float:
        """Decrease of the actuator's force per 1 mm of its face, for a soft drive (N/mm)."""
        return self.stiffness_n_mm or 0.0

    @property
    def push_n(self) -> float:
        """Force of a soft drive per unit of input, with its face at rest (N)."""
        return self.spring_n_mm if self.force_n_per_input is None else self.force_n_per_input

    @property
    def words(self) -> str:
        """Sentence on what the driven face may do, and on its actuator."""
        force, stiff = self.force_n_per_input, self.stiffness_n_mm
        actuator = ""
        if force is not None:
            less = "" if stiff is None else f", less {stiff:g} N per mm that it moves"
            actuator = f" A unit of input is a force of {force:g} N on the face{less}."
        elif stiff is not None:
            actuator = f" The input is the actuator's own motion, behind a stiffness of {stiff:g} N/mm."
        if self.preload_n:
            actuator += f" At rest it presses with {self.preload_n:g} N: inputs are counted from there."
        if self.face.is_pin:
            slides = "may slide" if self.across == "free" else "cannot slide"
            x, y = self.face.middle_mm
            return (
                f"The drive {self.face.name} acts at ({x:g}, {y:g}) mm as by a pin of {self.face.box_mm[1] - x:g} mm "
                f"radius: the body there moves in the mean, may turn, and {slides} across the drive "
                f'(across = "{self.across}").{actuator}'
            )
        how = {
            ("free", "free"): "is pushed as by a rod: it moves by the input in the mean, and may slide, turn and bend",
            ("free", "held"): "is pushed as by a flat plate: every point moves by the input, and may slide",
            ("held", "free"): "is moved as by a pin: it moves by the input in the mean, and may turn and bend",
            ("held", "held"): "is clamped to a stage: every point moves by the input, and cannot slide or turn",
        }[self.across, self.turns]
        return f'The driven face {self.face.name} {how} (across = "{self.across}", turns = "{self.turns}").{actuator}'


@dataclass(frozen=True, slots=True)
class Contact:
    """A pair of faces, or a face and a wall, that may touch without friction.

    Parameters
    ----------
    name : str
        Name of the contact in messages and results.
    face : Face
        The first face.
    other : Face or None
        The second face; None for contact with a wall.
    wall_mm : ((float, float), (float, float)) or None
        Two points on a rigid straight wall; None for contact with a second face.
    """

    name: str
    face: Face
    other: Face | None = None
    wall_mm: tuple[PointMm, PointMm] | None = None


@dataclass(frozen=True, slots=True)
class Mechanism:
    """A planar mechanism.

    Parameters
    ----------
    name : str
        Name of the mechanism.
    material : Material
        Material of the plate.
    plate_mm : float
        Thickness of the plate.
    bodies : tuple of (bool, Shape)
        Shapes that are added (true) or removed (false), in order; the flexures are applied after them.
    flexures : tuple of Flexure
        Flexures, each with its own dimensions.
    fixed : tuple of Face
        Faces that do not move.
    slides : tuple of (Face, str)
        Faces on a line of symmetry, each with the component (x or y) that is fixed there.
    drives : tuple of Drive
        The driven faces, one or more; all follow one input.
    probes : dict of str to (float, float)
        Points whose displacements are computed.
    pairs : dict of str to (str, str)
        Pairs of probes whose distance is computed; a gap is a pair.
    contacts : tuple of Contact
        Faces that may touch.
    body_names : tuple of str
        Names of `bodies`, in their order; empty for a shape without one.
    fused : tuple of (str, str, (float, float))
        Leaves that cross and are one piece there: their names, and the place of the crossing.
    layers : tuple of tuple of int
        Numbers of the layers in which each of `bodies` lies; empty for a drawing of one layer. Every layer is as thick
        as the plate, and parts of different layers are joined only by bodies that lie in both.
    notes : tuple of str
        Sentences on how the drawing was read.
    held_bodies : HeldBodies or None
        Restraint of the bodies beside the flexures by their width; None where they bend too little for it to matter.
    mirrored : bool
        Whether bodies, flexures and faces are the right half of a mechanism whose left half is its mirror image in the
        line x = 0. Forces of drives are those of both halves; a probe with x < 0 lies on the left half.
    """

    name: str
    material: Material
    plate_mm: float
    bodies: tuple[tuple[bool, Shape], ...]
    flexures: tuple[Flexure, ...]
    fixed: tuple[Face, ...]
    slides: tuple[tuple[Face, str], ...]
    drives: tuple[Drive, ...]
    probes: dict[str, PointMm]
    pairs: dict[str, tuple[str, str]]
    contacts: tuple[Contact, ...] = ()
    body_names: tuple[str, ...] = ()
    fused: tuple[tuple[str, str, PointMm], ...] = ()
    mirrored: bool = False
    layers: tuple[tuple[int, ...], ...] = ()
    notes: tuple[str, ...] = ()
    held_bodies: HeldBodies | None = None

    @property
    def halves(self) -> float:
        """Number of equal parts of the mechanism of which one is drawn: 2 for a mirrored drawing, else 1."""
        return 2.0 if self.mirrored else 1.0

    @property
    def swaying(self) -> "Mechanism":
        """The half of a mirrored drawing whose other half moves the same way sideways, with its drive not guided.

        Points on the symmetry axis then cannot move along the axis.
        """
        return replace(self, slides=tuple((face, "y") for face, _ in self.slides), drives=())

    @property
    def strips(self) -> tuple[Flexure, ...]:
        """Flexures, strips and notches, that the drawing does not name, but its bodies and cuts leave."""
        return tuple(flexure for flexure in self.flexures if flexure.found)

    @property
    def sharp_ends(self) -> list[str]:
        """Names of the leaves and strips at an end of which the outline has a corner without a radius."""
        corners = np.reshape(sharp_corners_mm(self.region), (-1, 2)).T
        zones = [(flexure, flexure.zone(self.plate_mm)) for flexure in self.flexures if not flexure.is_notch]
        return [flexure.name for flexure, zone in zones if zone.grown(_AT_CORNER).holds(corners).any()]

    @property
    def width_error(self) -> float:
        """Relative uncertainty of the force because the restraint of the flexures by the plate's width is uncertain."""
        doubt = max((flexure.width_doubt(self.plate_mm) for flexure in self.flexures), default=0.0)
        return 2.0 * force_uncertainty(self.material) + self.material.poisson_ratio**2 * doubt

    @property
    def stress_error(self) -> float:
        """Relative uncertainty of the stress, because it varies over the plate's depth: plane models know the mean.

        Where it is largest, the restraint by the width may be absent that makes the von Mises stress smaller.
        """
        held = (
            *(flexure.zone(self.plate_mm).stressed for flexure in self.flexures),
            self.held_bodies.mean if self.held_bodies else 0.0,
        )
        across = self.material.poisson_ratio * max(held)
        return _OVER_DEPTH + 1.0 - sqrt(1.0 - across + across**2)

    @property
    def mode_error(self) -> float:
        """Relative uncertainty of frequencies: modes may load strips and bodies otherwise than the input does."""
        apart = [flexure.width_range(self.plate_mm) for flexure in self.flexures]
        if self.held_bodies is not None:
            apart.append(max(self.held_bodies.mean, 1.0 - self.held_bodies.mean))
        return 0.5 * self.material.poisson_ratio**2 * max(apart, default=0.0)

    @property
    def joints(self) -> tuple[Joint, ...]:
        """Bodies that lie in several layers, each with its layers."""
        each = zip(self.bodies, self.layers, strict=False)
        return tuple((shape, numbers) for (added, shape), numbers in each if added and len(numbers) > 1)

    @property
    def by_layer(self) -> dict[int, PlanarRegion]:
        """The region of every layer, by its number; of a drawing of one layer, the whole."""
        if not self.layers:
            return {1: self.region}
        whole, found = self.region, {}
        for layer in sorted(
            {number for numbers in self.layers for number in numbers} | {f.layer for f in self.flexures}
        ):
            bodies = [step for step, numbers in zip(self.bodies, self.layers, strict=True) if layer in numbers]
            own = [step for flexure in self.flexures if flexure.layer == layer for step in flexure.steps()]
            found[layer] = PlanarRegion((*bodies, *own), whole.marks_mm)
        return found

    @property
    def region(self) -> PlanarRegion:
        """The body: shapes and flexures of all layers, with corners where faces begin and end."""
        steps = (*self.bodies, *(step for flexure in self.flexures for step in flexure.steps()))
        faces = [*self.fixed, *(face for face, _ in self.slides), *(drive.face for drive in self.drives)]
        faces += [face for contact in self.contacts for face in (contact.face, contact.other) if face is not None]
        return PlanarRegion(steps, _ends_of(steps, tuple(face.box_mm for face in faces if not face.is_pin)))


@lru_cache(maxsize=64)
def _ends_of(steps: tuple[tuple[bool, Shape], ...], boxes: tuple[Box, ...]) -> tuple[PointMm, ...]:
    """Points at which faces begin and end: the corners of their boxes, and where their sides cross the shapes.

    A node stands at each of these, so that a face does not depend on where the mesh has its nodes.
    """
    marks = [(x, y) for box_mm in boxes for x in box_mm[:2] for y in box_mm[2:]]
    curves = [curve for _, shape in steps for curve in shape.curves()]
    for x0, x1, y0, y1 in boxes:
        if x0 == x1 or y0 == y1:
            continue
        for side in box(x0, x1, y0, y1).curves():
            points = [curve.at(np.array(crossings(curve, side))) for curve in curves]
            marks += [(float(x), float(y)) for x, y in np.concatenate(points, axis=1).T]
    return tuple(marks)


def check_mechanism(mechanism: Mechanism, region: PlanarRegion) -> None:
    """Refuse a drawing that is not a valid mechanism.

    Raises
    ------
    DataError
        If the drawing is not one body, a flexure contains no material or is not thinnest at its neck, or a probe lies
        outside.
    """
    name = mechanism.name
    size = region.size_mm
    if not SIZES_MM[0] <= size <= SIZES_MM[1]:
        unit = "metres? Multiply every length by 1000" if size < SIZES_MM[0] else "micrometres? Divide them by 1000"
        raise DataError(
            f"{name} must be {SIZES_MM[0]:g} to {SIZES_MM[1]:g} mm large, but its bodies are {size:.3g} mm across; "
            f"are its lengths {unit}."
        )
    by_layer = mechanism.by_layer
    try:
        pieces = pieces_of(by_layer, mechanism.joints)
    except FingervisionError as error:
        raise DataError(f"In {name}: {error}") from error
    if not pieces:
        raise DataError(f"The cuts of {name} must leave something of its bodies, but leave nothing; make them smaller.")
    if len(pieces) != 1:
        joined = "let a body with several in_layers join the layers" if mechanism.layers else "let no cut separate them"
        raise DataError(
            f"The bodies of {name} must form one connected piece, but form {len(pieces)}: "
            f"{_pieces(mechanism, pieces)}; let bodies and flexures overlap, and {joined}."
        )
    numbers = mechanism.layers or ((1,),) * len(mechanism.bodies)
    for flexure in mechanism.flexures:
        t, region = flexure.thickness_mm, by_layer[flexure.layer]
        uncut = PlanarRegion(tuple(b for b, own in zip(mechanism.bodies, numbers, strict=True) if flexure.layer in own))
        inside = np.array([flexure.point_mm(0.0, s * t * 0.49) for s in (-1.0, 0.0, 1.0)]).T
        beside = np.array([flexure.point_mm(0.0, s * (0.5 * t + 1e-3 * t)) for s in (-1.0, 1.0)]).T
        # A flexure that is cut from a body must have had material beside its neck before the cut.
        cuts = flexure.kind == "leaf" or flexure.found or uncut.holds(beside).all()
        if not region.holds(inside).all() or region.holds(beside).any() or not cuts:
            raise DataError(
                f"flexure {flexure.name} of {name} must have a thickness of {t:g} mm at ({flexure.at_mm[0]:g}, "
                f"{flexure.at_mm[1]:g}) mm, but the material there is thinner, thicker or missing; "
                "check its place and axis."
            )
        if flexure.kind == "leaf":
            others = [other for other in mechanism.flexures if other is not flexure and mechanism.fused]
            others = [other for other in others if other.layer == flexure.layer]
            _check_leaf(flexure, region, uncut, others, name)
        elif flexure.is_notch and not flexure.found and any(_is_hole(loop.area_mm2, flexure) for loop in region.loops):
            raise DataError(
                f"The cuts of flexure {flexure.name} of {name} must reach the outer edges of the body, but an "
                f"ellipse of {flexure.half_length_mm:g} by {flexure.depth_mm:g} mm lies wholly inside it, as a closed "
                "hole; enlarge the ellipse, or check its unit."
            )
    for place, flexure in enumerate(mechanism.flexures):
        for other in mechanism.flexures[:place]:
            apart = hypot(flexure.at_mm[0] - other.at_mm[0], flexure.at_mm[1] - other.at_mm[1])
            if flexure.layer == other.layer and apart < 0.5 * (flexure.thickness_mm + other.thickness_mm):
                raise DataError(
                    f"flexures {other.name} and {flexure.name} of {name} must be apart, but overlap; remove "
                    "or move one of them."
                )
    _check_cuts(mechanism, by_layer)
    _check_points(mechanism, mechanism.region, by_layer)


def _check_cuts(mechanism: Mechanism, by_layer: Mapping[int, PlanarRegion]) -> None:
    """Refuse cuts that remove nothing, because they lie beside every body or are filled, and cuts through a neck."""
    each = [*zip(mechanism.bodies, mechanism.layers or ((1,),) * len(mechanism.bodies), strict=True)]
    names = (*mechanism.body_names, *[""] * len(each))
    for place, ((added, shape), own) in enumerate(each):
        if added or any(_removes(each[: place + 1], mechanism.flexures, by_layer[layer], layer) for layer in own):
            continue
        points, corners = points_in(shape), np.array([curve.start_mm for curve in shape.curves()])
        x, y = np.round(0.5 * (corners.min(axis=0) + corners.max(axis=0)), 6) + 0.0
        filling = [(f"flexure {f.name}", tuple(f.steps())) for f in mechanism.flexures]
        filling += [(n or "a later body", (b,)) for (b, _), n in zip(each[place:], names[place:], strict=False) if b[0]]
        why = "touches no body there"
        if filled := [what for what, steps in filling if PlanarRegion(steps).holds(points).any()]:
            why = f"is filled by {filled[0]}, which is added after it"
        raise DataError(
            f"The cut {names[place] or place + 1} of {mechanism.name} must remove a part of a body, but at ({x:.4g}, "
            f"{y:.4g}) mm it {why}; move the cut, or leave it out."
        )


def _removes(
    steps: Sequence[tuple[tuple[bool, Shape], tuple[int, ...]]], flexures: Sequence[Flexure], region: PlanarRegion,
    layer: int,
) -> bool:  # fmt: skip
    """Whether the last of some steps, a cut, removes a part of the bodies before it that no later step fills.

    Other cuts are left out, because a cut inside another does no harm.
    """
    (_, cut), _ = steps[-1]
    bodies = [body for body, own in steps if body[0] and layer in own]
    points = points_in(cut)
    if (PlanarRegion(tuple(bodies)).holds(points) & ~region.holds(points)).any():
        return True
    leaves = [step for flexure in flexures if flexure.layer == layer for step in flexure.steps() if step[0]]
    sides = [(*curve.origin, *curve.u) for curve in cut.curves()]
    alone = PlanarRegion((*bodies, (False, cut), *leaves))
    return any((*curve.origin, *curve.u) in sides for loop in alone.loops for curve in loop.curves)


def _check_points(mechanism: Mechanism, region: PlanarRegion, by_layer: Mapping[int, PlanarRegion]) -> None:
    """Check that probes and pins lie on the body, in layers that are joined there, and that faces are finite."""
    name, size = mechanism.name, region.size_mm
    for probe, (x, y) in mechanism.probes.items():
        x = abs(x) if mechanism.mirrored else x
        ring = np.array([[x + 1e-6 * size * dx, y + 1e-6 * size * dy] for dx in (-1, 0, 1) for dy in (-1, 0, 1)]).T
        if not region.holds(ring).any():
            raise DataError(f"probe {probe} of {name} must lie on the body, but ({x:g}, {y:g}) mm is outside it.")
        layers = [layer for layer, own in by_layer.items() if own.holds(ring).any()]
        joined = any(set(layers) <= set(numbers) and shape.holds(ring).any() for shape, numbers in mechanism.joints)
        if len(layers) > 1 and not joined:
            raise DataError(
                f"probe {probe} of {name} must lie on one body, but at ({x:g}, {y:g}) mm parts of the layers "
                f"{', '.join(map(str, layers))} lie over each other."
            )
    for drive in mechanism.drives:
        x, y = drive.face.middle_mm
        near = 1e-6 * size * np.array([[0, 1, -1, 0, 0], [0, 0, 0, 1, -1]])
        if drive.face.is_pin and not region.holds(np.array([[x], [y]]) + near).any():
            raise DataError(f"pin {drive.face.name} of {name} must lie on the body, but ({x:g}, {y:g}) mm is outside.")
    for flexure in mechanism.flexures:
        own = by_layer[flexure.layer]
        along = np.repeat(_BETWEEN_ROOTS * flexure.half_length_mm * np.linspace(-1.0, 1.0, 33), 2)
        above = np.tile([-0.5, 0.5], 33) * flexure.height_mm(along)
        surface, beside = (np.stack(flexure.section_mm(along, s * above)) for s in (1.0, 1.0 + 1e-2))
        surface = surface[:, ~own.holds(beside)]
        for face in mechanism.fixed:
            if (held := surface[:, face.holds(surface, 0.0)]).size:
                x, y = held[:, held.shape[1] // 2]
                raise DataError(
                    f"fixed face {face.name} of {name} must end where the bodies do, but its box holds flexure "
                    f"{flexure.name} at ({x:.4g}, {y:.4g}) mm too; make the box smaller."
                )
    for face in (*mechanism.fixed, *(drive.face for drive in mechanism.drives)):
        if hypot(*face.box_mm) > 1e6:
            raise DataError(f"face {face.name} of {name} must have a box_mm with finite limits.")


def _pieces(mechanism: Mechanism, pieces: Sequence[Sequence[Sheet]]) -> str:
    """Where each piece of a drawing lies, and the names of the bodies in it."""
    found = []
    names = [*mechanism.body_names, *[""] * len(mechanism.bodies)]
    layers = mechanism.layers or ((1,),) * len(mechanism.bodies)
    for piece in pieces[:_MOST_NAMED]:
        curves, own = piece[0].part.outline.curves, [sheet.layer for sheet in piece]
        points = np.concatenate([curve.at(np.array([curve.t0, curve.t1])) for curve in curves], axis=1)
        (x0, y0), (x1, y1) = points.min(axis=1), points.max(axis=1)
        inside = dict.fromkeys(
            name
            for (added, shape), name, at in zip(mechanism.bodies, names, layers, strict=False)
            if added and name and not set(at).isdisjoint(own) and shape.holds(points).any()
        )
        where = f" in layer {' and '.join(map(str, own))}" if mechanism.layers else ""
        of = f" ({', '.join(inside)})" if inside else ""
        found.append(f"one{where} at x {x0:.4g} to {x1:.4g}, y {y0:.4g} to {y1:.4g} mm{of}")
    return ", ".join(found) + (", ..." if len(pieces) > _MOST_NAMED else "")


def _is_hole(area_mm2: float, flexure: Flexure) -> bool:
    """Whether a hole in the outline is one complete cut of a flexure."""
    cut_mm2 = pi * flexure.half_length_mm * flexure.depth_mm
    return area_mm2 < 0.0 and abs(area_mm2 + cut_mm2) < _SAME_AREA * cut_mm2


def _check_leaf(
    flexure: Flexure, region: PlanarRegion, uncut: PlanarRegion, others: Sequence[Flexure], name: str
) -> None:
    """Check that a leaf's free length exceeds its thickness, and that both its ends lie inside bodies."""
    t, reach = flexure.thickness_mm, flexure.half_length_mm
    beside = np.array([flexure.point_mm(x * t, s * 0.501 * t) for x in (-0.5, 0.5) for s in (-1.0, 1.0)]).T
    if region.holds(beside).any():
        raise DataError(
            f"flexure {flexure.name} of {name} must have a free length greater than its thickness of {t:g} "
            "mm, but is not; check its length and whether all lengths are millimetres."
        )
    ends = np.array([flexure.point_mm(s * reach * (1.0 + 1e-6), 0.0) for s in (-1.0, 1.0)]).T
    leaves = PlanarRegion(tuple(step for other in others if other.kind == "leaf" for step in other.steps()))
    inside = uncut.holds(ends) | leaves.holds(ends)
    if not inside.all():
        x, y = ends[:, int(np.argmin(inside))]
        raise DataError(
            f"flexure {flexure.name} of {name} must end inside a body at both ends, but at ({x:.5g}, {y:.5g}) mm it "
            "ends outside; check its half_length_mm."
        )
