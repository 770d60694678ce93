"""The file mechanism.toml: drawing of any planar flexure mechanism; numbers may be expressions of its [lengths]."""

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import hypot
from pathlib import Path
from types import MappingProxyType
from typing import Any

from fingervision.domain.errors import DataError
from fingervision.domain.parameter import Estimate
from fingervision.models.flexure import Flexure
from fingervision.models.mechanism import Contact, Drive, Face, Mechanism, check_mechanism
from fingervision.models.plane_shapes import Ellipse, Polygon, Shape, bar, box, crosses_itself
from fingervision.models.strips import strips_of
from fingervision.storage.drawing_numbers import bare_tables, changed_tables, numbers_of
from fingervision.storage.drawing_reader import DrawingReader, as_table, number
from fingervision.storage.gripper_template import mechanism_from_gripper
from fingervision.storage.gripper_toml import check_material, read_material
from fingervision.storage.plain_file import toml_of
from fingervision.storage.toml_section import DRAWINGS, read_document, refuse_other_file

_TOP = (
    "schema",
    "name",
    "plate_mm",
    "material",
    "lengths",
    "body",
    "flexure",
    "fixed",
    "slide",
    "drive",
    "probe",
    "pair",
    "contact",
)
_SHAPES = {"bar_mm": 4, "box_mm": 4, "disc_mm": 3, "ellipse_mm": 5}
_DRIVE = (
    "name", "box_mm", "pin_mm", "direction", "across", "turns", "per_input", "stiffness_n_mm", "force_n_per_input",
)  # fmt: skip
_FLEXURES = {
    "circular": ("thickness_mm", "radius_mm"),
    "elliptic": ("thickness_mm", "half_length_mm", "depth_mm"),
    "filleted": ("thickness_mm", "half_length_mm", "depth_mm", "fillet_mm"),
    "leaf": ("thickness_mm", "half_length_mm"),
}


def is_mechanism(path: Path) -> bool:
    """Whether a TOML file is a mechanism.toml (bodies or a template), not a gripper.toml."""
    try:
        tables = toml_of(path)
    except (OSError, ValueError):
        return False
    return isinstance(tables.get("body"), list) or isinstance(tables.get("gripper"), dict)


@dataclass(frozen=True, slots=True)
class MechanismDrawing:
    """Drawing of a mechanism, from which the mechanism can be built with changed dimensions.

    Parameters
    ----------
    path : Path
        The file.
    tables : mapping
        Tables of the file, with plain numbers in place of those with an uncertainty.
    uncertainties : mapping of str to float
        Standard uncertainties of numbers by dotted name, such as `lengths.t`.
    """

    path: Path
    tables: Mapping[str, Any]
    uncertainties: Mapping[str, float]

    def mechanism(self, changes: Mapping[str, float] = MappingProxyType({}), *, absolute: bool = False) -> Mechanism:
        """Build and check the mechanism, with some dimensions changed by given amounts, or to values if `absolute`.

        Raises
        ------
        DataError, InputFileError
            A name does not denote a number of the drawing, or the changed drawing is not a valid mechanism.
        """
        tables = changed_tables(self.tables, changes, str(self.path), absolute=absolute) if changes else self.tables
        if "gripper" in tables:
            return mechanism_from_gripper(tables, self.path)
        return mechanism_from_tables(tables, str(self.path))

    def value(self, name: str) -> float:
        """Value of one number of the drawing, by its dotted name.

        Raises
        ------
        DataError
            The name does not denote a number of the drawing.
        """
        changed_tables(self.tables, {name: 0.0}, str(self.path))
        raw = numbers_of(self.tables)[name]
        return number(raw, self._lengths, f"{name} in {self.path}") if isinstance(raw, str) else raw

    @property
    def _lengths(self) -> dict[str, float]:
        lengths: dict[str, float] = {}
        for name, raw in as_table(self.tables.get("lengths", {}), f"[lengths] in {self.path}").items():
            lengths[name] = number(raw, lengths, f"lengths.{name} in {self.path}")
        return lengths

    @property
    def estimates(self) -> dict[str, Estimate]:
        """Return the dimensions with a stated uncertainty: their values and standard uncertainties."""
        return {name: Estimate(self.value(name), u) for name, u in self.uncertainties.items()}


