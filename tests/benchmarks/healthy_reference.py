"""What changed since a healthy recording: rendered films of three mechanisms, compared, held against the truth.

    python -m tests.benchmarks.healthy_reference --frames 36 --seed 1
    python -m tests.benchmarks.healthy_reference --nulls 3 --without-outlines

The plant shares no element with the product: rigid bodies joined by flexures whose compliance is integrated along their
own height profile (Euler and Bernoulli, with shear), and large rotations by minimising the energy. Each mechanism is
recorded healthy, then with a neck 7 % thinner, a link 0.25 mm longer, or a leaf 5 % thinner, then with nothing hidden;
the camera is set up anew within 2 degrees and 0.5 %, and its calibration is known to 0.02 %. `--gain 0.003` sets the
input's gauge up anew as well; `--other-specimen` draws every thickness within 1 % for the second recording.
"""

import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from calib.calibration import BareScale
from fingervision.diagnosis.bodies.healthy_reference import HealthyReference, Recording, WhatChanged
from fingervision.domain.body_poses import FlexureOutline
from fingervision.domain.frame import Frame
from fingervision.measuring.body_poses import BodyTracker
from fingervision.measuring.drawing_placement import GivenPoint
from fingervision.measuring.flexure_outlines import flexures_at_rest
from fingervision.models.flexure import Flexure
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_bodies import LinkBody, bodies_of
from fingervision.models.place_answers import PARTS, PlaceAnswers
from fingervision.models.planar_region import PlanarRegion
from fingervision.rendering import Camera, Patch, Scene, render
from fingervision.rendering.polygon import polygon
from fingervision.storage.mechanism_toml import read_mechanism
from tests.benchmarks.frame import Namespace, benchmark

Array = NDArray[np.float64]
DRAWINGS = Path(__file__).parent / "mechanisms"
CASES = {
    "filleted_lever": (
        0.5,
        (("pivot", "thickness", -0.07), ("elbow", "along", 0.25), ("elbow", "thickness", -0.07)),
    ),
    "leaf_and_notch": (0.6, (("right notch", "thickness", -0.07), ("left inner leaf", "across", 0.25),
                             ("left outer leaf", "thickness", -0.05))),
    "three_leaves": (0.4, (("right", "thickness", -0.05), ("leaning", "across", 0.25), ("left", "thickness", -0.05))),
}  # fmt: skip
"""Drawing, reach of the input (mm) and what is hidden: a relative change of thickness, or a displacement (mm)."""
PX_PER_MM, SLICES = 10.0, 400


def changed(mechanism: Mechanism, name: str, kind: str, size: float) -> Mechanism:
    """Change one flexure of a drawing."""
    flexures = []
    for flexure in mechanism.flexures:
        if flexure.name == name and kind == "thickness":
            flexures.append(replace(flexure, thickness_mm=flexure.thickness_mm * (1.0 + size)))
        elif flexure.name == name:
            at = flexure.point_mm(*((size, 0.0) if kind == "along" else (0.0, size)))
            flexures.append(replace(flexure, at_mm=at))
        else:
            flexures.append(flexure)
    return replace(mechanism, flexures=tuple(flexures))


def ends_of(mechanism: Mechanism, flexure: Flexure) -> tuple[float, float]:
    """Free part of a flexure along its axis: a leaf's ends lie inside bodies."""
    x = np.linspace(-flexure.half_length_mm, flexure.half_length_mm, SLICES + 1)
    if flexure.kind != "leaf":
        return float(x[0]), float(x[-1])
    inside = PlanarRegion(mechanism.bodies).holds(np.stack(flexure.point_mm(x, np.zeros_like(x))))
    free = x[~inside]
    return float(free[0]), float(free[-1])


def stiffness_of(mechanism: Mechanism, flexure: Flexure, ends: tuple[float, float]) -> Array:
    """Force and moment (N, N, N mm) at the far end by its displacement and rotation; shape (3, 3)."""
    edges = np.linspace(*ends, SLICES + 1)
    x, dx = 0.5 * (edges[1:] + edges[:-1]), edges[1] - edges[0]
    height, width = flexure.height_mm(x), mechanism.plate_mm
    young, poisson = mechanism.material.youngs_modulus_mpa, mechanism.material.poisson_ratio
    arm, bend = ends[1] - x, dx / (young * width * height**3 / 12.0)
    section = dx / (width * height)
    softness = np.array([
        [np.sum(section) / young, 0.0, 0.0],
        [0.0, np.sum(arm**2 * bend) + 1.2 * np.sum(section) * 2.0 * (1.0 + poisson) / young, np.sum(arm * bend)],
        [0.0, np.sum(arm * bend), np.sum(bend)],
    ])  # fmt: skip
    return np.linalg.inv(softness)


