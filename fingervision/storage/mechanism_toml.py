"""The file mechanism.toml: drawing of any planar flexure mechanism; numbers may be expressions of its [lengths]."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import hypot
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

from fingervision.domain.errors import DataError
from fingervision.domain.field import Field, names_of
from fingervision.domain.parameter import Estimate
from fingervision.models.flexure import Flexure, fused
from fingervision.models.mechanism import Contact, Drive, Face, Mechanism, check_mechanism
from fingervision.models.planar_region import PlanarRegion, rounded_corner
from fingervision.models.plane_shapes import Ellipse, Polygon, RigidMap, Shape, bar, box, crosses_itself
from fingervision.models.strips import strips_of
from fingervision.storage.drawing_numbers import bare_tables, changed_tables, number, numbers_of
from fingervision.storage.gripper_toml import check_material, mechanism_from_gripper, read_material
from fingervision.storage.outline_file import read_outline
from fingervision.storage.plain_file import toml_of
from fingervision.storage.toml_section import DRAWINGS, Section, read_document, refuse_other_file

_FLEXURES = {
    "circular": ("radius_mm",),
    "elliptic": ("half_length_mm", "depth_mm"),
    "filleted": ("half_length_mm", "depth_mm", "fillet_mm"),
    "leaf": ("half_length_mm",),
}
"""Sizes of each kind of flexure, beside its thickness."""
_SHAPES = ("bar_mm", "box_mm", "disc_mm", "ellipse_mm", "polygon_mm", "outline")
_QUARTER_DEG = 90.0
_COPY = " copy"

Point = tuple[float, float]
_Step = tuple[str, tuple[bool, Shape], tuple[int, ...]]
"""A shape that is added or removed, with its name and its layers."""
Box = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class BodyTable:
    """A table [[body]]: exactly one of its shapes is given."""

    name: Annotated[str, Field("name of the body; its number by default")] = ""
    cut: Annotated[bool, Field("`true` subtracts the shape")] = False
    in_layers: Annotated[
        tuple[int, ...], Field("numbers of the layers in which the body lies, and which it joins; [1] by default")
    ] = (1,)
    bar_mm: Annotated[Box | None, Field("bar: x and y of one end, and of the other end", "mm")] = None
    width_mm: Annotated[float | None, Field("width of the bar", "mm", above=0.0)] = None
    box_mm: Annotated[Box | None, Field("box: x from, x to, y from, y to", "mm")] = None
    disc_mm: Annotated[tuple[float, float, float] | None, Field("disc: x, y, radius", "mm")] = None
    ellipse_mm: Annotated[
        tuple[float, float, float, float, float] | None,
        Field("ellipse: x, y, two half axes, and the angle of the first (degrees)", "mm"),
    ] = None
    polygon_mm: Annotated[tuple[Point, ...] | None, Field("polygon: its corners in order", "mm")] = None
    bulges: Annotated[
        tuple[float, ...],
        Field(
            "with a polygon: for each corner the arc to the next, as in DXF: tangent of a quarter of its angle, "
            "positive for an anticlockwise arc, 0 for a straight side"
        ),
    ] = ()
    outline: Annotated[
        str, Field("closed outlines of a DXF or SVG file, whose path is relative to the drawing; inner ones are holes")
    ] = ""
    layer: Annotated[str, Field("layer of the DXF file; all visible ones by default")] = ""
    unit_mm: Annotated[
        float | None, Field("unit of the file's lengths; as the file states by default, or mm in DXF", "mm", above=0.0)
    ] = None


@dataclass(frozen=True, slots=True)
class FilletTable:
    """A table [[fillet]]."""

    at_mm: Annotated[Point, Field("a corner between two straight edges of the bodies, or a point near it", "mm")]
    radius_mm: Annotated[float, Field("radius that rounds the corner; a re-entrant corner is filled", "mm", above=0.0)]
    name: Annotated[str, Field("name, for a copy")] = ""
    in_layers: Annotated[tuple[int, ...], Field("numbers of the layers in which it rounds the corner")] = (1,)


@dataclass(frozen=True, slots=True)
class CopyTable:
    """A table [[copy]]: a reflection, then a rotation, then a translation of what it copies."""

    of: Annotated[
        tuple[str, ...],
        Field("names of the bodies, fillets, flexures, fixed faces and probes; by default all, and the copies above"),
    ] = ()
    suffix: Annotated[str, Field("what is added to the names of the copies; ` copy` by default")] = _COPY
    mirror_x_mm: Annotated[float | None, Field("reflects them in the line x = this", "mm")] = None
    mirror_y_mm: Annotated[float | None, Field("reflects them in the line y = this", "mm")] = None
    turn_deg: Annotated[float, Field("rotates them from x towards y; by quarter turns with faces", "degrees")] = 0.0
    about_mm: Annotated[Point, Field("centre of the rotation; the origin by default", "mm")] = (0.0, 0.0)
    by_mm: Annotated[Point, Field("displaces them along x and y", "mm")] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class FlexureTable:
    """A table [[flexure]]: beside its thickness, the sizes of its kind."""

    kind: Annotated[str, Field("`circular`, `elliptic`, `filleted` or `leaf`", of=tuple(_FLEXURES))]
    at_mm: Annotated[Point, Field("centre of the flexure", "mm")]
    axis_deg: Annotated[float, Field("angle of its axis from x", "degrees")]
    thickness_mm: Annotated[float, Field("least thickness", "mm", above=0.0)]
    name: Annotated[str, Field("name of the flexure; its number by default")] = ""
    radius_mm: Annotated[float | None, Field("of a circular flexure: radius of the notches", "mm", above=0.0)] = None
    half_length_mm: Annotated[float | None, Field("of other kinds: half its length", "mm", above=0.0)] = None
    depth_mm: Annotated[
        float | None, Field("of an elliptic or filleted flexure: depth of the notches", "mm", above=0.0)
    ] = None
    fillet_mm: Annotated[float | None, Field("of a filleted flexure: radius of the fillets", "mm", above=0.0)] = None
    layer: Annotated[int, Field("number of the layer in which the flexure lies; 1 by default", low=1)] = 1


@dataclass(frozen=True, slots=True)
class FaceTable:
    """A table [[fixed]]."""

    box_mm: Annotated[Box, Field("box around the face: x from, x to, y from, y to", "mm")]
    name: Annotated[str, Field("name of the face; its number by default")] = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class SlideTable(FaceTable):
    """A table [[slide]]."""

    holds: Annotated[str, Field("direction in which the face is held: `x` or `y`", of=("x", "y"))]


@dataclass(frozen=True, slots=True)
class ContactTable(FaceTable):
    """A table [[contact]]."""

    against_box_mm: Annotated[Box | None, Field("box around the other face", "mm")] = None
    wall_mm: Annotated[Box | None, Field("or a rigid wall: x and y of two of its points", "mm")] = None


@dataclass(frozen=True, slots=True)
class DriveTable:
    """A table [drive], or several [[drive]]."""

    direction: Annotated[Point, Field("direction of the motion: x and y of a vector")]
    box_mm: Annotated[Box | None, Field("box around the driven face: x from, x to, y from, y to", "mm")] = None
    pin_mm: Annotated[
        tuple[float, float, float] | None,
        Field("or a pin: x, y and diameter of a circle within which the mean of the body is driven; it may turn", "mm"),
    ] = None
    name: Annotated[str, Field("name of the drive; its number by default")] = ""
    across: Annotated[
        str, Field("`held`, guided as by a stage, or `free`, may slide; held by default", of=("held", "free"))
    ] = "held"
    turns: Annotated[
        str | None,
        Field(
            "`free`: a rod or pin moves the face in the mean, and the face may turn; `held`: every point of it moves "
            "alike (a clamp or a flat plate); as `across` by default, and `free` with a pin",
            of=("held", "free"),
        ),
    ] = None
    per_input: Annotated[float, Field("displacement per input; 1 by default", "mm/mm")] = 1.0
    stiffness_n_mm: Annotated[
        float | None,
        Field("stiffness of the actuator, behind which the input is the actuator's own motion", "N/mm", above=0.0),
    ] = None
    force_n_per_input: Annotated[
        float | None,
        Field(
            "force on the face per input, instead of a motion; with a stiffness, it decreases as the face moves", "N",
            above=0.0,
        ),
    ] = None  # fmt: skip
    preload_n: Annotated[
        float, Field("force on the face at rest, along the direction, from where inputs are counted; 0 by default", "N")
    ] = 0.0


@dataclass(frozen=True, slots=True)
class ProbeTable:
    """A table [[probe]]."""

    at_mm: Annotated[Point, Field("point whose motion is observed", "mm")]
    name: Annotated[str, Field("name of the point")] = ""


@dataclass(frozen=True, slots=True)
class PairTable:
    """A table [[pair]]."""

    of: Annotated[tuple[str, str], Field("names of two probes, whose distance is a gap")]
    name: Annotated[str, Field("name of the pair")] = ""


@dataclass(frozen=True, slots=True)
class MechanismFile:
    """The file mechanism.toml, without its tables [material] and [lengths]."""

    plate_mm: Annotated[float, Field("thickness of the plate", "mm", above=0.0)]
    body: Annotated[tuple[BodyTable, ...], Field("bodies, in the order in which they are added or cut")]
    drive: Annotated[tuple[DriveTable, ...], Field("driven faces")]
    schema: Annotated[int, Field("1", low=1, high=1)] = 1
    name: Annotated[str | None, Field("name of the mechanism; that of its file by default")] = None
    fillet: Annotated[tuple[FilletTable, ...], Field("rounded corners of the bodies, applied after all bodies")] = ()
    flexure: Annotated[tuple[FlexureTable, ...], Field("flexures")] = ()
    fixed: Annotated[tuple[FaceTable, ...], Field("fixed faces")] = ()
    slide: Annotated[tuple[SlideTable, ...], Field("faces that are held in one direction")] = ()
    probe: Annotated[tuple[ProbeTable, ...], Field("observed points")] = ()
    pair: Annotated[tuple[PairTable, ...], Field("pairs of points, each with a gap")] = ()
    contact: Annotated[tuple[ContactTable, ...], Field("faces that may touch each other, or a wall")] = ()
    copy: Annotated[tuple[CopyTable, ...], Field("copies of parts of the drawing, in their order")] = ()


def is_mechanism(path: Path) -> bool:
    """Whether a TOML file is a mechanism.toml (bodies or a template), not a gripper.toml."""
    try:
        tables = toml_of(path)
    except (OSError, ValueError):
        return False
    own = not {"plate_mm", "drive", "flexure"}.isdisjoint(tables)  # a drawing whose bodies are missing or misspelt
    return own or isinstance(tables.get("body"), list) or isinstance(tables.get("gripper"), dict)


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
        if not isinstance(raw, str):
            return raw
        return number(raw, _lengths(self.tables, str(self.path)), f"{name} in {self.path}")

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
    lengths = _lengths(tables, origin)
    drive = tables.get("drive")
    values = {
        **{key: value for key, value in tables.items() if key not in ("material", "lengths")},
        "drive": [{"name": "drive", **drive}] if isinstance(drive, dict) else drive or [],
    }
    top = Section(Path(origin), "", "", values, names=lengths)
    top.only([*names_of(MechanismFile), "material", "lengths"])
    material = read_material(tables, origin)
    file = top.record(MechanismFile)

    def each(key: str, read: Callable[[Section, Any, str], Any]) -> list[Any]:
        pairs = zip(top.tables(key), getattr(file, key), strict=True)
        return [read(section, table, table.name or f"{key} {k}") for k, (section, table) in enumerate(pairs, 1)]

    for key in ("flexure", "probe", "pair", "contact", "drive"):
        _refuse_same_names(top, key)
    bodies = each("body", _body)
    parts = _copied(top, file, _Parts(
        [named for steps, _ in bodies for named in steps],
        each("flexure", _flexure), each("fixed", _face), {probe.name: probe.at_mm for probe in file.probe},
    ))  # fmt: skip
    flexures, crossings = fused(parts.flexures)
    is_layered = {(f.layer,) for f in flexures} | {layers for _, _, layers in parts.bodies} != {(1,)}
    mechanism = Mechanism(
        name=origin if file.name is None else file.name,
        material=material,
        plate_mm=file.plate_mm,
        bodies=tuple(body for _, body, _ in parts.bodies),
        flexures=flexures,
        fused=crossings,
        fixed=tuple(parts.fixed),
        slides=tuple(zip(each("slide", _face), [slide.holds for slide in file.slide], strict=True)),
        drives=tuple(each("drive", _drive)),
        probes=parts.probes,
        pairs={},
        body_names=tuple(name for name, _, _ in parts.bodies),
        layers=tuple(layers for _, _, layers in parts.bodies) if is_layered else (),
        contacts=tuple(each("contact", _contact)),
        notes=tuple(words for _, words in bodies if words),
    )
    if not any(drive.per_input for drive in mechanism.drives):
        raise DataError(f"At least one drive of {origin} must move with the input, but per_input is 0 for all of them.")
    mechanism.pairs.update(each("pair", lambda section, pair, _: (pair.name, _ends(section, pair, mechanism.probes))))
    if not is_layered:
        with_strips = (*mechanism.flexures, *strips_of(mechanism.region, mechanism.flexures))
        mechanism = replace(mechanism, flexures=with_strips)
    check_material(material, origin)
    check_mechanism(mechanism, mechanism.region)
    return mechanism


def _lengths(tables: Mapping[str, Any], origin: str) -> dict[str, float]:
    """Values of the names in [lengths], of which each may use those above it."""
    lengths: dict[str, float] = {}
    for name, raw in Section(Path(origin), "", "", tables).table("lengths").values.items():
        lengths[name] = number(raw, lengths, f"lengths.{name} in {origin}")
    return lengths


def _refuse_same_names(top: Section, key: str) -> None:
    """Refuse two flexures, probes, pairs, contacts or drives of one name: results by name would be those of one."""
    places: dict[str, int] = {}
    for place, section in enumerate(top.tables(key), 1):
        name = section.values.get("name", f"{key} {place}")
        if not name.isprintable():
            raise DataError(
                f"Every name of a [[{key}]] of {top.path} must be one line of printable letters, because it heads "
                f"columns, but that of number {place} is {name!r}; write it in one line."
            )
        if name in places:
            raise DataError(
                f"Every [[{key}]] of {top.path} must have a name of its own, but numbers {places[name]} and {place} "
                f"are both called {name}; rename one of them."
            )
        places[name] = place


@dataclass(frozen=True, slots=True)
class _Parts:
    """What a [[copy]] copies: steps of bodies with their names and layers, flexures, fixed faces and probes."""

    bodies: list[_Step]
    flexures: list[Flexure]
    fixed: list[Face]
    probes: dict[str, Point]


def _copied(top: Section, file: MechanismFile, parts: _Parts) -> _Parts:
    """Add the fillets and the copies of a drawing to its parts."""
    for section, fillet in zip(top.tables("fillet"), file.fillet, strict=True):
        own = tuple(step for _, step, layers in parts.bodies if set(fillet.in_layers) <= set(layers))
        try:
            step = rounded_corner(PlanarRegion(own), fillet.at_mm, fillet.radius_mm)
            parts.bodies.append((fillet.name, step, fillet.in_layers))
        except DataError as error:
            section.refuse("at_mm", str(error))
    for section, table in zip(top.tables("copy"), file.copy, strict=True):
        names = [
            *(name for name, _, _ in parts.bodies),
            *(f.name for f in parts.flexures),
            *(f.name for f in parts.fixed),
            *parts.probes,
        ]
        if missing := sorted(set(table.of) - set(names)):
            section.refuse("of", f"must hold names of parts of the drawing, but there is no {missing[0]}.")
        if table.of and not table.suffix:
            section.refuse("suffix", "must not be empty, because a copy needs a name of its own.")
        place = _map_of(section, table)
        of = table.of or names
        bodies = [(n and n + table.suffix, (add, place.shape(s)), own) for n, (add, s), own in parts.bodies if n in of]
        flexures = [
            replace(f, name=f.name + table.suffix, at_mm=place.point(f.at_mm), axis_deg=place.angle_deg(f.axis_deg))
            for f in parts.flexures if f.name in of
        ]  # fmt: skip
        fixed = [_moved(section, face, place, table.suffix) for face in parts.fixed if face.name in of]
        probes = {name + table.suffix: place.point(at) for name, at in parts.probes.items() if name in of}
        same = {f.name for f in parts.flexures} & {f.name for f in flexures} | parts.probes.keys() & probes.keys()
        if same:
            section.refuse("suffix", f"must give every copy a name of its own, but two parts are called {min(same)}.")
        parts = _Parts(
            parts.bodies + bodies, parts.flexures + flexures, parts.fixed + fixed, parts.probes | probes
        )  # fmt: skip
    return parts


def _map_of(section: Section, table: CopyTable) -> RigidMap:
    """Motion of a [[copy]]: reflection, then rotation about a point, then translation."""
    x, y = table.mirror_x_mm, table.mirror_y_mm
    if x is not None and y is not None:
        section.refuse("mirror_y_mm", "must be left out beside mirror_x_mm; both together are turn_deg = 180.")
    turn_deg = table.turn_deg + (180.0 if y is not None else 0.0)
    turned = RigidMap(turn_deg, mirrored=x is not None or y is not None)
    # A reflection in y = b is one in x = 0, half a turn, and a translation by 2 b.
    first = RigidMap(table.turn_deg).point((2.0 * (x or 0.0) - table.about_mm[0], 2.0 * (y or 0.0) - table.about_mm[1]))
    (cx, cy), (dx, dy) = table.about_mm, table.by_mm
    return replace(turned, by_mm=(first[0] + cx + dx, first[1] + cy + dy))


def _moved(section: Section, face: Face, place: RigidMap, suffix: str) -> Face:
    if place.turn_deg % _QUARTER_DEG:
        section.refuse("turn_deg", f"must be a multiple of 90, because {face.name} is a box along x and y.")
    x0, x1, y0, y1 = face.box_mm
    (xa, ya), (xb, yb) = place.point((x0, y0)), place.point((x1, y1))
    return Face(face.name + suffix, (min(xa, xb), max(xa, xb), min(ya, yb), max(ya, yb)))


def _body(section: Section, body: BodyTable, name: str) -> tuple[list[_Step], str]:
    """Steps of a body, each with its name: one shape, or the outlines of a file, of which holes have no name.

    With a sentence on the unit of the file.
    """
    if not body.in_layers or min(body.in_layers) < 1 or len(set(body.in_layers)) < len(body.in_layers):
        section.refuse(
            "in_layers", f"must be numbers from 1, each once, such as [1, 2], but is {list(body.in_layers)}."
        )
    given = [key for key in _SHAPES if getattr(body, key)]
    if len(given) != 1:
        section.refuse(None, f"must have exactly one of {', '.join(_SHAPES)}, but has {' and '.join(given) or 'none'}.")
    if not body.outline:
        return [(body.name, (not body.cut, _shape(section, body, given[0])), body.in_layers)], ""
    shapes, words = read_outline(section.path.parent / body.outline, body.layer, body.unit_mm)
    return [(body.name if added else "", (added != body.cut, shape), body.in_layers) for added, shape in shapes], words


def _shape(section: Section, body: BodyTable, key: str) -> Shape:
    if body.polygon_mm is not None:
        corners = body.polygon_mm
        if body.bulges and len(body.bulges) != len(corners):
            section.refuse(
                "bulges", f"must be {len(corners)} numbers, one for each corner, but are {len(body.bulges)}."
            )
        polygon = Polygon(corners, body.bulges if any(body.bulges) else ())
        least = 2 if polygon.bulges else 3
        if len(corners) < least or len(set(corners)) < len(corners) or crosses_itself(polygon):
            words = "must go round three points or more without crossing itself, but does not; put its points in order"
            section.refuse(key, f"{words}, each once.")
        return polygon
    if body.bulges:
        section.refuse("bulges", f"must be left out beside {key}: only a polygon has arcs.")
    if body.bar_mm is not None:
        x0, y0, x1, y1 = body.bar_mm
        if (x0, y0) == (x1, y1):
            section.refuse(key, "must have two different end points, but has not.")
        return bar(x0, y0, x1, y1, section.number("width_mm", above=0.0))
    if body.box_mm is not None:
        return box(*_grown(section, key, body.box_mm))
    x, y, *radii, turned_deg = body.ellipse_mm or (*(body.disc_mm or ()), 0.0)
    if min(radii) <= 0.0:
        section.refuse(key, f"must have positive radii, but has {min(radii):g}.")
    return Ellipse((x, y), (radii[0], radii[-1]), turned_deg)


def _grown(section: Section, key: str, limits: Box, *, flat: bool = False) -> Box:
    """Check a rectangle given by its limits; with `flat`, its width or height may be zero."""
    x0, x1, y0, y1 = limits
    if not (x1 >= x0 and y1 >= y0 if flat else x1 > x0 and y1 > y0):
        section.refuse(
            key, "must be [x from, x to, y from, y to], each range from the smaller to the larger number, but is "
            f"[{x0:g}, {x1:g}, {y0:g}, {y1:g}]."
        )  # fmt: skip
    return limits


def _flexure(section: Section, table: FlexureTable, name: str) -> Flexure:
    kind: Any = table.kind  # one of the words that its field allows
    sizes = _FLEXURES[kind]
    for key in ("radius_mm", "half_length_mm", "depth_mm", "fillet_mm"):
        if (getattr(table, key) is not None) != (key in sizes):
            said = f"must be {'given' if key in sizes else 'left out'}"
            section.refuse(key, f"{said}: a flexure of the kind {table.kind} has thickness_mm, {', '.join(sizes)}.")
    half_length_mm = table.half_length_mm or table.radius_mm or 0.0
    depth_mm, fillet_mm = table.depth_mm or table.radius_mm or 0.0, table.fillet_mm or 0.0
    if fillet_mm > min(half_length_mm, depth_mm or fillet_mm):
        section.refuse("fillet_mm", f"must be at most half_length_mm and depth_mm, but is {fillet_mm:g}.")
    return Flexure(
        table.name or name.removeprefix("flexure "), kind, table.at_mm, table.axis_deg, table.thickness_mm,
        half_length_mm, depth_mm, fillet_mm, layer=table.layer,
    )  # fmt: skip


def _face(section: Section, table: FaceTable, name: str) -> Face:
    return Face(name, _grown(section, "box_mm", table.box_mm, flat=True))


def _contact(section: Section, table: ContactTable, name: str) -> Contact:
    face, wall, other = _face(section, table, name), table.wall_mm, table.against_box_mm
    if wall is not None and other is None:
        if wall[:2] == wall[2:]:
            section.refuse("wall_mm", "must be two different points, but both are the same.")
        return Contact(name, face, None, (wall[:2], wall[2:]))
    if other is None or wall is not None:
        section.refuse(
            None, "must have either against_box_mm (the other face) or wall_mm (two points of a rigid wall), but has "
            f"{'both' if wall is not None else 'none'}."
        )  # fmt: skip
    return Contact(name, face, Face(f"{name}, other face", _grown(section, "against_box_mm", other, flat=True)))


def _drive(section: Section, table: DriveTable, name: str) -> Drive:
    x, y = table.direction
    if hypot(x, y) == 0.0:
        section.refuse("direction", "must be a vector such as [1, 0], but is [0, 0].")
    if table.across == "free" and x * y != 0.0:
        section.refuse("across", "must be 'held', or 'free' if direction is along x or y, but is 'free'.")
    way = (x / hypot(x, y), y / hypot(x, y))
    across: Any = table.across  # words that their fields allow
    turns: Any = table.turns or (across if table.pin_mm is None else "free")
    face = _driven(section, table, name, turns)
    soft = table.stiffness_n_mm, table.force_n_per_input
    return Drive(face, way, across, table.per_input, turns, *soft, table.preload_n)


def _driven(section: Section, table: DriveTable, name: str, turns: str) -> Face:
    """Read the face or the pin of a drive."""
    if table.box_mm is not None and table.pin_mm is None:
        return Face(name, _grown(section, "box_mm", table.box_mm, flat=True))
    if table.box_mm is not None or table.pin_mm is None:
        given = "none" if table.box_mm is None else "both"
        section.refuse(None, f"must have either box_mm (a face) or pin_mm, but has {given}.")
    x, y, diameter = table.pin_mm
    if diameter <= 0.0:
        section.refuse("pin_mm", f"must be [x, y, diameter > 0], but is [{x:g}, {y:g}, {diameter:g}].")
    if turns == "held":
        section.refuse("turns", 'must be "free", as a pin does not hold a rotation.')
    half = 0.5 * diameter
    return Face(name, (x - half, x + half, y - half, y + half), is_pin=True)


def _ends(section: Section, pair: PairTable, probes: Mapping[str, Point]) -> tuple[str, str]:
    places, known = [probes.get(end) for end in pair.of], ", ".join(probes)
    if None in places or places[0] == places[1]:
        section.refuse("of", f"must be two of the probes {known} at different places, but is {list(pair.of)}.")
    return pair.of