def read_drawing(path: Path) -> MechanismDrawing:
    """Read a mechanism's file without building the mechanism.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read, or an uncertainty in it is not a positive number.
    """
    tables, _ = read_document(path, "mechanism")
    refuse_other_file(path, tables, "the drawing of a mechanism or gripper", DRAWINGS)
    return MechanismDrawing(path, *bare_tables(tables, str(path)))


def read_mechanism(path: Path) -> Mechanism:
    """Read and check a mechanism.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read, a key is missing or unknown, a value is not a number, or the drawing is not a valid
        mechanism.
    """
    return read_drawing(path).mechanism()


def mechanism_from_tables(tables: Mapping[str, Any], origin: str) -> Mechanism:
    """Build and check a mechanism from its tables; errors name the file `origin`."""
    for key in tables:
        if key not in _TOP:
            near = difflib.get_close_matches(key, _TOP, 1, cutoff=0.0)[0]
            raise DataError(f"{origin} has an unknown section or key, {key}; did you mean {near}?")
    if tables.get("schema", 1) != 1:
        raise DataError(f"schema in {origin} must be 1, but is {tables['schema']!r}.")
    lengths: dict[str, float] = {}
    for name, raw in as_table(tables.get("lengths", {}), f"[lengths] in {origin}").items():
        lengths[name] = number(raw, lengths, f"lengths.{name} in {origin}")
    reader = _Reader(lengths, origin)
    material = read_material(tables, origin)
    mechanism = Mechanism(
        name=str(tables.get("name", origin)),
        material=material,
        plate_mm=reader.positive(tables, "plate_mm", ""),
        bodies=tuple(
            step for i, table in enumerate(reader.sections(tables, "body"), 1) for step in reader.body(table, i)
        ),
        flexures=tuple(reader.flexure(t, i) for i, t in enumerate(reader.sections(tables, "flexure", least=0), 1)),
        fixed=tuple(reader.face(t, f"fixed {i}") for i, t in enumerate(reader.sections(tables, "fixed", least=0), 1)),
        slides=tuple(reader.slide(t, i) for i, t in enumerate(reader.sections(tables, "slide", least=0), 1)),
        drives=reader.drives(tables),
        probes={name: p for t in reader.sections(tables, "probe", least=0) for name, p in [reader.probe(t)]},
        pairs={},
        body_names=tuple(str(table.get("name", "")) for table in reader.sections(tables, "body")),
        contacts=tuple(reader.contact(t, i) for i, t in enumerate(reader.sections(tables, "contact", least=0), 1)),
    )
    pairs = {name: ends for t in reader.sections(tables, "pair", least=0) for name, ends in [reader.pair(t, mechanism)]}
    mechanism.pairs.update(pairs)
    with_strips = (*mechanism.flexures, *strips_of(mechanism.region, mechanism.flexures))
    mechanism = replace(mechanism, flexures=with_strips)
    _refuse_same_names(tables, reader)
    check_material(material, origin)
    check_mechanism(mechanism, mechanism.region)
    return mechanism


def _refuse_same_names(tables: Mapping[str, Any], reader: "_Reader") -> None:
    """Refuse two flexures, probes, pairs or contacts of one name: results by name would be those of one of them."""
    for section in ("flexure", "probe", "pair", "contact"):
        places: dict[str, int] = {}
        for place, table in enumerate(reader.sections(tables, section, least=0), 1):
            name = str(table.get("name", f"{section} {place}"))
            if name in places:
                raise DataError(
                    f"Every [[{section}]] of {reader.origin} must have a name of its own, but numbers {places[name]} "
                    f"and {place} are both called {name}; rename one of them."
                )
            places[name] = place


