"""Recordings of the paper's sample with something hidden in it: deformed by finite elements, rendered.

Small displacements are those of the changed outline on a mesh of its own; what large rotations add is that of the
sample as drawn, and a pivot's slip that of a mesh with a cut neck, both interpolated.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
from scipy.spatial import Delaunay

from fingervision.domain.frame import Frame
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.mechanism_bodies import bodies_of, plate_poses
from fingervision.rendering import Camera, Patch, Scene, render
from tests.benchmarks.which_hinge import HINGES, Array, drawn, shifted, slip_at, slipping_fields, thicker
from tests.deformed_plate import deformed_outlines

NODES = (-0.3, 0.45, 1.2)
"""Equilibria through which, and through rest, displacements are a polynomial of the input (mm)."""


@dataclass(frozen=True)
class Hidden:
    """What is hidden: a mesh with its displacements by input, the keys that name it and the sizes, words."""

    model: MechanismPlate
    moved_at: Callable[[float], Array]
    sizes: dict[str, float]
    words: str


@dataclass(frozen=True)
class View:
    """How the camera sees it: from which side, where, and how much the stated scale is off."""

    scale: float
    origin_px: Array
    angle_rad: float
    is_mirrored: bool
    off: float

    def to_px(self, points_mm: Array) -> Array:
        """Place points, shape (2, n), in the picture: rows run downwards, a back is seen mirrored."""
        x, y = points_mm * np.array([[-1.0 if self.is_mirrored else 1.0], [-1.0]]) * self.scale
        c, s = np.cos(self.angle_rad), np.sin(self.angle_rad)
        return np.stack([c * x - s * y, s * x + c * y]) + self.origin_px[:, None]


def changed(kind: str, rng: np.random.Generator) -> tuple[int, float, str, str]:
    """Draw a place: number of the hinge, size, key, words."""
    hinge = int(rng.integers(4))
    side, sign = HINGES[hinge].split()[0], float(rng.choice([-1.0, 1.0]))
    if kind == "hinge":
        size = sign * rng.uniform(0.10, 0.20)
        return hinge, size, f"hinge_stiffness_error@{HINGES[hinge]}", f"{HINGES[hinge]} {100 * size:+.0f} %"
    if kind == "play":
        return hinge, 0.02, f"hinge_play@{HINGES[hinge]}", f"{HINGES[hinge]} 20 um of play"
    size = sign * rng.uniform(0.010, 0.015)
    place = f"{side}_finger, {side} hinge 1 to {side} hinge 2"
    return hinge, size, f"link_length_error@{place}", f"{place} {100 * size:+.1f} %"


def hidden(kinds: Sequence[str], rng: np.random.Generator) -> Hidden:
    """Draw what is hidden in one recording."""
    mechanism, play, sizes, words = drawn(), None, dict[str, float](), []
    for kind in kinds:
        hinge, size, key, said = changed(kind, rng)
        sizes[key] = size
        words.append(said)
        if kind == "hinge":
            other = thicker(hinge, (1.0 + size) ** 0.4).flexures[hinge]
        elif kind == "link":
            out = np.sign((-35.5, -17.68, 35.5, 17.68)[hinge]) * (1.0 if hinge % 2 == 0 else -1.0)
            other = shifted(hinge, out * 17.82 * size, 0.0).flexures[hinge]
        else:
            play = hinge, size
            continue
        flexures = [other if place == hinge else own for place, own in enumerate(mechanism.flexures)]
        mechanism = replace(mechanism, flexures=tuple(flexures))
    model = MechanismPlate(mechanism)
    small, bend = model.driven.unit_displacement, beside_small(model)
    load, stiffness, by_slip = slips(play[0], model) if play is not None else (np.zeros(2), np.eye(2), np.zeros((1, 2)))

    def moved_at(u: float) -> Array:
        weights = [np.prod([(u - other) / (own - other) for other in NODES if other != own]) for own in NODES]
        moved = u * (small + np.array(weights) @ bend)
        if play is None:
            return np.asarray(moved)
        return np.asarray(moved + by_slip @ slip_at(load, stiffness, u, 0.5 * play[1]))

    return Hidden(model, moved_at, sizes, " and ".join(words) or "nothing")


@cache
def slip_solution(number: int) -> tuple[Array, Array, Delaunay, Array]:
    """Load by input, stiffness, nodes and displacements (nodes, 4) by slips, of the mesh with a cut neck."""
    plate, moved, forces = slipping_fields(number)
    by_slip = np.hstack([moved[plate.x_dofs, 1:], moved[plate.y_dofs, 1:]])
    return -forces[:, 0], forces[:, 1:], Delaunay(plate.nodes_mm.T), by_slip


def slips(number: int, model: MechanismPlate) -> tuple[Array, Array, Array]:
    """Displacements by a slip at the nodes of another mesh: um of slip, so that its interpolation costs nanometres."""
    load, stiffness, nodes, by_slip = slip_solution(number)
    return load, stiffness, on_mesh(model, nodes, by_slip, drawn().flexures[number].at_mm)


@cache
def bent() -> tuple[Delaunay, Array, dict[str, float]]:
    """What large rotations add to the sample as drawn, per mm of input: shape (nodes, 2 NODES); and turns of bodies."""
    model = MechanismPlate(drawn())
    states = [model.state(u, large_rotation=True).displacement_mm / u - model.driven.unit_displacement for u in NODES]
    plate = model.plate
    added = np.array([own[dofs] for dofs in (plate.x_dofs, plate.y_dofs) for own in states]).T
    return Delaunay(plate.nodes_mm.T), added, turns_of(model)


def turns_of(model: MechanismPlate) -> dict[str, float]:
    """Turn of every body by 1 mm of input, small displacements."""
    poses = plate_poses(model.plate, model.bodies, model.driven.unit_displacement, large=False)
    return {name: pose.angle_mrad for name, pose in poses.items()}


def beside_small(model: MechanismPlate) -> Array:
    """What large rotations add to a changed drawing, shape (NODES, unknowns).

    As drawn, by the square of how much more its fingers turn: beside equilibria of the changed drawing some 10 nm.
    """
    nodes, added, turns = bent()
    own, plate = turns_of(model), model.plate
    columns = on_mesh(model, nodes, added).T
    for dofs in (plate.x_dofs, plate.y_dofs):
        for side, here in (("left", plate.nodes_mm[0] < 0.0), ("right", plate.nodes_mm[0] >= 0.0)):
            columns[:, dofs[here]] *= (own[f"{side}_finger"] / turns[f"{side}_finger"]) ** 2
    return columns


def on_mesh(model: MechanismPlate, nodes: Delaunay, values: Array, cut_mm: tuple[float, float] | None = None) -> Array:
    """Interpolate displacements, x of every case and then y by column, to the unknowns of another mesh, by case."""
    plate, count = model.plate, values.shape[1] // 2
    at, out = plate.nodes_mm.T, np.zeros((plate.unknowns, count))
    inside, outside = LinearNDInterpolator(nodes, values)(at), NearestNDInterpolator(nodes.points, values)(at)
    # Across a cut the displacement jumps: the nearest node is on the right side of it.
    near = np.zeros(len(at), dtype=bool) if cut_mm is None else np.hypot(*(at - np.array(cut_mm)).T) < 1.5
    found = np.where(np.isfinite(inside) & ~near[:, None], inside, outside)
    out[plate.x_dofs], out[plate.y_dofs] = found[:, :count], found[:, count:]
    return out


def view_of(kind: str, scale: float, rng: np.random.Generator) -> View:
    """Draw where the sample lies."""
    origin = np.array([0.5 * round(scale * 104), scale * 108]) + rng.uniform(-1.0, 1.0, 2)
    off = float(rng.choice([-1.0, 1.0]) * np.exp(rng.uniform(np.log(0.002), np.log(0.2)))) if kind == "scaled" else 0.0
    return View(scale, origin, rng.uniform(-0.01, 0.01), kind == "mirrored", off)


def frames_of(
    what: Hidden, view: View, inputs: Array, beside_mm: Array | None, rng: np.random.Generator
) -> list[Frame]:
    """Render the recording; with `beside_mm` a still copy of the right finger lies so far from it."""
    plate, blur, noise = what.model.plate, rng.uniform(0.7, 1.3), rng.uniform(1.0, 3.0)
    patches = ()
    if beside_mm is not None:
        finger = next(body for body in bodies_of(drawn()) if body.name == "right_finger")
        outline = np.concatenate([c.at(np.linspace(c.t0, c.t1, 2 if c.is_straight else 9))[:, :-1]
                                  for c in finger.outline.curves], axis=1)  # fmt: skip
        ends = np.arange(outline.shape[1])
        middles = 0.5 * (outline + np.roll(outline, -1, axis=1))
        edges = np.stack([ends, np.roll(ends, -1), ends + ends.size])
        nodes = np.concatenate([outline, middles], axis=1) + beside_mm[:, None]
        patches = (Patch(deformed_outlines(edges, view.to_px(nodes)), 50.0),)
    frames = []
    for number, u in enumerate(inputs):
        moved = what.moved_at(float(u))
        nodes = plate.nodes_mm + np.stack([moved[plate.x_dofs], moved[plate.y_dofs]])
        own = Patch(deformed_outlines(plate.outline_edges, view.to_px(nodes)), 50.0)
        size = {"width_px": round(view.scale * 104), "height_px": round(view.scale * 116)}
        scene = Scene(**size, before=(*patches, own))
        frames.append(Frame(render(scene, Camera(blur_px=blur, noise_grey=noise), rng), number, 0.1 * number))
    return frames
