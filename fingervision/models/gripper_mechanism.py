"""The gripper as a general planar mechanism: one half with its symmetry, or both halves with their own dimensions."""

from dataclasses import replace
from math import atan2, cos, degrees, hypot, radians, sin
from typing import Any, NamedTuple

import numpy as np

from fingervision.domain.errors import DataError, FingervisionError
from fingervision.domain.gripper import Gripper, Lever, Links, PointMm
from fingervision.models.flexure import Flexure
from fingervision.models.mechanism import Contact, Drive, Face, Mechanism
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.plane_shapes import Polygon, Shape, bar, box

_FAR = 3.0
"""Extent of the wall on the symmetry axis, as a multiple of the largest coordinate of the body."""


def half_mechanism(gripper: Gripper, name: str = "gripper") -> Mechanism:
    """Describe a gripper of two equal halves by its right half, which slides along the symmetry axis.

    Both tips may touch that axis.
    """
    x0, x1, low, high = _drive_box(gripper)
    top, y = gripper.links.drive_block_mm[3], gripper.measuring_point_mm[1]
    reach = _FAR * max(abs(gripper.body.width_mm), gripper.body.height_mm)
    face = (gripper.tip_corner_mm[0],) * 2 + (gripper.tip_heel_mm[1], gripper.tip_corner_mm[1])
    return Mechanism(
        name=name,
        material=gripper.material,
        plate_mm=gripper.body.plate_mm,
        bodies=tuple((True, shape) for shape in _bodies(gripper, 1.0)),
        body_names=body_names("right"),
        flexures=_flexures(gripper, 1.0, ""),
        fixed=(_foot(gripper, 1.0, "clamp"),),
        slides=((Face("symmetry axis", (0.0, 0.0, low, top)), "x"),),
        drives=(Drive(Face("drive", (max(x0, 0.0), x1, low, high)), (0.0, 1.0), "free"),),
        probes={"left tip": (-gripper.measuring_point_mm[0], y), "right tip": (gripper.measuring_point_mm[0], y)},
        pairs={"gap": ("left tip", "right tip")},
        contacts=(Contact("tip", Face("tip", face), None, ((0.0, -reach), (0.0, reach))),),
        mirrored=True,
    )


def whole_mechanism(left: Gripper, right: Gripper, name: str) -> Mechanism:
    """Describe both halves as one mechanism; the left half is mirrored, the actuator guides the drive.

    Parameters
    ----------
    left, right : Gripper
        Drawings that share the drive block, the material and the plate.
    name : str
        Name of the mechanism.
    """
    x0, x1, low, high = _drive_box(right)
    halves = ((left, -1.0, "left "), (right, 1.0, "right "))
    bodies: list[tuple[bool, Shape]] = []
    flexures: list[Flexure] = []
    probes: dict[str, PointMm] = {}
    faces = []
    for gripper, side, prefix in halves:
        bodies += [(True, shape) for shape in _bodies(gripper, side)]
        flexures += _flexures(gripper, side, prefix)
        x, y = gripper.measuring_point_mm
        probes[f"{prefix}tip"] = (side * x, y)
        heel, corner = gripper.tip_heel_mm, gripper.tip_corner_mm
        faces.append(Face(f"{prefix}tip", (side * corner[0], side * corner[0], heel[1], corner[1])))
    return Mechanism(
        name=name,
        material=right.material,
        plate_mm=right.body.plate_mm,
        bodies=tuple(bodies),
        body_names=(*body_names("left"), *body_names("right")),
        flexures=tuple(flexures),
        fixed=(_foot(left, -1.0, "left clamp"), _foot(right, 1.0, "right clamp")),
        slides=(),
        drives=(Drive(Face("drive", (x0, x1, low, high)), (0.0, 1.0), "held"),),
        probes=probes,
        pairs={"gap": ("left tip", "right tip")},
        contacts=(Contact("tips", faces[0], faces[1]),),
    )


def body_names(side: str) -> tuple[str, ...]:
    """Names of the bodies to which the shapes of one half belong, in order."""
    finger = f"{side}_finger"
    return f"{side}_pillar", "drive", "drive", finger, finger, finger


def _drive_box(gripper: Gripper) -> tuple[float, float, float, float]:
    half = min(gripper.lever.drive_face_half_width_mm, gripper.links.drive_block_mm[1])
    return -half, half, gripper.lever.drive_face_y_mm, gripper.lever.drive_face_y_mm