@dataclass(frozen=True, eq=False)
class Plant:
    """Rigid bodies joined by elastic flexures."""

    mechanism: Mechanism
    bodies: tuple[LinkBody, ...]
    joints: tuple[tuple[int, int], ...]
    ends: tuple[tuple[float, float], ...]
    roots: tuple[Array, ...]

    @classmethod
    def of(cls, mechanism: Mechanism) -> "Plant":
        bodies = bodies_of(mechanism)
        joints, ends, roots = [], [], []
        for flexure in mechanism.flexures:
            free = ends_of(mechanism, flexure)
            sides = [
                np.array(flexure.point_mm(end + way * 0.4, 0.0)) for end, way in zip(free, (-1.0, 1.0), strict=True)
            ]
            near = [int(np.argmin([distance(body, side) for body in bodies])) for side in sides]
            joints.append((near[0], near[1]))
            ends.append(free)
            roots.append(np.linalg.cholesky(stiffness_of(mechanism, flexure, free)).T)
        return cls(mechanism, bodies, tuple(joints), tuple(ends), tuple(roots))

    def poses(self, inputs: Array) -> Array:
        """Displacement (mm) and rotation (rad) of every body, shape (inputs, bodies, 3); fixed bodies stand still."""
        moving = [n for n, body in enumerate(self.bodies) if not body.is_fixed]
        drive = self.mechanism.drives[0]
        x0, x1, y0, y1 = drive.face.box_mm
        middle, way = np.array([0.5 * (x0 + x1), 0.5 * (y0 + y1)]), np.array(drive.direction)
        driven = int(np.argmin([distance(body, middle) for body in self.bodies]))
        scale = np.tile([1.0, 1.0, 1e-2], len(moving))
        stiff = 1e4 * max(float(np.abs(root).max()) for root in self.roots)

        def spread(unknowns: Array) -> Array:
            out = np.zeros((len(self.bodies), 3))
            out[moving] = (unknowns * scale).reshape(-1, 3)
            return out

        def forces(unknowns: Array, u: float) -> Array:
            q = spread(unknowns)
            parts = [root @ self._stretch(k, q) for k, root in enumerate(self.roots)]
            return np.concatenate(
                [*parts, [stiff * float((moved(self.bodies[driven], q[driven], middle) - middle) @ way - u)]]
            )

        found, start = [], np.zeros(3 * len(moving))
        order = np.argsort(inputs)
        for u in inputs[order]:
            start = least_squares(forces, start, args=(float(u),), xtol=1e-14, ftol=1e-14, gtol=1e-14).x
            found.append(spread(start))
        out = np.empty((inputs.size, len(self.bodies), 3))
        out[order] = found
        return out

    def _stretch(self, k: int, q: Array) -> Array:
        flexure, (first, last), (low, high) = self.mechanism.flexures[k], self.joints[k], self.ends[k]
        a, b = (np.array(flexure.point_mm(end, 0.0)) for end in (low, high))
        a, b = moved(self.bodies[first], q[first], a), moved(self.bodies[last], q[last], b)
        angle = np.deg2rad(flexure.axis_deg) + q[first, 2]
        along = np.array([np.cos(angle), np.sin(angle)])
        across = np.array([-along[1], along[0]])
        return np.array([(b - a) @ along - (high - low), (b - a) @ across, q[last, 2] - q[first, 2]])

    def outlines(self) -> list[tuple[Array, Array, Array, Array]]:
        """Loops of the drawing: points (2, n), the two bodies of every point, and the share of the second, (n,)."""
        found = []
        for loop in self.mechanism.region.loops:
            # Only arcs and the sides of leaves bend.
            parts = []
            for curve in loop.curves:
                middle = self._owner(curve.at(np.array([0.5 * (curve.t0 + curve.t1)]))[:, 0])
                bends = not curve.is_straight or middle[0] != middle[1]
                parts.append(curve.at(np.linspace(curve.t0, curve.t1, 17 if bends else 2))[:, :-1])
            points = np.concatenate(parts, axis=1)
            one, two, share = (
                np.zeros(points.shape[1], dtype=int),
                np.zeros(points.shape[1], dtype=int),
                np.zeros(points.shape[1]),
            )
            for n, point in enumerate(points.T):
                one[n], two[n], share[n] = self._owner(point)
            found.append((points, one, two, share))
        return found

    def _owner(self, point: Array) -> tuple[int, int, float]:
        for k, flexure in enumerate(self.mechanism.flexures):
            angle, away = np.deg2rad(flexure.axis_deg), point - np.array(flexure.at_mm)
            along = float(away @ (np.cos(angle), np.sin(angle)))
            across = float(away @ (-np.sin(angle), np.cos(angle)))
            low, high = self.ends[k]
            if low < along < high and abs(across) < 0.5 * float(flexure.height_mm(np.array([along]))[0]) + 0.05:
                s = (along - low) / (high - low)
                return *self.joints[k], s * s * (3.0 - 2.0 * s)
        body = int(np.argmin([distance(body, point) for body in self.bodies]))
        return body, body, 0.0


