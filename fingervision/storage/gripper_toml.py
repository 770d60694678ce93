"""The file gripper.toml: the drawing of a gripper, whose numbers have units and optional uncertainties."""

import difflib
import math
from collections.abc import Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from types import MappingProxyType
from typing import Any

from fingervision.domain.errors import DataError
from fingervision.domain.gripper import Body, Gripper, Hinge, Lever, Links, Material, SNLine
from fingervision.models.gripper_outline import check_outline, check_stated_size
from fingervision.models.plane_shapes import crosses_itself
from fingervision.storage.number_columns import is_number
from fingervision.storage.toml_purpose import DRAWINGS, refuse_other_file
from fingervision.storage.toml_section import read_document

# S-N line (fatigue strength) of a material in a drawing.
#
# `sn_line = { cycles = [1e4, 1e6], amplitude_mpa = [28.0, 16.0], stress_ratio = -1.0 }`

_KEYS = ("cycles", "amplitude_mpa", "stress_ratio")
_MOST_CYCLES = 1e12
_MOST_MPA = 1e5


def read_sn_line(raw: Any, name: str, origin: str) -> SNLine:
    """Read and check an S-N line.

    Parameters
    ----------
    raw : object
        The value as read from the file.
    name, origin : str
        Name of the key and of its file, for error messages.

    Raises
    ------
    DataError
        The amplitudes are not positive and decreasing, or the numbers of cycles do not increase.
    """
    what = f"{name} in {origin}"
    if not isinstance(raw, dict) or not {"cycles", "amplitude_mpa"} <= set(raw) <= set(_KEYS):
        raise DataError(
            f"{what} must be {{ cycles = [first, last], amplitude_mpa = [at first, at last] }}, with stress_ratio "
            f"where that is not -1, but is {raw!r}."
        )
    cycles = _two(raw["cycles"], f"{name}.cycles in {origin}", _MOST_CYCLES)
    amplitude = _two(raw["amplitude_mpa"], f"{name}.amplitude_mpa in {origin}", _MOST_MPA)
    ratio = raw.get("stress_ratio", -1.0)
    if not is_number(ratio) or not -10.0 <= ratio < 1.0:
        raise DataError(
            f"{name}.stress_ratio in {origin} must be the smallest over the largest stress, below 1, but is {ratio!r}."
        )
    if not (cycles[1] > cycles[0] >= 1.0 and amplitude[0] > amplitude[1] > 0.0):
        raise DataError(
            f"{what} must fall as the number of cycles rises, but goes from {amplitude[0]:g} MPa at "
            f"{cycles[0]:g} cycles to "
            f"{amplitude[1]:g} MPa at {cycles[1]:g}."
        )
    return SNLine(cycles, amplitude, float(ratio))


def check_below_yield(line: SNLine, yield_mpa: float, origin: str) -> None:
    """Refuse an S-N line whose peak stress (amplitude plus mean stress of the tests) reaches the yield stress."""
    mean = abs(line.amplitude_mpa[0] * (1.0 + line.stress_ratio) / (1.0 - line.stress_ratio))
    if mean + line.amplitude_mpa[0] > yield_mpa * (1.0 + 1e-9):
        raise DataError(
            f"material.sn_line in {origin} must stay below the yield stress, {yield_mpa:g} MPa, but reaches "
            f"{mean + line.amplitude_mpa[0]:g} MPa at {line.cycles[0]:g} cycles; begin the line at more cycles."
        )


def _two(raw: Any, what: str, most: float) -> tuple[float, float]:
    if not isinstance(raw, list) or len(raw) != 2 or not all(is_number(x) and abs(x) <= most for x in raw):
        raise DataError(f"{what} must be two numbers of at most {most:g}, but is {raw!r}.")
    return float(raw[0]), float(raw[1])


_SECTIONS: Mapping[str, type] = MappingProxyType(
    {"material": Material, "body": Body, "hinge": Hinge, "lever": Lever, "links": Links}
)
_MAY_BE_ANY_SIGN = frozenset({"lever.l1_mm", "lever.l2_mm", "lever.l3_mm", "lever.l4_mm", "lever.hinge1_axis_deg",
                              "lever.hinge2_axis_deg", "lever.drive_face_y_mm",
                              "material.thermal_expansion_per_k"})  # fmt: skip
