"""Outlines from DXF and SVG drawings, and outlines and solids for cutters and printers (DXF, SVG, STL).

Libraries: ezdxf (https://ezdxf.mozman.at) for DXF, svgelements (https://github.com/meerk40t/svgelements) for reading
SVG. Arcs of circles stay arcs; ellipses, splines and Bezier curves become arcs within 1 micrometre.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DataError, InputFileError, UsageError
from fingervision.domain.needed_library import needed_library
from fingervision.models.mechanism import SIZES_MM, Mechanism
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.plane_shapes import Curve, Point, Polygon, in_arcs
from fingervision.models.triangulate import triangulate

Array = NDArray[np.float64]
Vertex = tuple[Point, float]
"""A corner and the bulge of the side that begins there."""
Chain = tuple[list[Vertex], Point]
"""Vertices, and the point at which the last side ends."""

OUTLINES = (".dxf", ".svg")
"""Endings of the files that are read."""
EXPORTS = (*OUTLINES, ".stl")
"""Endings of the files that are written."""
_WITHIN_MM = 1e-3
"""Largest distance of the arcs that replace other curves."""
_JOINED, _EQUALLY = 1e-5, 0.1
"""Distance below which two ends of lines meet, as a share of the drawing's size: CAD programs round to 6 digits; share
of it within which two ends are equally near."""
_MM = {"mm": 1.0, "cm": 10.0, "in": 25.4, "pt": 25.4 / 72.0, "pc": 25.4 / 6.0}
_LARGEST_MM = 1000.0
"""Size above which a unit other than mm must be stated: a part of 80 mm whose header says inches would have 2 m."""
_DXF_UNITS = {"mm": 1.0, "metres": 1000.0, "micrometres": 1e-3}
"""Units in which mechanisms are drawn, and their length in mm."""
_MM_WORDS = "millimeters"
_ACROSS, _BODY = 4.0, 0.025
"""Triangles of a solid across thin parts, and their size over the body's size."""


class Outline(NamedTuple):
    """Closed outlines of a drawing.

    Parameters
    ----------
    steps : tuple of (bool, Polygon)
        Shapes that are added (the body) or removed (its holes), in order.
    unit_words : str
        Sentence on the unit of a DXF file, where only its header states it.
    """

    steps: tuple[tuple[bool, Polygon], ...]
    unit_words: str


def read_outline(path: Path, layer: str = "", unit_mm: float | None = None) -> Outline:
    """Read the closed outlines of a drawing.

    Parameters
    ----------
    path : Path
        A DXF file, of which lines, arcs, circles, ellipses, splines and polylines are read, or an SVG file, with y
        upwards from the lower edge of its page.
    layer : str
        Layer of the DXF file that is read; all that are visible by default.
    unit_mm : float or None
        Length of the file's unit in mm; None takes the unit that the file states (a DXF file without one is in mm).

    Raises
    ------
    DataError, InputFileError, MissingLibraryError
        The file cannot be read, states no unit (SVG), its lines do not form closed outlines, or the unit of its header
        (DXF) makes a size that mechanisms do not have.
    """
    if not path.is_file():
        raise InputFileError(f"There is no drawing {path}.")
    read = {".dxf": _dxf_chains, ".svg": _svg_chains}.get(path.suffix.lower())
    if read is None:
        raise DataError(f"An outline must be a {' or '.join(OUTLINES)} file, but is {path}.")
    every, unit = read(path, layer, unit_mm)
    chains = [chain for chain in every if chain[0]]
    if not chains:
        of = f" on layer {layer}" if layer else ""
        raise DataError(f"{path} must hold lines or curves{of}, but holds none.")
    loops = sorted(_closed(chains, path), key=lambda loop: -abs(_area(loop)))
    # A loop inside an odd number of others is a hole.
    depth = [sum(outer.holds(_inside(loop))[0] for outer in loops[:place]) for place, loop in enumerate(loops)]
    steps = tuple((deep % 2 == 0, loop) for deep, loop in zip(depth, loops, strict=True))
    return Outline(steps, "" if unit is None else _unit_words(path, unit, PlanarRegion(steps).size_mm))


