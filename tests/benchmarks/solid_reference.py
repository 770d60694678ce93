"""A mechanism in three dimensions by CalculiX: quadratic wedge elements, independent of the models of the package.

The plane mesh is finer than that of the model. Half of the plate is meshed: its middle plane stays plane for motions in
the plane, and cannot move in the plane for motions out of it. Fixed faces are fixed in all directions, sliding faces in
their constrained direction. Equations for the nodes of a driven face say what it may do; the force is the reaction of
the fixed faces.
"""

import subprocess
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.models.mechanism import Drive, Face, Mechanism
from fingervision.models.planar_region import sharp_corners_mm
from fingervision.models.plane_stress import element_weights
from fingervision.models.triangulate import PlaneMesh

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_ON = 1e-6
_MIDDLES = ((0, 1), (1, 2), (0, 2))


@dataclass(frozen=True, slots=True)
class SolidAnswer:
    """Results of the three-dimensional model.

    Parameters
    ----------
    force_n : float
        Force at the drive.
    probes_mm : dict of str to (float, float)
        Motion of each probe, in the element of the middle plane in which it lies.
    stress_mpa : float
        Largest von Mises stress in the flexures at any depth, without what is within half a thickness of sharp corners.
    modes_hz : dict of str to tuple of float
        Natural frequencies in the plane with the drive `free` and `held`, and with fixed drive `out` of the plane.
    """

    force_n: float
    probes_mm: dict[str, tuple[float, float]]
    stress_mpa: float
    modes_hz: dict[str, tuple[float, ...]]


class Wedges:
    """Fifteen-node wedge elements on a plane mesh, from the middle plane up, in layers that are thinner at the surface.

    Parameters
    ----------
    mesh : PlaneMesh
        Quadratic triangles.
    plate_mm : float
        Thickness of the plate.
    layers : int
        Number of layers in half the plate.
    """

    def __init__(self, mesh: PlaneMesh, plate_mm: float, layers: int) -> None:
        self.plane, self.layers = mesh, layers
        count = mesh.nodes_mm.shape[1]
        corners = np.unique(mesh.triangles[:3])
        levels = 0.5 * plate_mm * np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, layers + 1))
        levels = np.sort(np.concatenate([levels, 0.5 * (levels[1:] + levels[:-1])]))
        number = np.zeros((2 * layers + 1, count), dtype=np.int64)
        places: list[Array] = []
        planes: list[Indices] = []
        for level, z in enumerate(levels):
            nodes = np.arange(count) if level % 2 == 0 else corners
            number[level, nodes] = 1 + sum(part.shape[0] for part in places) + np.arange(nodes.size)
            places.append(np.vstack([mesh.nodes_mm[:, nodes], np.full(nodes.size, z)]).T)
            planes.append(nodes)
        self.nodes_mm: Array = np.vstack(places)
        self.plane_node: Indices = np.concatenate(planes)
        self.middle: Indices = number[0]
        a, b, c, ab, bc, ac = mesh.triangles
        rows = []
        for layer in range(layers):
            low, half, high = number[2 * layer : 2 * layer + 3]
            rows.append([low[a], low[b], low[c], high[a], high[b], high[c], low[ab], low[bc], low[ac],
                         high[ab], high[bc], high[ac], half[a], half[b], half[c]])  # fmt: skip
        self.elements: Indices = np.hstack([np.array(row) for row in rows]).T

    def on(self, face: Face, size_mm: float) -> Indices:
        """Nodes of the outline in the box of a face, at every depth."""
        x, y = self.plane.nodes_mm
        x0, x1, y0, y1 = face.box_mm
        near = _ON * size_mm
        inside = (x >= x0 - near) & (x <= x1 + near) & (y >= y0 - near) & (y <= y1 + near)
        return np.flatnonzero((inside & _on_outline(self.plane))[self.plane_node]) + 1

    def mean_over(self, nodes: Indices) -> dict[int, float]:
        """Weights of the nodes of a side face in its mean motion, from the eight-node faces of the wedges."""
        on = np.zeros(len(self.nodes_mm) + 1, dtype=bool)
        on[nodes] = True
        weights: dict[int, float] = {}
        for corners, middles in _SIDES:
            sides = self.elements[:, [*corners, *middles]]
            for side in sides[on[sides].all(axis=1)]:
                a, b, _, d = (self.nodes_mm[node - 1] for node in side[:4])
                area = float(np.linalg.norm(np.cross(b - a, d - a)))
                for node, share in zip(side.tolist(), (-1 / 12,) * 4 + (1 / 3,) * 4, strict=True):
                    weights[node] = weights.get(node, 0.0) + share * area
        whole = sum(weights.values())
        return {node: weight / whole for node, weight in weights.items()}


_SIDES = tuple(((a, b, b + 3, a + 3), (6 + a, 12 + b, 9 + a, 12 + a)) for a, b in ((0, 1), (1, 2), (2, 0)))
"""Corners and middles of the three side faces among the fifteen nodes of a wedge."""