class _Reader(DrawingReader):
    def body(self, table: Mapping[str, Any], place: int) -> list[tuple[bool, Shape]]:
        what = f"body {table.get('name', place)}"
        self.known(table, ("name", "cut", "width_mm", "polygon_mm", *_SHAPES), what)
        given = [key for key in (*_SHAPES, "polygon_mm") if key in table]
        if len(given) != 1:
            raise DataError(
                f"{what} in {self.origin} must have exactly one of {', '.join((*_SHAPES, 'polygon_mm'))}, but has "
                f"{' and '.join(given) or 'none'}."
            )
        if not isinstance(table.get("cut", False), bool):
            raise DataError(f"{what}.cut in {self.origin} must be true or false, but is {table['cut']!r}.")
        added = not table.get("cut", False)
        return [(added, self._shape(table, given[0], what))]

    def _shape(self, table: Mapping[str, Any], key: str, what: str) -> Shape:
        if key == "polygon_mm":
            raw = table[key]
            if not isinstance(raw, list) or len(raw) < 3:
                raise DataError(f"{what}.polygon_mm in {self.origin} must be three points or more, but is {raw!r}.")
            points = [self.numbers({"polygon_mm": point}, "polygon_mm", 2, what) for point in raw]
            corners = tuple((x, y) for x, y in points)
            if len(set(corners)) < len(corners) or crosses_itself(corners):
                raise DataError(
                    f"{what}.polygon_mm in {self.origin} must go round without crossing itself, but does not; put "
                    "its points in order, each once."
                )
            return Polygon(corners)
        values = self.numbers(table, key, _SHAPES[key], what)
        if key == "bar_mm":
            width_mm = self.positive(table, "width_mm", what)
            if hypot(values[2] - values[0], values[3] - values[1]) == 0.0:
                raise DataError(f"{what}.bar_mm in {self.origin} must have two different end points, but has not.")
            return bar(values[0], values[1], values[2], values[3], width_mm)
        if key == "box_mm":
            return box(*self.grown(values, f"{what}.box_mm"))
        radii = (values[2], values[2]) if key == "disc_mm" else (values[2], values[3])
        if min(radii) <= 0.0:
            raise DataError(f"{what}.{key} in {self.origin} must have positive radii, but has {min(radii):g}.")
        return Ellipse((values[0], values[1]), radii, values[4] if key == "ellipse_mm" else 0.0)

    def flexure(self, table: Mapping[str, Any], place: int) -> Flexure:
        name = str(table.get("name", place))
        what = f"flexure {name}"
        kind = table.get("kind")
        if kind not in _FLEXURES:
            raise DataError(f"{what}.kind in {self.origin} must be one of {', '.join(_FLEXURES)}, but is {kind!r}.")
        self.known(table, ("name", "kind", "at_mm", "axis_deg", *_FLEXURES[kind]), what)
        at = self.numbers(table, "at_mm", 2, what)
        values = {key: self.positive(table, key, what) for key in _FLEXURES[kind]}
        if "radius_mm" in values:
            values["half_length_mm"] = values["depth_mm"] = values.pop("radius_mm")
        if values.get("fillet_mm", 0.0) > min(values["half_length_mm"], values.get("depth_mm", 0.0) or 1e300):
            raise DataError(
                f"{what}.fillet_mm in {self.origin} must be at most half_length_mm and depth_mm, but is "
                f"{values['fillet_mm']:g}."
            )
        return Flexure(
            name, kind, (at[0], at[1]), self.value(table, "axis_deg", what), values["thickness_mm"],
            values["half_length_mm"], values.get("depth_mm", 0.0), values.get("fillet_mm", 0.0),
        )  # fmt: skip

    def face(self, table: Mapping[str, Any], what: str) -> Face:
        name = str(table.get("name", what))
        return Face(name, self.grown(self.numbers(table, "box_mm", 4, what), f"{what}.box_mm", flat=True))

    def slide(self, table: Mapping[str, Any], place: int) -> tuple[Face, str]:
        if table.get("holds") not in ("x", "y"):
            raise DataError(f"slide {place}.holds in {self.origin} must be x or y, but is {table.get('holds')!r}.")
        return self.face(table, f"slide {place}"), table["holds"]

    def contact(self, table: Mapping[str, Any], place: int) -> Contact:
        name = str(table.get("name", f"contact {place}"))
        what = f"contact {name}"
        self.known(table, ("name", "box_mm", "against_box_mm", "wall_mm"), what)
        if ("against_box_mm" in table) == ("wall_mm" in table):
            raise DataError(
                f"{what} in {self.origin} must have either against_box_mm (the other face) or wall_mm (two points of a "
                f"rigid wall), but has {'both' if 'wall_mm' in table else 'none'}."
            )
        face = self.face({**table, "name": name}, what)
        if "wall_mm" in table:
            x0, y0, x1, y1 = self.numbers(table, "wall_mm", 4, what)
            if hypot(x1 - x0, y1 - y0) == 0.0:
                raise DataError(f"{what}.wall_mm in {self.origin} must be two different points, but both are the same.")
            return Contact(name, face, None, ((x0, y0), (x1, y1)))
        box_mm = self.grown(self.numbers(table, "against_box_mm", 4, what), f"{what}.against_box_mm", flat=True)
        return Contact(name, face, Face(f"{name}, other face", box_mm))

    def drives(self, tables: Mapping[str, Any]) -> tuple[Drive, ...]:
        """Read [drive], or several [[drive]] sections."""
        raw = tables.get("drive")
        if raw is None:
            raise DataError(f"{self.origin} must have a driven face, [drive] or several [[drive]], but has none.")
        if not isinstance(raw, list):
            return (self.drive(as_table(raw, f"[drive] in {self.origin}"), "drive"),)
        found = tuple(
            self.drive({"name": f"drive {place}", **table}, f"drive {table.get('name', place)}")
            for place, table in enumerate(self.sections(tables, "drive"), 1)
        )
        names = [drive.face.name for drive in found]
        for name in names:
            if names.count(name) > 1:
                raise DataError(
                    f"The drives of {self.origin} must have different names, but {names.count(name)} are called {name}."
                )
        if not any(drive.per_input for drive in found):
            raise DataError(
                f"At least one drive of {self.origin} must move with the input, but per_input is 0 for all of them."
            )
        return found

    def drive(self, table: Mapping[str, Any], what: str) -> Drive:
        self.known(table, _DRIVE, what)
        x, y = self.numbers(table, "direction", 2, what)
        across = table.get("across", "held")
        if hypot(x, y) == 0.0:
            raise DataError(f"{what}.direction in {self.origin} must be a vector such as [1, 0], but is [0, 0].")
        if across not in ("held", "free") or (across == "free" and x * y != 0.0):
            raise DataError(
                f"{what}.across in {self.origin} must be 'held', or 'free' if {what}.direction is along x or "
                f"y, but is {across!r}."
            )
        turns = table.get("turns", "free" if "pin_mm" in table else across)
        if turns not in ("held", "free"):
            raise DataError(
                f"{what}.turns in {self.origin} must be 'free' (a rod or a pin: the face may turn) or 'held' (a clamp "
                f"or a flat plate), but is {turns!r}."
            )
        per_input = self.value({"per_input": 1.0, **table}, "per_input", what)
        own = [self.positive(table, key, what) if key in table else None
               for key in ("stiffness_n_mm", "force_n_per_input")]  # fmt: skip
        return Drive(
            self.driven(table, what, turns), (x / hypot(x, y), y / hypot(x, y)), across, per_input, turns, *own
        )

    def driven(self, table: Mapping[str, Any], what: str, turns: str) -> Face:
        """Read the face or the pin of a drive."""
        if "pin_mm" not in table:
            return self.face(table, what)
        if "box_mm" in table:
            raise DataError(f"{what} in {self.origin} must have either box_mm (a face) or pin_mm, but has both.")
        x, y, diameter = self.numbers(table, "pin_mm", 3, what)
        if diameter <= 0.0:
            raise DataError(f"{what}.pin_mm in {self.origin} must be [x, y, diameter > 0], but is {table['pin_mm']!r}.")
        if turns == "held":
            raise DataError(f'{what}.turns in {self.origin} must be "free", as a pin does not hold a rotation.')
        half = 0.5 * diameter
        return Face(str(table.get("name", what)), (x - half, x + half, y - half, y + half), is_pin=True)

    def probe(self, table: Mapping[str, Any]) -> tuple[str, tuple[float, float]]:
        name = str(table.get("name", ""))
        x, y = self.numbers(table, "at_mm", 2, f"probe {name}")
        return name, (x, y)

    def pair(self, table: Mapping[str, Any], mechanism: Mechanism) -> tuple[str, tuple[str, str]]:
        name, of = str(table.get("name", "")), table.get("of")
        ends = [end for end in of if isinstance(end, str) and end in mechanism.probes] if isinstance(of, list) else []
        if len(ends) != 2 or ends != of or mechanism.probes[ends[0]] == mechanism.probes[ends[1]]:
            raise DataError(
                f"pair {name}.of in {self.origin} must be two of the probes {', '.join(mechanism.probes)} at different "
                f"places, but is {of!r}."
            )
        return name, (ends[0], ends[1])