def _unit_words(path: Path, unit: tuple[str, float], size_mm: float) -> str:
    """Sentence on the unit that a DXF file's header states: its words, and its length in mm.

    Raises
    ------
    DataError
        The outline is smaller or larger with it than mechanisms are.
    """
    words, mm = unit
    least, most = SIZES_MM[0], SIZES_MM[1] if mm == 1.0 else _LARGEST_MM
    if not least <= size_mm <= most:
        guess = next((name for name, one in _DXF_UNITS.items() if least <= size_mm * one / mm <= _LARGEST_MM), "mm")
        raise DataError(
            f"{path} must be {least:g} to {most:g} mm large, but its header states {words}, with which it is "
            f"{size_mm:.5g} mm across: are its lengths {guess}? State unit_mm = {_DXF_UNITS[guess]:g} beside it "
            f"(--unit-mm {_DXF_UNITS[guess]:g} where a drawing is begun)."
        )
    if words == _MM_WORDS:
        return ""
    return (
        f"{path.name}: its header states {words}, with which it is {size_mm:.4g} mm across; state unit_mm if the unit "
        "is another."
    )


def _library(name: str, path: Path) -> Any:
    return needed_library(name, "outlines", f"{path} is a drawing, which")


def _dxf_chains(path: Path, layer: str, unit_mm: float | None) -> tuple[list[Chain], tuple[str, float] | None]:
    ezdxf = _library("ezdxf", path)
    try:
        document = ezdxf.readfile(path)
    except (OSError, ezdxf.DXFError, UnicodeDecodeError) as error:
        raise DataError(f"{path} must be a DXF drawing, but could not be read: {str(error).rstrip('.')}.") from error
    unit = _dxf_unit(ezdxf.units, document.units, path) if unit_mm is None else ("", unit_mm)
    layers = {each.dxf.name.lower(): each.is_on() and not each.is_frozen() for each in document.layers}
    if layer and layer.lower() not in layers:
        raise DataError(f"{path} must have the layer {layer}, but has {', '.join(sorted(layers))}.")
    of_layer = [(entity, entity.dxf.layer.lower()) for entity in document.modelspace()]
    shown = [entity for entity, own in of_layer if (own == layer.lower() if layer else layers.get(own, True))]
    chains = [chain for entity in shown for chain in _entity_chains(entity, unit[1])]
    return chains, unit if unit_mm is None else None


def _dxf_unit(units: Any, number: int, path: Path) -> tuple[str, float]:
    """Unit of a DXF file by the number in its header: its words, and its length in mm."""
    if not number:
        return "no unit, and mm are taken", 1.0
    try:
        return units.unit_name(number).lower(), round(units.conversion_factor(number, 4), 9)
    except (ValueError, TypeError):
        raise DataError(f"{path} must state a unit of length, but has the number {number}: state unit_mm.") from None


def _entity_chains(entity: Any, unit_mm: float) -> Iterator[Chain]:
    kind = entity.dxftype()

    def at(t: Array) -> Array:
        points = entity.construction_tool().points(t) if kind == "SPLINE" else entity.vertices(t)
        return unit_mm * np.array([[p.x, p.y] for p in points]).T

    if kind == "LINE":
        yield _chain(lambda t: unit_mm * np.array([entity.dxf.start, entity.dxf.end])[t.astype(int), :2].T, [0.0, 1.0])
    elif kind == "ARC":
        first, last = entity.dxf.start_angle, entity.dxf.end_angle
        yield _chain(at, np.linspace(first, first + ((last - first) % 360.0 or 360.0), 3))
    elif kind == "CIRCLE":
        yield _chain(at, np.linspace(0.0, 360.0, 3))
    elif kind == "ELLIPSE":
        first, last = entity.dxf.start_param, entity.dxf.end_param
        yield _chain(at, np.linspace(first, first + ((last - first) % (2.0 * np.pi) or 2.0 * np.pi), 3))
    elif kind == "SPLINE":
        yield _chain(at, np.unique(np.clip(entity.construction_tool().knots(), 0.0, entity.construction_tool().max_t)))
    elif kind in ("LWPOLYLINE", "POLYLINE", "INSERT"):
        for part in entity.virtual_entities():
            yield from _entity_chains(part, unit_mm)


def _svg_chains(path: Path, layer: str, unit_mm: float | None) -> tuple[list[Chain], None]:
    svgelements = _library("svgelements", path)
    if layer:
        raise DataError(f"{path} is an SVG drawing, which has no layers: leave out layer = {layer!r}.")
    try:
        page = svgelements.SVG.parse(str(path))
    except (OSError, SyntaxError, ValueError) as error:
        raise DataError(f"{path} must be an SVG drawing, but could not be read: {error}.") from error
    stated = re.fullmatch(rf"\s*([\d.eE+-]+)\s*({'|'.join(_MM)})\s*", str(page.values.get("width", "")))
    if unit_mm is not None:
        mm = unit_mm * (page.viewbox.width / page.width if page.viewbox is not None else 1.0)
    elif stated is not None:
        mm = float(stated[1]) * _MM[stated[2]] / page.width
    else:
        raise DataError(f"The page of {path} must have a width in mm, cm or in, but has none: state unit_mm.")
    shapes = [svgelements.Path(each) for each in page.elements() if isinstance(each, svgelements.Shape)]
    for outline in shapes:
        outline.reify()
    parts = [part for outline in shapes for part in outline if not isinstance(part, svgelements.Move)]
    curves = [_svg_points(part, mm, page.height) for part in parts if part.start != part.end]
    return [_chain(curve, [0.0, 0.5, 1.0]) for curve in curves], None