def _on_outline(mesh: PlaneMesh) -> NDArray[np.bool_]:
    """Whether nodes belong to an edge of only one triangle."""
    edges = np.hstack([np.vstack([np.sort(mesh.triangles[list(pair)], axis=0), mesh.triangles[3 + place]])
                       for place, pair in enumerate(_MIDDLES)])  # fmt: skip
    _, first, counts = np.unique(edges[:2], axis=1, return_index=True, return_counts=True)
    found = np.zeros(mesh.nodes_mm.shape[1], dtype=bool)
    found[edges[:, first[counts == 1]].ravel()] = True
    return found


def solid_answer(
    mechanism: Mechanism,
    mesh: PlaneMesh,
    *,
    layers: int = 2,
    modes: tuple[str, ...] = ("held", "out"),
    count: int = 2,
    input_mm: float = 1.0,
    large: bool = False,
) -> SolidAnswer:
    """Run CalculiX for one input and for the natural frequencies, if any are asked for.

    Parameters
    ----------
    mechanism : Mechanism
        Drawing of a mechanism that is driven along x or y.
    mesh : PlaneMesh
        Triangles of the drawing.
    layers : int
        Number of wedges through half the plate.
    modes : tuple of str
        Which natural frequencies, see `SolidAnswer`.
    count : int
        Number of natural frequencies of each.
    input_mm : float
        Motion of the drive.
    large : bool
        Whether the equilibrium is that of the deformed shape.
    """
    if len(mechanism.drives) > 1:
        raise ValueError("several drives are checked by their energy: tests/models/test_several_drives.py")
    body = Wedges(mesh, mechanism.plate_mm, layers)
    watched = {name: element_weights(mesh.nodes_mm, mesh.triangles, at) for name, at in mechanism.probes.items()}
    sets = _sets(mechanism, body) | {"WATCHED": body.middle[np.unique([nodes for nodes, _ in watched.values()])]}
    driven = mechanism.drives[0]
    along = 1 if driven.direction[0] != 0.0 else 2
    axes = [1 + "xy".index(component) for _, component in mechanism.slides]
    if along in axes:
        raise ValueError("the fixed faces must take the whole force")
    free, ref = len(body.nodes_mm) + 1, len(body.nodes_mm) + 2
    lines = ["*NODE, NSET=ALL", *(f"{i},{x:.12g},{y:.12g},{z:.12g}" for i, (x, y, z) in enumerate(body.nodes_mm, 1))]
    lines += [f"{free},0,0,0", f"{ref},0,0,0", "*ELEMENT, TYPE=C3D15, ELSET=BODY"]
    lines += [f"{i}," + ",".join(map(str, row)) for i, row in enumerate(body.elements.tolist(), 1)]
    for name, members in sets.items():
        lines += [f"*NSET, NSET={name}", *(f"{node}," for node in members.tolist())]
    material = mechanism.material
    lines += ["*MATERIAL, NAME=BULK", "*ELASTIC", f"{material.youngs_modulus_mpa:.12g},{material.poisson_ratio:.12g}"]
    lines += ["*DENSITY", f"{material.density_t_mm3:.12g}", "*SOLID SECTION, ELSET=BODY, MATERIAL=BULK"]
    supports = [f"FIXED{i},1,3" for i in range(len(mechanism.fixed))]
    supports += [f"SLIDE{i},{axis},{axis}" for i, axis in enumerate(axes)]
    in_plane = [*_equations(driven, body, sets["DRIVE"], along, free, ref), "*BOUNDARY", *supports, "MIDDLE,3,3"]
    sign = driven.direction[along - 1]
    static = ["*STEP, NLGEOM", "*STATIC", "0.5,1."] if large else ["*STEP", "*STATIC"]
    static += ["*BOUNDARY", f"{free},{along},{along},{sign * input_mm:.12g}", f"{ref},{3 - along},{3 - along}"]
    static += ["*NODE PRINT, NSET=WATCHED, FREQUENCY=100", "U", "*EL FILE, FREQUENCY=100", "S"]
    for i in range(len(mechanism.fixed)):
        static += [f"*NODE PRINT, NSET=FIXED{i}, TOTALS=ONLY, FREQUENCY=100", "RF"]
    still = {
        "held": [*in_plane, f"{free},{along},{along}", f"{ref},{3 - along},{3 - along}"],
        "free": [*in_plane, f"{ref},{3 - along},{3 - along}"],
        "out": ["*BOUNDARY", *supports, "MIDDLE,1,2", "DRIVE,1,3"],
    }
    vibrating = ["*STEP", "*FREQUENCY", f"{count}", "*END STEP"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        moved, force = _static(_run(folder, "static", [*lines, *in_plane, *static, "*END STEP"]), -2.0 * sign, along)
        stress = _peak(mechanism, body, _nodal_stress(folder / "static.frd", len(body.nodes_mm)))
        found = {kind: _frequencies(_run(folder, kind, [*lines, *still[kind], *vibrating])) for kind in modes}
    probes: dict[str, tuple[float, float]] = {}
    for name, (nodes, weights) in watched.items():
        x, y = weights @ np.array([moved[node] for node in body.middle[nodes].tolist()])
        probes[name] = (float(x), float(y))
    return SolidAnswer(force, probes, stress, found)


def _sets(mechanism: Mechanism, body: Wedges) -> dict[str, Indices]:
    size_mm = mechanism.region.size_mm
    sets = {"DRIVE": body.on(mechanism.drives[0].face, size_mm), "MIDDLE": body.middle}
    sets |= {f"FIXED{i}": body.on(face, size_mm) for i, face in enumerate(mechanism.fixed)}
    return sets | {f"SLIDE{i}": body.on(face, size_mm) for i, (face, _) in enumerate(mechanism.slides)}


def _equations(driven: Drive, body: Wedges, nodes: Indices, along: int, free: int, ref: int) -> list[str]:
    """What a driven face may do: sums of motions of its nodes that are those of two nodes without mass.

    Node `free` has the motion along the drive, node `ref` the motion across it, which is zero where it is held.
    """
    places = body.nodes_mm[nodes - 1]
    across = 3 - along
    weights = body.mean_over(nodes)
    mean = np.array([weights.get(node, 0.0) for node in nodes.tolist()])
    sums: list[tuple[int, Array, int]] = []
    is_along = np.ptp(places[:, across - 1]) < _ON * np.ptp(places[:, :2])
    if driven.turns == "free" or (is_along and driven.across == "free"):
        sums = [(along, mean, free)] + ([(across, mean, ref)] if driven.across == "held" else [])
        if driven.turns == "held":
            level = places[:, along - 1]
            sums.append((across, mean * (level - mean @ level), 0))
    else:
        each = np.eye(nodes.size)
        sums = [(along, row, free) for row in each]
        sums += [(across, row, ref) for row in each] if driven.across == "held" else []
    lines: list[str] = []
    for axis, row, other in sums:
        terms = [f"{nodes[place]},{axis},{row[place]:.12g}" for place in np.argsort(-np.abs(row)) if row[place] != 0.0]
        terms += [f"{other},{axis},-1"] if other else []
        lines += ["*EQUATION", f"{len(terms)}", *terms]
    return lines


def _peak(mechanism: Mechanism, body: Wedges, mises_mpa: Array) -> float:
    """Largest stress in the flexures, or anywhere without flexures, half a thickness away from sharp corners."""
    points = body.nodes_mm[:, :2].T
    near_mm = 0.5 * min((flexure.thickness_mm for flexure in mechanism.flexures), default=0.0)
    zones = [flexure.zone(mechanism.plate_mm) for flexure in mechanism.flexures]
    zones = [replace(zone, half_height_mm=zone.half_height_mm + _ON * near_mm) for zone in zones]
    inside = np.any([zone.holds(points) for zone in zones] or [np.ones(points.shape[1], dtype=bool)], axis=0)
    for corner in sharp_corners_mm(mechanism.region):
        inside &= np.hypot(points[0] - corner[0], points[1] - corner[1]) >= near_mm
    return float(mises_mpa[inside].max())


def _run(folder: Path, job: str, lines: list[str]) -> str:
    (folder / f"{job}.inp").write_text("\n".join(lines) + "\n", encoding="ascii")
    subprocess.run(["ccx", job], cwd=folder, check=True, capture_output=True, timeout=1200)
    return (folder / f"{job}.dat").read_text(encoding="ascii", errors="replace")


def _static(text: str, sign: float, along: int) -> tuple[dict[int, tuple[float, float]], float]:
    moved: dict[int, tuple[float, float]] = {}
    force = 0.0
    for line in text.splitlines():
        cells = line.split()
        if len(cells) == 4 and cells[0].isdigit():
            moved[int(cells[0])] = (float(cells[1]), float(cells[2]))
        elif len(cells) == 3 and not cells[0][0].isalpha():
            force += sign * float(cells[along - 1])
    return moved, force


def _frequencies(text: str) -> tuple[float, ...]:
    found = []
    for line in text.splitlines():
        cells = line.split()
        if len(cells) == 5 and cells[0].isdigit():
            found.append(float(cells[3]))
        elif "P A R T I C I P A T I O N" in line:
            break
    return tuple(found)


def _nodal_stress(path: Path, nodes: int) -> Array:
    """Von Mises stress at every node, from the fixed columns of a .frd file."""
    found = np.zeros(nodes)
    reading = False
    for line in path.read_text(encoding="ascii", errors="replace").splitlines():
        if line.startswith(" -4  STRESS"):
            reading = True
        elif line.startswith(" -3"):
            reading = False
        elif reading and line.startswith(" -1"):
            xx, yy, zz, xy, yz, zx = (float(line[13 + 12 * i : 25 + 12 * i]) for i in range(6))
            squares = 0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * (xy**2 + yz**2 + zx**2)
            found[int(line[3:13]) - 1] = squares**0.5
    return found