def _foot(gripper: Gripper, side: float, name: str) -> Face:
    x0, x1, y, _ = gripper.links.pillar_and_root_mm
    return Face(name, (min(side * x0, side * x1), max(side * x0, side * x1), y, y))


def _bodies(gripper: Gripper, side: float) -> list[Polygon]:
    """Bars and polygons of one half, clipped at the symmetry axis; those of the left half are mirror images."""
    links = gripper.links
    shapes = (
        box(*links.pillar_and_root_mm),
        bar(*links.shuttle_from_mm, *links.shuttle_to_mm, links.shuttle_width_mm),
        box(*links.drive_block_mm),
        bar(*links.cross_bar_mm, links.cross_bar_width_mm),
        bar(*links.finger_mm, links.finger_width_mm),
        Polygon(links.tip_polygon_mm),
    )
    clipped = (right_of_axis(shape.corners_mm) for shape in shapes)
    return [Polygon(tuple((side * x, y) for x, y in corners)) for corners in clipped]


def right_of_axis(corners: tuple[PointMm, ...]) -> tuple[PointMm, ...]:
    """Clip a polygon to x >= 0 (Sutherland and Hodgman, Communications of the ACM 17 (1974) 32)."""
    kept: list[PointMm] = []
    for (xa, ya), (xb, yb) in zip(corners, corners[1:] + corners[:1], strict=True):
        if xa >= 0.0:
            kept.append((xa, ya))
        if (xa < 0.0) != (xb < 0.0):
            kept.append((0.0, ya + (yb - ya) * xa / (xa - xb)))
    return tuple(point for i, point in enumerate(kept) if hypot(point[0] - kept[i - 1][0], point[1] - kept[i - 1][1]))


def _flexures(gripper: Gripper, side: float, prefix: str) -> tuple[Flexure, ...]:
    hinge = gripper.hinge
    return tuple(
        Flexure(f"{prefix}hinge {number}", "circular", (side * x, y), axis_deg if side > 0.0 else 180.0 - axis_deg,
                hinge.thickness_mm, hinge.radius_mm, hinge.radius_mm)
        for number, ((x, y), axis_deg) in enumerate(gripper.lever.hinges, 1)
    )  # fmt: skip


# Outline of a gripper's right half, and the geometric conditions that this outline must satisfy.
#
# One half of the gripper is the union of its bars and polygons, minus four notch discs, minus everything left of the
# symmetry axis.

_ON = 1e-6
"""Distance on either side of a face at which material and void are tested, as a share of the gripper's height."""
_SLIT = 0.05
"""Width, as a share of the neck, of the slit cut through a neck to test whether the body then falls into two parts."""
_ASKEW_DEG = 15.0
"""Largest angle between a notch and its link: a notch at a larger angle is not a hinge of the link; its neck is then 4
% longer than its height."""
_STATED = 0.05
"""Largest relative difference between the stated width and height and those drawn. The stated values are used in no
computation."""


def notch_centres_mm(gripper: Gripper) -> tuple[PointMm, ...]:
    """Centres of the four discs that cut the two hinges: radius + thickness / 2 on either side of each hinge's axis."""
    hinge = gripper.hinge
    offset_mm = hinge.radius_mm + hinge.thickness_mm / 2.0
    centres: list[PointMm] = []
    for (x_mm, y_mm), axis_deg in gripper.lever.hinges:
        across = (-sin(radians(axis_deg)), cos(radians(axis_deg)))
        centres += [(x_mm + side * offset_mm * across[0], y_mm + side * offset_mm * across[1]) for side in (-1, 1)]
    return tuple(centres)


def half_region(gripper: Gripper) -> PlanarRegion:
    """The right half as a sequence of shapes added and removed; its outline is computed once per drawing."""
    return half_mechanism(gripper).region


def check_outline(gripper: Gripper, origin: str = "the drawing") -> None:
    """Refuse a drawing whose outline is not that of a gripper with two hinges.

    Raises
    ------
    DataError
        If the half is not one body, a notch is a closed hole, a hinge does not connect the parts on its two sides or is
        not their only connection, or the clamp, the drive face or the tip's inner face is not a face of the body.
    """
    region = half_region(gripper)
    try:
        outer = sum(loop.area_mm2 > 0.0 for loop in region.loops)
    except FingervisionError as error:
        raise DataError(f"In {origin}: {error}") from error
    if outer != 1:
        raise DataError(
            f"The right half in {origin} must be one body, but the links and notches leave {outer} pieces; "
            "check that the links overlap and that no notch cuts through one of them."
        )
    apart, links = _ON * gripper.body.height_mm, gripper.links
    x0, x1, y0, _ = links.pillar_and_root_mm
    (xa, ya), (xb, yb) = links.shuttle_from_mm, links.shuttle_to_mm
    from_clamp = _HingeEnd("clamp", (0.5 * (x0 + x1), y0 + apart), 90.0)
    from_drive = _HingeEnd("drive", (apart, gripper.lever.drive_mm[1]), degrees(atan2(yb - ya, xb - xa)))
    for number, end in enumerate((from_clamp, from_drive), 1):
        _check_hinge(gripper, region, number, end, origin)
    _check_faces(gripper, region, origin)


