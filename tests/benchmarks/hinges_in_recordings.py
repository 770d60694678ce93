"""Which hinge, link or pivot is off, from rendered recordings: drawn by finite elements, followed, diagnosed.

    PYTHONPATH=. python -m tests.benchmarks.hinges_in_recordings --recordings 20
    PYTHONPATH=. python -m tests.benchmarks.hinges_in_recordings --recordings 6 --view alike mirrored scaled

As `which_hinge`, but with pictures in between: every recording shows the paper's sample with one hinge 10 to 20 % off
its stiffness, one link 1 to 1.5 % off its length, or 20 um of play in one pivot (every fourth: nothing), deformed with
large rotations, rendered with blur, noise and a turn of its own. Poses are those of `measure --mechanism`; what is told
is held against what was hidden. `--hidden two` hides two at once. `--bodies` leaves poses out. Views (an odd number of
them, so that each meets everything that is hidden):

plain     the sample by itself
alike     a second finger, which does not move, lies 6 to 9 mm beside the right one, and inputs come in any order
mirrored  the camera sees the sample's back: told by three points; with `--points 2` it cannot be told
scaled    the stated scale is off by 0.2 to 20 %

The drive of the sample bends: its edges move by up to 4 um otherwise than its area.
"""

import argparse
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
from scipy.spatial import Delaunay

from calib.calibration import BareScale
from fingervision.diagnosis.bodies.body_prediction import BodyPrediction
from fingervision.diagnosis.bodies.place_search import PlaceFindings, PlaceSearch
from fingervision.domain.body_poses import FramePoses
from fingervision.domain.errors import FingervisionError
from fingervision.domain.frame import Frame
from fingervision.measuring.body_poses import BodyTracker
from fingervision.measuring.drawing_placement import GivenPoint
from fingervision.models.mechanism_bodies import bodies_of, plate_poses
from fingervision.models.mechanism_plate import MechanismPlate
from fingervision.models.place_answers import PlaceAnswers
from fingervision.rendering import Camera, Patch, Scene, render
from fingervision.rendering.deformed_plate import deformed_outlines
from tests.benchmarks.which_hinge import BODIES, HINGES, Array, drawn, shifted, slip_at, slipping_fields, thicker

NODES = (-0.3, 0.45, 1.2)
"""Equilibria through which, and through rest, displacements are a polynomial of the input (mm)."""
PARTS = ("x_mm", "y_mm", "angle_mrad")
VIEWS, KINDS = ("plain", "alike", "mirrored", "scaled"), ("nothing", "hinge", "link", "play")
GIVEN_MM = ((-39.0, 0.0), (39.0, 0.0), (0.0, 2.57))


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
    small, bend = model.unit_displacement_mm, beside_small(model)
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
    states = [model.state(u, large_rotation=True).displacement_mm / u - model.unit_displacement_mm for u in NODES]
    plate = model.plate
    added = np.array([own[dofs] for dofs in (plate.x_dofs, plate.y_dofs) for own in states]).T
    return Delaunay(plate.nodes_mm.T), added, turns_of(model)


def turns_of(model: MechanismPlate) -> dict[str, float]:
    """Turn of every body by 1 mm of input, small displacements."""
    poses = plate_poses(model.plate, model.bodies, model.unit_displacement_mm, large=False)
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


def rows_of(seen: Sequence[FramePoses], bodies: Sequence[str]) -> tuple[Array, Array, Array]:
    """Rows with all poses, the poses, and their random uncertainty."""
    rows, values, u_values = [], [], []
    for number, each in enumerate(seen):
        poses = [each.poses[body] for body in bodies]
        if any(pose.x_mm is None or pose.random is None for pose in poses):
            continue
        rows.append(number)
        values.append([value for pose in poses for value in (pose.x_mm, pose.y_mm, pose.angle_mrad)])
        u_values.append([value for pose in poses for value in np.sqrt(np.diag(np.asarray(pose.random)))])
    return (
        np.array(rows, dtype=int),
        np.array(values),
        np.median(np.array(u_values), axis=0) if u_values else np.zeros(0),
    )


def jumped(what: Hidden, seen: Sequence[FramePoses], inputs: Array) -> int:
    """Count the `ok` poses of moving bodies that are 0.2 mm or 5 mrad off the truth, which no fit's error explains."""
    points = {body.name: body for body in bodies_of(drawn())}
    bodies, wrong = [points[name] for name in BODIES], 0
    for each, u in zip(seen, inputs, strict=True):
        truth = plate_poses(what.model.plate, bodies, what.moved_at(float(u)), large=True)
        for name in BODIES:
            pose = each.poses[name]
            if pose.x_mm is not None and pose.y_mm is not None and pose.angle_mrad is not None:
                off = np.hypot(pose.x_mm - truth[name].x_mm, pose.y_mm - truth[name].y_mm)
                wrong += bool(off > 0.2 or abs(pose.angle_mrad - truth[name].angle_mrad) > 5.0)
    return wrong