def _svg_points(part: Any, mm: float, height: float) -> Callable[[Array], Array]:
    return lambda t: mm * np.array([[p.x, height - p.y] for p in map(part.point, t.tolist())]).T


def _chain(at: Callable[[Array], Array], stops: Sequence[float] | Array) -> Chain:
    """Replace a curve, piece by piece between its stops, by arcs."""
    vertices = [vertex for a, b in pairwise(stops) for vertex in in_arcs(at, a, b, _WITHIN_MM)]
    end = at(np.array([stops[-1]]))[:, 0]
    return vertices, (float(end[0]), float(end[1]))


def _closed(chains: list[Chain], path: Path) -> list[Polygon]:
    """Join chains of which one ends where the next begins, in either direction, to closed polygons."""
    points = np.array([at for vertices, end in chains for at in (*(v[0] for v in vertices), end)])
    same_mm = _JOINED * float(np.hypot(*np.ptp(points, axis=0)))
    ends = np.array([(vertices[0][0], end) for vertices, end in chains])
    left, loops = set(range(len(chains))), []
    while left:
        vertices, end = chains[first := left.pop()]
        vertices = list(vertices)
        # Where shapes were united, sides may be shorter than ends may be apart: the nearest end is the next one.
        while True:
            away = sorted((float(np.hypot(*(ends[n, side] - end))), n, side) for n in left for side in (0, 1))
            home_mm = float(np.hypot(*np.subtract(end, ends[first, 0])))
            if home_mm <= min(same_mm, away[0][0] if away else same_mm):
                break
            near = [each for each in away if each[0] <= min(same_mm, away[0][0] + _EQUALLY * same_mm)]
            if len(near) != 1:
                what = "ends" if not near else "branches"
                raise DataError(
                    f"Lines of {path} must form closed outlines, but one {what} at ({end[0]:.6g}, {end[1]:.6g}) mm; "
                    "join it there, or put construction lines on another layer and state the outline's (layer = ... "
                    "beside it, --layer where a drawing is begun)."
                )
            _, n, side = near[0]
            left.discard(n)
            more, end = chains[n] if side == 0 else _reversed(chains[n])
            vertices += more
        loops.append(_simplified(_without_short(vertices, same_mm)))
    return loops


def _without_short(vertices: list[Vertex], same_mm: float) -> list[Vertex]:
    """Vertices without those whose side is shorter than ends may be apart, as unions of shapes leave them."""
    after = [at for at, _ in (*vertices[1:], vertices[0])]
    return [
        (at, bulge)
        for (at, bulge), end in zip(vertices, after, strict=True)
        if np.hypot(*np.subtract(end, at)) > same_mm or abs(bulge) > 1.0
    ]


def _reversed(chain: Chain) -> Chain:
    vertices, end = chain
    starts = [end, *(at for at, _ in reversed(vertices))]
    return [(at, -bulge) for at, (_, bulge) in zip(starts, reversed(vertices), strict=False)], vertices[0][0]


def _simplified(vertices: list[Vertex]) -> Polygon:
    """Polygon without the corners between two straight sides in line, which would divide the sides of a strip."""
    kept = []
    for place, (at, bulge) in enumerate(vertices):
        (before, bulge_before), (after, _) = vertices[place - 1], vertices[(place + 1) % len(vertices)]
        (ax, ay), (bx, by) = np.subtract(at, before), np.subtract(after, at)
        in_line = abs(ax * by - ay * bx) <= _JOINED * abs(ax * bx + ay * by) and ax * bx + ay * by > 0.0
        if bulge or bulge_before or not in_line:
            kept.append((at, bulge))
    return Polygon(tuple(at for at, _ in kept), tuple(bulge for _, bulge in kept))


def _area(polygon: Polygon) -> float:
    x, y = _chords(polygon.curves())
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def _inside(polygon: Polygon) -> Array:
    """A point of the outline, which lies inside every loop around it; shape (2, 1)."""
    curve = polygon.curves()[0]
    return curve.at(np.array([0.5 * (curve.t0 + curve.t1)]))


