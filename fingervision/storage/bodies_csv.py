"""The files bodies.csv (poses of a mechanism's bodies in every frame) and flexures.csv (flexures at rest).

The same quantities can also be added to gaps.csv as columns.
"""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

from fingervision.domain.body_poses import OK, FlexureOutline, FramePoses, SeenPose
from fingervision.domain.errors import DataError
from fingervision.storage.durable import replaced
from fingervision.storage.row_file import cell, write_table

COLUMNS = (
    "frame", "time_s", "body", "status", "x_mm", "y_mm", "angle_mrad", "u_x_mm", "u_y_mm", "u_angle_mrad",
    "cov_x_y_mm2", "cov_x_angle_mm_mrad", "cov_y_angle_mm_mrad", "u_random_x_mm", "u_random_y_mm",
    "u_random_angle_mrad", "u_motion_x_mm", "u_motion_y_mm", "u_motion_angle_mrad",
)  # fmt: skip
"""Columns; each row is one body or hinge in one frame, and a hinge has only an angle. The uncertainties `u_` and
covariances `cov_` contain all known contributions (including alignment of the drawing and calibration), `u_random_`
only the part that differs from frame to frame, and `u_motion_` those of the motion since the body's first pose."""
PARTS = ("x_mm", "y_mm", "angle_mrad")


def write_bodies(path: Path, poses: Sequence[FramePoses]) -> None:
    """Write bodies.csv; empty cells represent missing values."""
    rows = [
        [frame.frame, frame.time_s, body, pose.status, *_values(pose)]
        for frame in poses
        for body, pose in frame.poses.items()
    ]
    write_table(path, COLUMNS, rows)


def _values(pose: SeenPose) -> list[float | None]:
    values = [pose.x_mm, pose.y_mm, pose.angle_mrad]
    shared: list[float | None] = [None, None, None]
    if pose.covariance is not None and pose.x_mm is not None:
        shared = [float(pose.covariance[a, b]) for a, b in ((0, 1), (0, 2), (1, 2))]
    u, random, motion = (
        [
            None if covariance is None or value is None else float(covariance[k, k]) ** 0.5
            for k, value in enumerate(values)
        ]
        for covariance in (pose.covariance, pose.random, pose.motion)
    )
    return [*values, *u, *shared, *random, *motion]


def add_channels(gaps: Path, poses: Sequence[FramePoses], names: Mapping[str, str]) -> None:
    """Add the poses in every frame to the frame's row of gaps.csv, as channels for `compare` and `diagnose`.

    Parameters
    ----------
    gaps : Path
        The file gaps.csv of the same recording.
    poses : sequence of FramePoses
        Poses in every frame.
    names : mapping of str to str
        Names of the bodies and hinges that become channels, with the names of their columns.

    Raises
    ------
    DataError
        The table belongs to another recording.
    """
    with gaps.open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    header, body = rows[0], rows[1:]
    at = header.index("frame")
    seen = {frame.frame: frame.poses for frame in poses}
    if missing := [row[at] for row in body if int(row[at]) not in seen]:
        raise DataError(
            f"{gaps} must belong to the same recording as the poses, but for its frame {missing[0]} there are no poses."
        )
    first = next(iter(seen.values()), {})
    wanted = [(name, part) for name in names for part in PARTS if name in first and _has(seen.values(), name, part)]
    prefixes = ("", "u_", "u_random_")
    header = [*header, *(f"{prefix}{names[name]}.{part}" for prefix in prefixes for name, part in wanted)]
    lines = []
    for row in body:
        own = seen[int(row[at])]
        cells = {name: dict(zip(PARTS, _pairs(own[name]), strict=True)) for name in names if name in own}
        lines.append([*row, *(cells[name][part][k] for k in range(len(prefixes)) for name, part in wanted)])
    with replaced(gaps) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(lines)


def _pairs(pose: SeenPose) -> list[tuple[str, ...]]:
    cells = [cell(value, None) for value in _values(pose)]
    return [tuple(cells[at + k] if pose.status == OK else "" for at in (0, 3, 9)) for k in range(3)]


def _has(frames: object, name: str, part: str) -> bool:
    return any(getattr(poses[name], part) is not None for poses in frames)  # type: ignore[attr-defined]


# The file flexures.csv: thickness and place of a mechanism's flexures at rest.

FLEXURES = "flexures.csv"
FLEXURE_COLUMNS = (
    "flexure",
    "frames",
    "thickness_mm",
    "u_thickness_mm",
    "along_mm",
    "u_along_mm",
    "across_mm",
    "u_across_mm",
)


def write_flexures(path: Path, outlines: Sequence[FlexureOutline]) -> None:
    """Write flexures.csv; an empty cell represents a missing value."""
    rows = []
    for one in outlines:
        pairs = (one.thickness_mm, one.along_mm or ("", ""), one.across_mm)
        cells = [f"{value:.6f}" if value != "" else "" for pair in pairs for value in pair]
        rows.append([one.flexure, one.frames, *cells])
    write_table(path, FLEXURE_COLUMNS, rows)


def flexures_beside(table: Path) -> dict[str, FlexureOutline]:
    """Read the flexures.csv beside a measured table, by the flexure's name; empty if there is none.

    Raises
    ------
    DataError
        The file is not a flexures.csv.
    """
    path = table.parent / FLEXURES
    if not path.is_file():
        return {}
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return {row["flexure"]: _outline(row) for row in csv.DictReader(file)}
    except (KeyError, TypeError, ValueError, UnicodeDecodeError) as error:
        raise DataError(
            f"{path} must have the columns {','.join(FLEXURE_COLUMNS)} with numbers, but has not: measure the "
            "recording again, or remove the file."
        ) from error


def _outline(row: dict[str, str]) -> FlexureOutline:
    def pair(name: str) -> tuple[float, float]:
        return float(row[f"{name}_mm"]), float(row[f"u_{name}_mm"])

    along = pair("along") if row["along_mm"] else None
    return FlexureOutline(row["flexure"], int(row["frames"]), pair("thickness"), along, pair("across"))
