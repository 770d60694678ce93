"""The file gripper.toml: the drawing of a gripper, as it is and as template of a mechanism of both halves."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from operator import attrgetter
from pathlib import Path
from types import MappingProxyType
from typing import Any

from fingervision.domain.errors import DataError
from fingervision.domain.gripper import Gripper, Material, SNLine
from fingervision.models.gripper_mechanism import check_outline, check_stated_size, redrawn, whole_mechanism
from fingervision.models.mechanism import Mechanism, check_mechanism
from fingervision.models.plane_shapes import Polygon, crosses_itself
from fingervision.storage.toml_section import DRAWINGS, Section, read_document, refuse_other_file

_STATED = 1.05
"""Largest ratio of a stated width to the width that follows from the drawing."""
_MEET_MM = 0.02
_METRES_BELOW_MM = 2.0
_LEAST_YIELD_STRAIN, _MOST_YIELD_STRAIN = 1e-4, 0.1
"""Plausible range of the yield strain: lead yields at 5e-4, rubber-like polymers at about 0.1; a value outside this
range indicates a modulus in another unit."""
_DERIVED = "uncertainties"
"""Field of a gripper that is no section of the file."""


@dataclass(frozen=True, slots=True)
class _WithMaterial:
    material: Material


def read_gripper(path: Path) -> Gripper:
    """Read and check the drawing of a gripper.

    A number may be written with its standard uncertainty: `thickness_mm = {value = 1.0, u = 0.1}`.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read, a key is missing or unknown, a value is not a number, or the drawing is not a valid
        gripper.
    """
    tables, _ = read_document(path, "drawing")
    refuse_other_file(path, tables, "the drawing of a gripper or mechanism", DRAWINGS)
    return gripper_from_tables(tables, str(path))


def gripper_from_tables(tables: Mapping[str, Any], origin: str) -> Gripper:
    """Build and check a gripper from the five tables of `gripper.toml`; errors name the file `origin`."""
    uncertainties: dict[str, float] = {}
    top = Section(Path(origin), "", "", tables, uncertainties=uncertainties)
    if _DERIVED in tables:
        top.refuse(_DERIVED, "is not known: state an uncertainty beside its number.")
    gripper = replace(top.record(Gripper), uncertainties=MappingProxyType(uncertainties))
    _check(gripper, origin)
    check_outline(gripper, origin)
    check_stated_size(gripper, origin)
    return gripper


def _check_line(line: SNLine, yield_mpa: float, origin: str) -> None:
    """Refuse an S-N line that does not fall, or whose peak stress (amplitude and mean) reaches the yield stress."""
    cycles, amplitude = line.cycles, line.amplitude_mpa
    if not (cycles[1] > cycles[0] and amplitude[0] > amplitude[1]):
        raise DataError(
            f"material.sn_line in {origin} must fall as the number of cycles rises, but goes from {amplitude[0]:g} MPa "
            f"at {cycles[0]:g} cycles to {amplitude[1]:g} MPa at {cycles[1]:g}."
        )
    mean = abs(amplitude[0] * (1.0 + line.stress_ratio) / (1.0 - line.stress_ratio))
    if mean + amplitude[0] > yield_mpa * (1.0 + 1e-9):
        raise DataError(
            f"material.sn_line in {origin} must stay below the yield stress, {yield_mpa:g} MPa, but reaches "
            f"{mean + amplitude[0]:g} MPa at {cycles[0]:g} cycles; begin the line at more cycles."
        )


def _check(gripper: Gripper, origin: str) -> None:
    check_material(gripper.material, origin)
    body, hinge, lever, links = (
        gripper.body,
        gripper.hinge,
        gripper.lever,
        gripper.links,
    )
    if body.height_mm < _METRES_BELOW_MM * hinge.thickness_mm or body.measured_below_tip_mm >= body.height_mm:
        raise DataError(
            f"body.height_mm in {origin} must be larger than the hinges and the measuring height, "
            f"but is {body.height_mm:g}; are its lengths in metres?"
        )
    if hinge.thickness_mm >= hinge.web_mm:
        raise DataError(
            f"hinge.thickness_mm in {origin} must be smaller than the web that the notches cut, {hinge.web_mm:g} mm, "
            f"but is {hinge.thickness_mm:g}; a hinge cannot be thicker than its web."
        )
    widest_mm = max(links.pillar_and_root_mm[1] - links.pillar_and_root_mm[0], links.shuttle_width_mm)
    if hinge.web_mm > _STATED * widest_mm:
        raise DataError(
            f"hinge.web_mm in {origin} must not exceed the width of the links that the notches cut, {widest_mm:g} mm, "
            f"but is {hinge.web_mm:g}; correct one of the two."
        )
    if body.plate_mm > body.height_mm:
        raise DataError(
            f"body.plate_mm in {origin} must be no more than body.height_mm, {body.height_mm:g} mm, but is "
            f"{body.plate_mm:g}; is it in micrometres?"
        )
    drawn = (lever.hinge1_mm[0] - lever.l2_mm, lever.hinge1_mm[1] - lever.l1_mm)
    _must_meet("lever.hinge2_mm", lever.hinge2_mm, "hinge 1 less (l2, l1)", drawn, origin)
    drawn = (lever.hinge2_mm[0] - lever.l4_mm, lever.hinge2_mm[1] - lever.l3_mm)
    _must_meet("lever.drive_mm", lever.drive_mm, "hinge 2 less (l4, l3)", drawn, origin)
    _must_meet("links.shuttle_from_mm", links.shuttle_from_mm, "lever.drive_mm", lever.drive_mm, origin)
    _check_links(gripper, origin)
    inner_mm = gripper.tip_corner_mm[0]
    if abs(2.0 * inner_mm - body.rest_gap_mm) > _MEET_MM:
        raise DataError(
            f"The tip's inner face in {origin} must lie at half of body.rest_gap_mm, {body.rest_gap_mm / 2.0:g} mm, "
            f"but lies at {inner_mm:g} mm."
        )


def read_material(tables: Mapping[str, Any], origin: str) -> Material:
    """Read the section [material], which has the same form in every kind of drawing."""
    material = Section(Path(origin), "", "", {"material": tables["material"]} if "material" in tables else {})
    return material.record(_WithMaterial).material


def check_material(material: Material, origin: str) -> None:
    """Refuse S-N lines that do not fall or reach the yield stress, and moduli that cannot be in MPa."""
    if material.sn_line is not None:
        _check_line(material.sn_line, material.yield_mpa, origin)
    strain = material.yield_mpa / material.youngs_modulus_mpa
    if not _LEAST_YIELD_STRAIN <= strain <= _MOST_YIELD_STRAIN:
        guess = "GPa" if strain > _MOST_YIELD_STRAIN else "Pa"
        raise DataError(
            f"material.yield_mpa over material.youngs_modulus_mpa in {origin} must lie between {_LEAST_YIELD_STRAIN:g} "
            f"and {_MOST_YIELD_STRAIN:g}, but is {material.yield_mpa:g} / {material.youngs_modulus_mpa:g} = "
            f"{strain:.3g}; is the modulus in {guess}? Modulus and yield stress must be in MPa."
        )


def _check_links(gripper: Gripper, origin: str) -> None:
    """Refuse links of zero length or width, for which no model can be built."""
    links = gripper.links
    for name in ("pillar_and_root_mm", "drive_block_mm"):
        x0, x1, y0, y1 = getattr(links, name)
        if not (x1 > x0 and y1 > y0):
            raise DataError(
                f"links.{name} in {origin} must be x from, x to, y from, y to, each range from the smaller to the "
                f"larger number, but is [{x0:g}, {x1:g}, {y0:g}, {y1:g}]."
            )
    shuttle = (*links.shuttle_from_mm, *links.shuttle_to_mm)
    for name, (x0, y0, x1, y1) in (("shuttle_to_mm", shuttle), ("finger_mm", links.finger_mm)):
        if x0 == x1 or not y1 > y0:
            raise DataError(
                f"links.{name} in {origin} must end beside and above the bar's beginning at ({x0:g}, {y0:g}), "
                f"but ends at ({x1:g}, {y1:g})."
            )
    if links.cross_bar_mm[0] == links.cross_bar_mm[2]:
        raise DataError(f"links.cross_bar_mm in {origin} must span some width, but begins and ends at the same x.")
    if len(links.tip_polygon_mm) < 3:
        raise DataError(
            f"links.tip_polygon_mm in {origin} must be at least three points, but is {list(links.tip_polygon_mm)}."
        )
    if len(set(links.tip_polygon_mm)) < len(links.tip_polygon_mm):
        raise DataError(f"links.tip_polygon_mm in {origin} must be different points, but one of them occurs twice.")
    if crosses_itself(Polygon(links.tip_polygon_mm)):
        raise DataError(
            f"links.tip_polygon_mm in {origin} must go round the tip without crossing itself, but two of its sides "
            "cross; put its points in order."
        )
    if not gripper.tip_corner_mm[1] > gripper.tip_heel_mm[1]:
        raise DataError(
            f"links.tip_polygon_mm in {origin} must have a vertical inner face, but its smallest x, "
            f"{gripper.tip_corner_mm[0]:g} mm, is that of a single point."
        )


def _must_meet(name: str, at_mm: tuple[float, float], other: str, other_mm: tuple[float, float], origin: str) -> None:
    apart_mm = math.dist(at_mm, other_mm)
    if apart_mm > _MEET_MM:
        raise DataError(
            f"{name} in {origin} must lie at {other} = ({other_mm[0]:g}, {other_mm[1]:g}), but lies at "
            f"({at_mm[0]:g}, {at_mm[1]:g}), {apart_mm:.3g} mm away: the links do not meet."
        )


# A gripper.toml as template of a mechanism: both halves of the gripper, each with its own deviations.

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