def _chords(curves: Iterable[Curve]) -> Array:
    return np.concatenate([c.at(np.linspace(c.t0, c.t1, 2 if c.is_straight else 17))[:, :-1] for c in curves], axis=1)


def write_outline(path: Path, mechanism: Mechanism) -> str:
    """Write the outline of a mechanism as DXF or SVG, or its plate as STL; lengths are in mm. Return what was written.

    Raises
    ------
    MissingLibraryError, UsageError
        A library is not installed, or the file's ending is another one.
    """
    region, kind = PlanarRegion(mechanism.region.steps), path.suffix.lower()
    if mechanism.layers:
        raise UsageError(f"--export writes one layer, but {mechanism.name} has several: export a drawing of each.")
    if kind not in EXPORTS:
        raise UsageError(f"--export must name a {', '.join(EXPORTS)} file, but names {path}.")
    if kind == ".stl":
        count = _write_stl(path, region, mechanism.plate_mm)
        return f"{path}: {count} triangles, {mechanism.plate_mm:g} mm thick"
    loops = [[vertex for curve in loop.curves for vertex in _arcs_of(curve)] for loop in region.loops]
    points = _chords(curve for loop in region.loops for curve in loop.curves)
    low, high = points.min(axis=1), points.max(axis=1)
    if kind == ".svg":
        path.write_text(_svg(loops, low, high), encoding="utf-8")
    else:
        document = _library("ezdxf", path).new(units=4)
        for vertices in loops:
            document.modelspace().add_lwpolyline([(*at, bulge) for at, bulge in vertices], format="xyb", close=True)
        document.saveas(path)
    wide, tall = high - low
    return f"{path}: {len(loops)} closed outlines, {wide:.6g} by {tall:.6g} mm"


def _arcs_of(curve: Curve) -> list[Vertex]:
    return _chain(curve.at, np.linspace(curve.t0, curve.t1, 2 if curve.is_straight else 3))[0]


def _svg(loops: Iterable[list[Vertex]], low: Array, high: Array) -> str:
    """Text of an SVG drawing in mm, with the lower left corner of the outline at that of the page."""
    (left, top), (wide, tall) = (low[0], high[1]), high - low
    words = []
    for vertices in loops:
        (x, y), _ = vertices[0]
        words.append(f"M{x - left:.6f} {top - y:.6f}")
        for (start, bulge), (end, _) in zip(vertices, [*vertices[1:], vertices[0]], strict=True):
            to = f"{end[0] - left:.6f} {top - end[1]:.6f}"
            radius = np.hypot(*np.subtract(end, start)) * (1.0 + bulge**2) / (4.0 * abs(bulge)) if bulge else 0.0
            words.append(f"A{radius:.6f} {radius:.6f} 0 0 {int(bulge < 0.0)} {to}" if bulge else f"L{to}")
        words.append("Z")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide:.6f}mm" height="{tall:.6f}mm" '
        f'viewBox="0 0 {wide:.6f} {tall:.6f}">\n<path d="{" ".join(words)}" fill="none" stroke="black" '
        'stroke-width="0.1"/>\n</svg>\n'
    )


def _write_stl(path: Path, region: PlanarRegion, plate_mm: float) -> int:
    """Write the plate as a closed surface of flat triangles (binary STL); return their number."""
    mesh = triangulate(region, _ACROSS, _BODY * region.size_mm)
    a, b, c, ab, bc, ac = mesh.triangles
    flat = np.concatenate([[a, ab, ac], [ab, b, bc], [ac, bc, c], [ab, bc, ac]], axis=1)
    edges = np.concatenate([flat[[0, 1]], flat[[1, 2]], flat[[2, 0]]], axis=1)
    # An edge of the outline belongs to one triangle only.
    known = set(zip(*edges.tolist(), strict=True))
    p, q = np.array([(i, j) for i, j in known if (j, i) not in known]).T
    low = np.vstack([mesh.nodes_mm, np.zeros(mesh.nodes_mm.shape[1])]).T
    high = low + np.array([0.0, 0.0, plate_mm])
    faces = [low[flat[::-1]], high[flat], np.stack([low[p], low[q], high[q]]), np.stack([low[p], high[q], high[p]])]
    corners = np.concatenate(faces, axis=1).transpose(1, 0, 2)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    record = np.zeros(len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("none", "<u2")])
    record["normal"] = normals / np.linalg.norm(normals, axis=1)[:, None]
    record["corners"] = corners
    header = b"fingervision, mm".ljust(80) + np.uint32(len(record)).tobytes()
    path.write_bytes(header + record.tobytes())
    return len(record)