_STATED = 1.05
"""Largest ratio of a stated width to the width that follows from the drawing."""
_MEET_MM = 0.02
_METRES_BELOW_MM = 2.0
_LEAST_DENSITY, _MOST_DENSITY = 30.0, 25000.0
"""Plausible range of densities in kg/m3, which includes rigid foam and osmium."""
_LEAST_YIELD_STRAIN, _MOST_YIELD_STRAIN = 1e-4, 0.1
"""Plausible range of the yield strain: lead yields at 5e-4, rubber-like polymers at about 0.1; a value outside this
range indicates a modulus in another unit."""
_LIMITS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "_mm": (1e-4, 1e5),
        "_deg": (0.0, 720.0),
        "_mpa": (1e-3, 1e13),
        "_kg_m3": (1.0, 3e4),
        "_ratio": (0.0, 0.5),
        "_per_k": (1e-9, 1e-2),
    }
)
"""Plausible ranges of numbers, by the unit at the end of the name; much larger numbers would overflow. Lengths are from
0.1 µm to 100 m. Moduli are up to ten times that of diamond in Pa; a modulus in Pa instead of MPa is detected by its
ratio to the yield stress. Densities range from aerogel to osmium, thermal expansions from glass ceramics to ten times
that of rubber."""
_SPELT: Mapping[str, str] = MappingProxyType(
    {"_mm": "mm", "_deg": "degrees", "_mpa": "MPa", "_kg_m3": "kg/m3", "_per_k": "1/K"}
)


def read_gripper(path: Path) -> Gripper:
    """Read and check the drawing of a gripper.

    A number may be written with its standard uncertainty: `thickness_mm = {value = 1.0, u = 0.1}`.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read, a key is missing or unknown, a value is not a number, or the drawing is not a valid
        gripper.
    """
    tables, _ = read_document(path, "gripper")
    refuse_other_file(path, tables, "the drawing of a gripper or mechanism", DRAWINGS)
    return gripper_from_tables(tables, str(path))


def gripper_from_tables(tables: Mapping[str, Any], origin: str) -> Gripper:
    """Build and check a gripper from the five tables of `gripper.toml`; errors name the file `origin`."""
    _refuse_unknown(tables, _SECTIONS, origin, "section")
    uncertainties: dict[str, float] = {}
    parts = _read_sections(tables, _SECTIONS, origin, uncertainties)
    gripper = Gripper(**parts, uncertainties=MappingProxyType(uncertainties))
    _check(gripper, origin)
    check_outline(gripper, origin)
    check_stated_size(gripper, origin)
    return gripper


def _read_sections(
    tables: Mapping[str, Any], sections: Mapping[str, type], origin: str, uncertainties: dict[str, float]
) -> dict[str, Any]:
    parts: dict[str, Any] = {}
    for section, record in sections.items():
        table = tables.get(section)
        if not isinstance(table, dict):
            raise DataError(f"{origin} must have a section [{section}], but has none.")
        names = {field.name: field.default is not MISSING for field in fields(record)}
        _refuse_unknown(table, names, origin, f"key in [{section}]")
        values: dict[str, Any] = {}
        for name, may_be_left_out in names.items():
            if name not in table and may_be_left_out:
                continue
            if name not in table:
                raise DataError(f"{origin} must state {section}.{name}, but does not.")
            values[name] = _value(table[name], f"{section}.{name}", origin, uncertainties)
        parts[section] = record(**values)
    return parts


def _refuse_unknown(given: Mapping[str, Any], known: Mapping[str, Any], origin: str, kind: str) -> None:
    for name in given:
        if name not in known:
            near = difflib.get_close_matches(name, list(known), 1, cutoff=0.0)
            raise DataError(f"{origin} has an unknown {kind}, {name}; did you mean {near[0]}?")


