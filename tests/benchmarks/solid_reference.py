"""A mechanism in three dimensions by CalculiX: quadratic wedge elements, independent of the models of the package.

The plane mesh is finer than that of the model. Fixed faces are fixed in all directions, sliding faces in their
constrained direction. A face parallel to its drive's direction is driven in its mean motion, as in the models, by an
equation for its nodes; the force is then the reaction of the fixed faces.
"""

import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.models.mechanism import Face, Mechanism
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
        Motion of each probe, at the nearest node of the middle plane.
    modes : tuple of (float, bool)
        Natural frequencies with fixed drive, each with a flag that is True for out-of-plane modes.
    """

    force_n: float
    probes_mm: dict[str, tuple[float, float]]
    modes: tuple[tuple[float, bool], ...]


class Wedges:
    """Fifteen-node wedge elements on a plane mesh, in layers that are thinner at the plate's faces.

    Parameters
    ----------
    mesh : PlaneMesh
        Quadratic triangles.
    plate_mm : float
        Thickness of the plate.
    layers : int
        Number of layers, even so that the middle plane contains nodes.
    """

    def __init__(self, mesh: PlaneMesh, plate_mm: float, layers: int) -> None:
        self.plane, self.layers = mesh, layers
        count = mesh.nodes_mm.shape[1]
        corners = np.unique(mesh.triangles[:3])
        levels = 0.5 * plate_mm * np.sin(0.5 * np.pi * np.linspace(-1.0, 1.0, layers + 1))
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
        self.middle: Indices = number[layers]
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
    layers: int = 4,
    modes: int = 2,
    input_mm: float = 1.0,
    large: bool = False,
) -> SolidAnswer:
    """Run CalculiX for one input and for the natural frequencies, if any are asked for.

    Parameters
    ----------
    mechanism : Mechanism
        Drawing of a mechanism that is driven along x or y, with the perpendicular motion free or fixed.
    mesh : PlaneMesh
        Triangles of the drawing.
    layers, modes : int
        Number of wedges through the plate, and number of natural frequencies.
    input_mm : float
        Motion of the drive.
    large : bool
        Whether the equilibrium is that of the deformed shape.
    """
    if len(mechanism.drives) > 1:
        raise ValueError("several drives are checked by their energy: tests/models/test_several_drives.py")
    size_mm = mechanism.region.size_mm
    body = Wedges(mesh, mechanism.plate_mm, layers)
    driven = mechanism.drives[0]
    drive = body.on(driven.face, size_mm)
    lines = ["*NODE, NSET=ALL", *(f"{i},{x:.12g},{y:.12g},{z:.12g}" for i, (x, y, z) in enumerate(body.nodes_mm, 1))]
    lines.append("*ELEMENT, TYPE=C3D15, ELSET=BODY")
    lines += [f"{i}," + ",".join(map(str, row)) for i, row in enumerate(body.elements.tolist(), 1)]
    sets = {"DRIVE": drive} | {f"FIXED{i}": body.on(face, size_mm) for i, face in enumerate(mechanism.fixed)}
    sets |= {f"SLIDE{i}": body.on(face, size_mm) for i, (face, _) in enumerate(mechanism.slides)}
    watched = {name: int(body.middle[_nearest(mesh, point)]) for name, point in mechanism.probes.items()}
    sets |= {"WATCHED": np.array(sorted(set(watched.values())))}
    for name, members in sets.items():
        lines += [f"*NSET, NSET={name}", *(f"{node}," for node in members.tolist())]
    material = mechanism.material
    lines += ["*MATERIAL, NAME=BULK", "*ELASTIC", f"{material.youngs_modulus_mpa:.12g},{material.poisson_ratio:.12g}"]
    lines += ["*DENSITY", f"{material.density_t_mm3:.12g}", "*SOLID SECTION, ELSET=BODY, MATERIAL=BULK", "*BOUNDARY"]
    lines += [f"FIXED{i},1,3" for i in range(len(mechanism.fixed))]
    axes = [1 + "xy".index(component) for _, component in mechanism.slides]
    lines += [f"SLIDE{i},{axis},{axis}" for i, axis in enumerate(axes)]
    across = 1 if driven.across == "held" else 0
    along = 1 if driven.direction[0] != 0.0 else 2
    sign = driven.direction[along - 1]
    kept = [f"DRIVE,{3 - along},{3 - along}"] if across else []
    spread = np.ptp(body.nodes_mm[drive - 1][:, :2], axis=0)
    in_mean = not across and (driven.turns == "free" or spread[along - 1] > _ON * size_mm)
    moved_by = f"{along},{along},{sign * input_mm:.12g}"
    pushed, reacting = f"DRIVE,{moved_by}", ["DRIVE"]
    unequal = list(lines)
    if in_mean:
        if any(axis == along for axis in axes):
            raise ValueError("a face driven in the mean needs fixed faces that take the whole force")
        weights = sorted(body.mean_over(drive).items(), key=lambda item: -item[1])
        count = len(body.nodes_mm) + 1
        lines[1:1] = [f"{count},0,0,0"]
        lines += ["*EQUATION", f"{len(weights) + 1}", *(f"{node},{along},{w:.12g}" for node, w in weights)]
        lines += [f"{count},{along},-1"]
        pushed, reacting = (
            f"{count},{along},{along},{sign * input_mm:.12g}",
            [f"FIXED{i}" for i in range(len(mechanism.fixed))],
        )
    # Nodes of the middle plane stay in this plane; otherwise a body with sliding faces only could drift away.
    static = ["*STEP, NLGEOM", "*STATIC", "0.5,1."] if large else ["*STEP", "*STATIC"]
    static += ["*BOUNDARY", pushed, "DRIVE,3,3", *kept, "*NODE PRINT, NSET=WATCHED, FREQUENCY=100", "U"]
    for name in reacting:
        static += [f"*NODE PRINT, NSET={name}, TOTALS=ONLY, FREQUENCY=100", "RF"]
    static += ["*END STEP"]
    vibrating = ["*BOUNDARY", "DRIVE,1,3", "*STEP", "*FREQUENCY", f"{modes}", "*NODE FILE", "U", "*END STEP"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        moved, force = _static(_run(folder, "static", [*lines, *static], ".dat"), -sign if in_mean else sign, along)
        text = _run(folder, "modes", [*unequal, *vibrating], ".dat") if modes else ""
        shapes = (folder / "modes.frd").read_text(encoding="ascii", errors="replace") if modes else ""
    frequencies = _frequencies(text)
    out = _out_of_plane(shapes, len(body.nodes_mm), len(frequencies))
    probes = {name: moved[node] for name, node in watched.items()}
    return SolidAnswer(force, probes, tuple(zip(frequencies, out, strict=True)))


def _nearest(mesh: PlaneMesh, point: tuple[float, float]) -> int:
    x, y = mesh.nodes_mm
    return int(np.argmin(np.hypot(x - point[0], y - point[1])))


def _run(folder: Path, job: str, lines: list[str], ending: str) -> str:
    (folder / f"{job}.inp").write_text("\n".join(lines) + "\n", encoding="ascii")
    subprocess.run(["ccx", job], cwd=folder, check=True, capture_output=True, timeout=1200)
    return (folder / f"{job}{ending}").read_text(encoding="ascii", errors="replace")


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


def _frequencies(text: str) -> list[float]:
    found = []
    for line in text.splitlines():
        cells = line.split()
        if len(cells) == 5 and cells[0].isdigit():
            found.append(float(cells[3]))
        elif "P A R T I C I P A T I O N" in line:
            break
    return found


def _out_of_plane(text: str, nodes: int, modes: int) -> list[bool]:
    """Whether most of each mode's squared displacement is along z, from the fixed columns of a .frd file."""
    squares: list[Array] = []
    reading = False
    for line in text.splitlines():
        if line.startswith(" -4  DISP"):
            reading = True
            squares.append(np.zeros(3))
        elif line.startswith(" -3"):
            reading = False
        elif reading and line.startswith(" -1"):
            squares[-1] += [float(line[13 + 12 * i : 25 + 12 * i]) ** 2 for i in range(3)]
    del nodes
    return [bool(part[2] > part[0] + part[1]) for part in squares[:modes]]