def verdict_of(what: Hidden, found: PlaceFindings) -> tuple[str, list[str], list[float]]:
    """What is told, held against what was hidden: a verdict, the places, and errors of sizes over their stated u."""
    told = list(dict.fromkeys(member.candidate.key for member in found.members)) if not found.structure else []
    if not told:
        return ("unknown" if found.structure else "claims nothing" if not what.sizes else "missed"), told, []
    if not what.sizes:
        return "claim where nothing is", told, []
    # Two links that mirror each other are one explanation: the pair, named by one of them.
    pairs = {key for key in told for own in what.sizes if f"@{own.partition('@')[2]} and its" in key}
    offs = [(member.size - what.sizes[key]) / member.u_stated for key in what.sizes
            for member in [m for m in found.members if m.candidate.key == key][:1]]  # fmt: skip
    right = bool(offs) or (len(what.sizes) > 1 and bool(pairs))
    return (("named" if len(told) == 1 else "in the set") if right else "wrong place"), told, offs


def main(arguments: Sequence[str] | None = None) -> None:
    """Render, follow, diagnose, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recordings", type=int, default=20)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--px-per-mm", type=float, default=6.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--bodies", nargs="+", choices=BODIES, default=list(BODIES))
    parser.add_argument("--hidden", choices=("one", "two"), default="one")
    parser.add_argument("--view", nargs="+", choices=VIEWS, default=["plain"])
    parser.add_argument("--points", type=int, choices=(2, 3), default=3)
    given = parser.parse_args(arguments)
    answers = PlaceAnswers(drawn())
    names = tuple(f"{body}.{part}" for body in given.bodies for part in PARTS)
    counts: dict[str, Counter[str]] = {}
    offs: list[float] = []
    for number in range(given.recordings):
        began = time.process_time()
        rng = np.random.default_rng([given.seed, number])
        view_kind = given.view[number % len(given.view)]
        if given.hidden == "two":
            kinds = [KINDS[1 + k] for k in rng.choice(3, 2, replace=False)]
        else:
            kinds = [kind for kind in (KINDS[number % 4],) if kind != "nothing"]
        what, view = hidden(kinds, rng), view_of(view_kind, given.px_per_mm, rng)
        half = given.frames // 2
        inputs = np.concatenate([np.linspace(-0.3, 1.2, half), np.linspace(1.2, -0.3, given.frames - half)])
        beside = None
        if view_kind == "alike":
            inputs, beside = rng.permutation(inputs), np.array([rng.uniform(6.0, 9.0), rng.uniform(-2.0, 2.0)])
        points = []
        for at in GIVEN_MM[: given.points]:
            x, y = view.to_px(np.array(at)[:, None])[:, 0] + rng.uniform(-1.5, 1.5, 2)
            points.append(GivenPoint(float(x), float(y), *at))
        frames = frames_of(what, view, inputs, beside, rng)
        tracker = BodyTracker(drawn(), BareScale(given.px_per_mm * (1.0 + view.off)), points)
        try:
            seen = list(tracker.poses(frames))
        except FingervisionError as error:
            counts.setdefault(view_kind, Counter())["refused"] += 1
            print(f"{view_kind} {100 * view.off:+.1f} %, {what.words}: refused: {error}", flush=True)
            continue
        rows, measured, floors = rows_of(seen, given.bodies)
        wrong = jumped(what, seen, inputs)
        notes = () if tracker.placed is None else tracker.placed.notes
        if rows.size < 20:
            verdict, told, structure = "too few rows", [], 0.0
        else:
            prediction = BodyPrediction(answers, names, inputs[rows] + rng.normal(0.0, 2e-4, rows.size))
            found = PlaceSearch(prediction, measured, (slice(0, rows.size),), floors, timed=True).run(rng)
            (verdict, told, own), structure = verdict_of(what, found), found.structure
            offs += own
        counts.setdefault(view_kind, Counter())[verdict] += 1
        counts[view_kind]["poses off"] += wrong
        print(
            f"{view_kind} {100 * view.off:+.1f} %, {what.words}: {verdict} {' | '.join(told)} ({rows.size} of "
            f"{given.frames} frames, {wrong} poses off, structure {structure:.0f}, "
            f"{time.process_time() - began:.0f} s) {' / '.join(notes)}", flush=True,
        )  # fmt: skip
    for kind, counted in counts.items():
        print(f"{kind}: " + ", ".join(f"{name} {count}" for name, count in counted.items()))
    if offs:
        z = np.array(offs)
        print(
            f"sizes within 1.96 u: {np.sum(np.abs(z) < 1.96)} of {z.size}, RMS of error / u "
            f"{np.sqrt(np.mean(z**2)):.2f}"
        )


if __name__ == "__main__":
    main()