def _value(raw: Any, name: str, origin: str, uncertainties: dict[str, float]) -> Any:
    if name == "material.name":
        if not isinstance(raw, str):
            raise DataError(f"{name} in {origin} must be a text, but is {raw!r}.")
        return raw
    if name == "material.sn_line":
        return read_sn_line(raw, name, origin)
    if isinstance(raw, dict):
        if set(raw) != {"value", "u"}:
            raise DataError(
                f"{name} in {origin} must be a number or {{value = ..., u = ...}}, but has the keys {', '.join(raw)}."
            )
        u = _number(raw["u"], f"The uncertainty of {name}", origin)
        if u < 0.0:
            raise DataError(f"The uncertainty of {name} in {origin} must not be negative, but is {u:g}.")
        raw = raw["value"]
        if isinstance(raw, list):
            raise DataError(
                f"The uncertainty of {name} in {origin} must belong to a single number, but {name} is a list; "
                "state it at lever.l1_mm to l4_mm, which move hinges and drive."
            )
        uncertainties[name] = u
    if name.startswith("links.") and not name.endswith("width_mm"):
        if name == "links.tip_polygon_mm":
            if not isinstance(raw, list) or len(raw) < 3:
                raise DataError(f"{name} in {origin} must be at least three points, but is {raw!r}.")
            return tuple(_numbers(point, 2, name, origin) for point in raw)
        return _numbers(raw, 2 if name.startswith("links.shuttle") else 4, name, origin)
    if name in ("lever.hinge1_mm", "lever.hinge2_mm", "lever.drive_mm"):
        return _numbers(raw, 2, name, origin)
    value = _number(raw, name, origin)
    if name not in _MAY_BE_ANY_SIGN and value <= 0.0:
        raise DataError(f"{name} in {origin} must be positive, but is {value:g}.")
    return value


def _spelt(unit: str) -> str:
    return f" {_SPELT[unit]}" if _SPELT.get(unit) else ""


def _number(raw: Any, name: str, origin: str) -> float:
    if not is_number(raw):
        raise DataError(f"{name} in {origin} must be a finite number, but is {raw!r}.")
    try:
        value = float(raw)
    except OverflowError:
        raise DataError(f"{name} in {origin} is too large a number: it has {len(str(raw))} digits.") from None
    unit = next((unit for unit in _LIMITS if name.endswith(unit)), "")
    lowest, highest = _LIMITS.get(unit, (0.0, math.inf))
    if abs(value) > highest or 0.0 < value < lowest:
        raise DataError(
            f"{name} in {origin} must lie between {lowest:g} and {highest:g}{_spelt(unit)}, but is {value:g}; "
            "check its unit."
        )
    return value


def _numbers(raw: Any, count: int, name: str, origin: str) -> tuple[float, ...]:
    if not isinstance(raw, list) or len(raw) != count:
        raise DataError(f"{name} in {origin} must be a list of {count} numbers, but is {raw!r}.")
    return tuple(_number(part, name, origin) for part in raw)


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
    section: Mapping[str, type] = {"material": Material}
    return _read_sections({"material": tables.get("material")}, section, origin, {})["material"]  # type: ignore[no-any-return]


def check_material(material: Material, origin: str) -> None:
    """Refuse impossible Poisson's ratios, and Young's moduli whose values cannot be in MPa."""
    if material.poisson_ratio >= 0.5:
        raise DataError(f"material.poisson_ratio in {origin} must be below 0.5, but is {material.poisson_ratio:g}.")
    if not _LEAST_DENSITY <= material.density_kg_m3 <= _MOST_DENSITY:
        raise DataError(
            f"material.density_kg_m3 in {origin} must lie between {_LEAST_DENSITY:g} and {_MOST_DENSITY:g}, but is "
            f"{material.density_kg_m3:g}; is it in g/cm3? Multiply it by 1000."
        )
    if material.sn_line is not None:
        check_below_yield(material.sn_line, material.yield_mpa, origin)
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
    if len(set(links.tip_polygon_mm)) < len(links.tip_polygon_mm):
        raise DataError(f"links.tip_polygon_mm in {origin} must be different points, but one of them occurs twice.")
    if crosses_itself(links.tip_polygon_mm):
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