class _HingeEnd(NamedTuple):
    """What a hinge joins to the tip: its name, a point on it, and the direction of the hinge's link."""

    name: str
    point_mm: PointMm
    link_deg: float


def _check_hinge(gripper: Gripper, region: PlanarRegion, number: int, end: _HingeEnd, origin: str) -> None:
    hinge, link_deg = gripper.hinge, end.link_deg
    (x, y), axis_deg = gripper.lever.hinges[number - 1]
    askew_deg = abs((axis_deg - link_deg + 90.0) % 180.0 - 90.0)
    if askew_deg > _ASKEW_DEG:
        raise DataError(
            f"lever.hinge{number}_axis_deg in {origin} must be within {_ASKEW_DEG:g} degrees of the direction of "
            f"its link, {link_deg:.4g} degrees, but is {axis_deg:g}."
        )
    if not region.holds(np.array([[x], [y]]))[0]:
        raise DataError(
            f"lever.hinge{number}_mm in {origin} must lie inside its link, but there is no material at "
            f"({x:g}, {y:g}) mm; check its place and its axis."
        )
    centres = notch_centres_mm(gripper)[2 * number - 2 : 2 * number]
    for centre in centres:
        for loop in region.loops:
            ends = [curve.origin for curve in loop.curves if not curve.is_straight]
            if loop.area_mm2 < 0.0 and len(ends) == len(loop.curves) and np.allclose(ends, centre):
                raise DataError(
                    f"The notches of hinge {number} in {origin} must open through the faces of its link, but the disc "
                    f"of hinge.radius_mm = {hinge.radius_mm:g} about ({centre[0]:.4g}, {centre[1]:.4g}) mm is a closed "
                    "hole inside it; make hinge.radius_mm larger or the link narrower."
                )
    # Cut through the neck from disc to disc: the half must then separate into two parts.
    (xa, ya), (xb, yb) = centres
    saw = bar(xa, ya, xb, yb, _SLIT * hinge.thickness_mm)
    pieces = [loop for loop in PlanarRegion((*region.steps, (False, saw))).loops if loop.area_mm2 > 0.0]
    tip = (gripper.tip_corner_mm[0] + _ON * gripper.body.height_mm, gripper.measuring_point_mm[1])
    parted = any(piece.holds(np.array([end.point_mm, tip]).T).tolist() == [True, False] for piece in pieces)
    if len(pieces) != 2 or not parted:
        raise DataError(
            f"Hinge {number} in {origin} must be the only connection from the {end.name} to the tip, but other "
            f"material beside the neck of {hinge.thickness_mm:g} mm at ({x:g}, {y:g}) mm connects them too; check "
            f"lever.hinge{number}_mm, lever.hinge{number}_axis_deg and hinge.radius_mm against the link that it cuts."
        )


def _check_faces(gripper: Gripper, region: PlanarRegion, origin: str) -> None:
    x0, x1, y0, _ = gripper.links.pillar_and_root_mm
    lever = gripper.lever
    half = min(lever.drive_face_half_width_mm, gripper.links.drive_block_mm[1])
    inner_mm = gripper.tip_corner_mm[0]
    tip_y = gripper.measuring_point_mm[1]
    apart = _ON * gripper.body.height_mm
    for name, (x, y), (nx, ny) in (
        ("lower face of the pillar (links.pillar_and_root_mm)", (0.5 * (x0 + x1), y0), (0.0, 1.0)),
        ("drive face (lever.drive_face_y_mm)", (0.5 * half, lever.drive_face_y_mm), (0.0, 1.0)),
        ("tip's inner face at the measuring height (body.measured_below_tip_mm)", (inner_mm, tip_y), (1.0, 0.0)),
    ):
        beside = np.array([[x + apart * nx, x - apart * nx], [y + apart * ny, y - apart * ny]])
        if region.holds(beside).tolist() != [True, False]:
            raise DataError(
                f"The {name} in {origin} must be a free face of the body, but at ({x:.5g}, {y:.5g}) mm there is none; "
                "check the links."
            )
    if not region.holds(np.array([[apart], [lever.drive_mm[1]]]))[0]:
        raise DataError(
            f"lever.drive_mm in {origin} must lie in the drive block on the symmetry axis, but there is no material at "
            f"(0, {lever.drive_mm[1]:g}) mm; check links.drive_block_mm."
        )