def distance(body: LinkBody, point: Array) -> float:
    """Distance of a point from a body, to some hundredths of a millimetre; 0 inside."""
    if body.holds(point[:, None])[0]:
        return 0.0
    points = np.concatenate([c.at(np.linspace(c.t0, c.t1, 200)) for c in body.outline.curves], axis=1)
    return float(np.hypot(*(points - point[:, None])).min())


def moved(body: LinkBody, pose: Array, points: Array) -> Array:
    """Move points, shape (2,) or (2, n), with a body."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    turn = np.array([[c, -s], [s, c]])
    centre = body.centroid_mm if points.ndim == 1 else body.centroid_mm[:, None]
    shift = pose[:2] if points.ndim == 1 else pose[:2, None]
    return np.asarray(turn @ (points - centre) + centre + shift)


@dataclass(frozen=True, eq=False)
class Film:
    """What one recording tells: input, poses by channel, flexures at rest."""

    input_mm: Array
    values: Array
    floors: Array
    flexures: dict[str, FlexureOutline]
    channels: tuple[str, ...]


def filmed(drawn: Mechanism, plant: Plant, inputs: Array, rng: np.random.Generator, gain: float = 0.0) -> Film:
    """Render a recording of a plant with a camera that is set up anew, and measure it with the drawing."""
    scale = PX_PER_MM * (1.0 + rng.uniform(-0.005, 0.005))
    angle, blur, noise = np.deg2rad(rng.uniform(-2.0, 2.0)), rng.uniform(0.8, 1.2), rng.uniform(1.0, 2.5)
    loops = plant.outlines()
    every = np.concatenate([points for points, *_ in loops], axis=1)
    c, s = np.cos(angle), np.sin(angle)
    axes = scale * np.array([[c, s], [s, -c]])
    size = scale * np.ptp(every, axis=1) + 60.0
    origin = 0.5 * size - axes @ (0.5 * (every.min(axis=1) + every.max(axis=1))) + rng.uniform(-1.0, 1.0, 2)
    to_px = lambda points: axes @ points + origin[:, None]  # noqa: E731
    camera, frames = Camera(blur_px=blur, noise_grey=noise), []
    for number, pose in enumerate(plant.poses(inputs)):
        outlines = []
        for place, (points, one, two, share) in enumerate(loops):
            ends = [np.empty_like(points) for _ in range(2)]
            for k, body in enumerate(plant.bodies):
                whole = moved(body, pose[k], points)
                for end, owner in zip(ends, (one, two), strict=True):
                    end[:, owner == k] = whole[:, owner == k]
            seen = to_px((1.0 - share) * ends[0] + share * ends[1])
            own = polygon(tuple(map(tuple, seen.T)))
            outlines.append(own if place == 0 else own.backwards())
        scene = Scene(width_px=round(size[0]), height_px=round(size[1]), before=(Patch(tuple(outlines), 50.0),))
        frames.append(Frame(render(scene, camera, rng), number, 0.1 * number))
    corners = np.array(
        [(every[0].min(), every[1].min()), (every[0].max(), every[1].min()), (every[0].max(), every[1].max())]
    )
    at = [GivenPoint(*to_px(corner[:, None])[:, 0], *corner) for corner in corners]
    tracker = BodyTracker(drawn, BareScale(scale * (1.0 + rng.normal(0.0, 2e-4))), at)
    seen = list(tracker.poses(frames))
    names = [body.name for body in plant.bodies if not body.is_fixed]
    kept = [n for n, each in enumerate(seen) if all(each.poses[name].x_mm is not None for name in names)]
    values = np.array([[getattr(seen[n].poses[name], part) for name in names for part in PARTS] for n in kept])
    floors = np.median(
        [[x for name in names for x in np.sqrt(np.diag(seen[n].poses[name].random))] for n in kept], axis=0
    )
    still = {one.flexure: one for one in flexures_at_rest(tracker.first, drawn.flexures)}
    channels = tuple(f"{name}.{part}" for name in names for part in PARTS)
    return Film(inputs[kept] * (1.0 + gain), values, floors, still, channels)


def inputs_of(reach: float, frames: int, rng: np.random.Generator) -> Array:
    """Rest, then strokes to both ends, at inputs of the day."""
    turns = np.array([0.0, reach * rng.uniform(0.9, 1.0), -reach * rng.uniform(0.9, 1.0), 0.0])
    return np.concatenate([np.zeros(6), np.interp(np.linspace(0.0, 3.0, frames - 6), np.arange(4), turns)])


def compared(
    answers: PlaceAnswers, healthy: Film, faulty: Film, outlines: bool = True, motion: bool = True
) -> WhatChanged:
    """Compare two films."""
    both = [Recording.of(one.input_mm, one.values, (slice(0, one.input_mm.size),), one.floors, timed=True)
            for one in (healthy, faulty)]  # fmt: skip
    seen = (healthy.flexures, faulty.flexures) if outlines else ({}, {})
    if not motion:
        return HealthyReference(answers, (), None, None, seen).run()
    return HealthyReference(answers, healthy.channels, both[0], both[1], seen).run()


def words_of(found: WhatChanged) -> str:
    """What was told, in one line."""
    if not found.changed:
        return "nothing changed"
    if not found.told:
        return f"changed, place not told ({len(found.places)} places)"
    return "; ".join(
        f"{m.change.place} {m.change.kind} {1e3 * m.size:+.0f} +-{2e3 * m.u:.0f}" for m in found.members[:5]
    )


@benchmark(
    frames=36,
    seed=1,
    nulls={"type": int, "default": 3, "help": "recordings of each mechanism with nothing hidden"},
    only={"default": ",".join(CASES)},
    gain={"type": float, "default": 0.0, "help": "error of the input's gain on the second day"},
    other_specimen={"action": "store_true", "help": "another specimen on the second day"},
)
def main(chosen: Namespace) -> None:
    """Read the options, record, compare, and print the bars."""
    tally = dict.fromkeys(("still frames and motion", "motion alone", "still frames alone"), 0)
    faults = nulls = claims = false = 0
    for number, name in enumerate(chosen.only.split(",")):
        rng = np.random.default_rng([chosen.seed, number])
        reach, hidden = CASES[name]
        drawn = read_mechanism(DRAWINGS / f"{name}.toml")
        answers = PlaceAnswers(drawn)
        healthy = filmed(drawn, Plant.of(drawn), inputs_of(reach, chosen.frames, rng), rng)
        for what in (*hidden, *([None] * chosen.nulls)):
            begun = time.perf_counter()
            second = drawn if what is None else changed(drawn, *what)
            if chosen.other_specimen:
                for flexure in drawn.flexures:
                    second = changed(second, flexure.name, "thickness", rng.uniform(-0.01, 0.01))
            faulty = filmed(drawn, Plant.of(second), inputs_of(reach, chosen.frames, rng), rng, chosen.gain)
            ways = [compared(answers, healthy, faulty), compared(answers, healthy, faulty, outlines=False),
                    compared(answers, healthy, faulty, motion=False)]  # fmt: skip
            said = "nothing" if what is None else " ".join(map(str, what))
            print(f"{name}: {said} ({time.perf_counter() - begun:.0f} s)")
            for way, found in zip(tally, ways, strict=True):
                print(f"    {way}: {words_of(found)}", flush=True)
                if what is None:
                    claims += found.changed
                    false += found.told
                else:
                    tally[way] += found.told and what[0] in found.places
                    false += found.told and what[0] not in found.places
            faults, nulls = faults + (what is not None), nulls + (what is None)
    for way, right in tally.items():
        print(f"right place, or in a set of at most four, by {way}: {right} of {faults}")
    print(f"claims with nothing hidden: {claims} of {3 * nulls}; false places: {false}")
