"""The gripper as a general planar mechanism: one half with its symmetry, or both halves with their own dimensions."""

from math import hypot

from fingervision.domain.gripper import Gripper, PointMm
from fingervision.models.flexure import Flexure
from fingervision.models.mechanism import Contact, Drive, Face, Mechanism
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
    hinge, lever = gripper.hinge, gripper.lever
    places = ((lever.hinge1_mm, lever.hinge1_axis_deg), (lever.hinge2_mm, lever.hinge2_axis_deg))
    return tuple(
        Flexure(f"{prefix}hinge {number}", "circular", (side * x, y), axis_deg if side > 0.0 else 180.0 - axis_deg,
                hinge.thickness_mm, hinge.radius_mm, hinge.radius_mm)
        for number, ((x, y), axis_deg) in enumerate(places, 1)
    )  # fmt: skip
