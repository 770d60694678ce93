"""Change one dimension of a drawing, and adapt the dependent dimensions so that the links still meet."""

from dataclasses import replace
from typing import Any

from fingervision.domain.errors import DataError
from fingervision.domain.gripper import Gripper, Lever, Links, PointMm


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