def check_stated_size(gripper: Gripper, origin: str) -> None:
    """Refuse a drawing whose stated width or height differs from that of its links."""
    region = half_region(gripper)
    points = np.concatenate([c.at(np.linspace(c.t0, c.t1, 9)) for loop in region.loops for c in loop.curves], axis=1)
    body = gripper.body
    drawn = {
        "width_mm": 2.0 * float(points[0].max()),
        "height_mm": float(points[1].max()) - gripper.links.pillar_and_root_mm[2],
    }
    for name, value in drawn.items():
        stated = getattr(body, name)
        if abs(stated - value) > _STATED * value:
            raise DataError(
                f"body.{name} in {origin} must agree within {100.0 * _STATED:g} % with the dimensions of the links, "
                f"which give {value:.6g} mm, but is {stated:g}; correct one of the two."
            )


# Change one dimension of a drawing, and adapt the dependent dimensions so that the links still meet.


def redrawn(gripper: Gripper, name: str, by: float) -> Gripper:
    """Change one dimension of a drawing, with its dependent dimensions.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    name : str
        Dotted name as in `gripper.toml`, such as `hinge.thickness_mm`. A longer `lever.l1_mm` or `lever.l2_mm` moves
        hinge 1 with its pillar; `lever.l3_mm` the drive; `lever.l4_mm` both hinges with their links; `body.rest_gap_mm`
        the tips.
    by : float
        Change in the dimension's own unit.

    Raises
    ------
    DataError
        If the name is not that of a dimension.
    """
    section, _, key = name.partition(".")
    record: Any = getattr(gripper, section, None)
    old = getattr(record, key, None)
    if not isinstance(old, float):
        raise DataError(f"A dimension of the drawing must have its name in gripper.toml, but is named {name}.")
    parts: dict[str, Any] = {section: replace(record, **{key: old + by})}
    changed = replace(gripper, **parts)
    lever, links = changed.lever, changed.links
    match name:
        case "lever.l1_mm":
            return replace(changed, lever=_hinge1_moved(lever, 0.0, by))
        case "lever.l2_mm":
            return replace(changed, lever=_hinge1_moved(lever, by, 0.0), links=_pillar_moved(links, by))
        case "lever.l3_mm":
            x0, x1, y0, y1 = links.drive_block_mm
            block = (x0, x1, y0 - by, y1 - by)
            return replace(
                changed,
                lever=replace(
                    lever, drive_mm=_moved(lever.drive_mm, 0.0, -by), drive_face_y_mm=lever.drive_face_y_mm - by
                ),
                links=replace(links, shuttle_from_mm=_moved(links.shuttle_from_mm, 0.0, -by), drive_block_mm=block),
            )
        case "lever.l4_mm":
            lever = replace(_hinge1_moved(lever, by, 0.0), hinge2_mm=_moved(lever.hinge2_mm, by, 0.0))
            links = replace(_pillar_moved(links, by), shuttle_to_mm=_moved(links.shuttle_to_mm, by, 0.0))
            return replace(changed, lever=lever, links=links)
        case "body.rest_gap_mm":
            tip = tuple(_moved(corner, 0.5 * by, 0.0) for corner in links.tip_polygon_mm)
            return replace(changed, links=replace(links, tip_polygon_mm=tip))
        case _:
            return changed


def _moved(point: PointMm, x_mm: float, y_mm: float) -> PointMm:
    return point[0] + x_mm, point[1] + y_mm


def _hinge1_moved(lever: Lever, x_mm: float, y_mm: float) -> Lever:
    return replace(lever, hinge1_mm=_moved(lever.hinge1_mm, x_mm, y_mm))


def _pillar_moved(links: Links, x_mm: float) -> Links:
    x0, x1, y0, y1 = links.pillar_and_root_mm
    a, b, c, d = links.cross_bar_mm
    return replace(links, pillar_and_root_mm=(x0 + x_mm, x1 + x_mm, y0, y1), cross_bar_mm=(a + x_mm, b, c, d))
