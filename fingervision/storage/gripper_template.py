"""A gripper.toml as template of a mechanism: both halves of the gripper, each with its own deviations."""

from collections.abc import Mapping
from dataclasses import replace
from operator import attrgetter
from pathlib import Path
from typing import Any

from fingervision.domain.errors import DataError
from fingervision.domain.gripper import Gripper
from fingervision.models.gripper_mechanism import check_outline, redrawn, whole_mechanism
from fingervision.models.mechanism import Mechanism, check_mechanism
from fingervision.storage.gripper_toml import read_gripper
from fingervision.storage.toml_section import Section

_TOP = ("schema", "name", "gripper")
_TABLE = ("file", "left", "right")
_HINGES = ("hinge1", "hinge2")
_OF_HINGE = ("thickness_mm", "radius_mm")
_SHARED = ("body.plate_mm", "material", "lever.l3_mm", "lever.drive")


def mechanism_from_gripper(tables: Mapping[str, Any], path: Path) -> Mechanism:
    """Build a mechanism from a [gripper] section that names a gripper.toml and deviations of the left and right half.

    Keys of [gripper.left] and [gripper.right] are dotted names as in gripper.toml (`"lever.l2_mm"`), or hinge1 and
    hinge2 with thickness_mm or radius_mm; the function `redrawn` determines which dependent dimensions change with a
    number.

    Raises
    ------
    DataError, InputFileError
        A key is unknown, a value is not a number, or the drawing is not a valid mechanism.
    """
    origin = str(path)
    top = Section(path, "", "", tables, names={})
    top.only(_TOP)
    table = top.table("gripper")
    table.only(_TABLE)
    gripper = read_gripper(path.parent / table.word("file"))
    halves, hinges = [], {}
    for side in ("left", "right"):
        half_table = table.table(side)
        changes = replace(half_table, values=_flat(half_table.values))
        half = gripper
        for key in changes.values:
            what = f"gripper.{side}.{key}"
            value = changes.number(key, above=0.0)
            section, _, name = key.partition(".")
            if section in _HINGES:
                if name not in _OF_HINGE:
                    raise DataError(f"{what} in {origin} must be one of {' and '.join(_OF_HINGE)} of a hinge.")
                hinges[f"{side} hinge {section[-1]}", name] = value
                continue
            half = _changed(half, key, value, what, origin)
        halves.append(half)
    left, right = halves
    mechanism = whole_mechanism(left, right, str(tables.get("name", path.stem)))
    flexures = []
    for flexure in mechanism.flexures:
        t = hinges.get((flexure.name, "thickness_mm"), flexure.thickness_mm)
        r = hinges.get((flexure.name, "radius_mm"), flexure.half_length_mm)
        flexures.append(replace(flexure, thickness_mm=t, half_length_mm=r, depth_mm=r))
    mechanism = replace(mechanism, flexures=tuple(flexures))
    check_mechanism(mechanism, mechanism.region)
    return mechanism


def _flat(table: Mapping[str, Any]) -> dict[str, Any]:
    """Map dotted names to values, whether they are written in quotes or as tables."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, dict):
            found |= {f"{key}.{inner}": deep for inner, deep in value.items()}
        else:
            found[key] = value
    return found


def _changed(half: Gripper, key: str, value: float, what: str, origin: str) -> Gripper:
    if key.startswith(_SHARED):
        raise DataError(f"{what} in {origin} must be the same in both halves; change it in the gripper.toml.")
    try:
        now = attrgetter(key)(half)
    except AttributeError:
        now = None
    if not isinstance(now, float):
        raise DataError(
            f"{what} in {origin} must name a number as gripper.toml does, such as lever.l2_mm or "
            "hinge1.thickness_mm, but does not."
        )
    changed = redrawn(half, key, value - now)
    check_outline(changed, f"{what} of {origin}")
    return changed
