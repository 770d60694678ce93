"""Films of whole mechanisms from CalculiX's displacements: every pair and pose, with only the drawing and a scale.

    PYTHONPATH=. python -m tests.benchmarks.films_of_mechanisms [--films 10] [--frames 24] [--seed 1] [--only 0 3]
        [--keep FOLDER]

Each film shows one of three mechanisms (the paper's gripper, leaf tweezers, a lever and a jaw) that is driven to and
fro, turned by up to 2 degrees from one of four directions, dark or light, with blur and noise. Displacements are those
of plane stress with large rotations, quadratic triangles of CalculiX; the deformed outline is filled by Agg with exact
coverage on a grid three times finer than the picture's. What is printed for each film, and for all of them together:
how many frames have a value of the gap (gaps.csv), of each pair (gauges.csv) and of the moving bodies' poses, the
share of errors within 2u, and the largest error. One film alone tells little about this share: of 24 frames, 20 or
fewer are within 2u in one film of thirty whose u is right. A body that bends has no pose that is exact: that of its
area is the truth here.
"""

import csv
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.path import Path as Outline
from matplotlib.transforms import IdentityTransform
from numpy.typing import NDArray

from fingervision.models.gripper_mechanism import whole_mechanism
from fingervision.models.mechanism import Face, Mechanism
from fingervision.models.mechanism_bodies import bodies_of, rigid_motion
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.triangulate import PlaneMesh, triangulate
from fingervision.storage.gripper_toml import read_gripper
from fingervision.storage.mechanism_toml import read_drawing
from tests.benchmarks.frame import Namespace, benchmark, in_turn
from tests.benchmarks.scores import within

Array = NDArray[np.float64]
ROOT = Path(__file__).parents[2]
DRAWINGS = Path(__file__).parent / "mechanisms" / "films"
GRIPPER = ROOT / "sample_frames" / "paper" / "gripper.toml"
FINER = 3


@dataclass(frozen=True)
class Subject:
    """A drawing, the range of its input, and the scale at which it is filmed."""

    path: Path
    inputs_mm: tuple[float, float]
    px_per_mm: float

    def mechanism(self) -> Mechanism:
        """Read the drawing."""
        if self.path != GRIPPER:
            return read_drawing(self.path).mechanism()
        gripper = read_gripper(GRIPPER)
        return whole_mechanism(gripper, gripper, "gripper")


SUBJECTS = (
    Subject(GRIPPER, (-0.25, 0.6), 7.0),
    Subject(DRAWINGS / "leaf_tweezers.toml", (-0.6, 1.0), 12.0),
    Subject(DRAWINGS / "lever_jaw.toml", (-0.5, 0.8), 13.0),
)


@dataclass(frozen=True, eq=False)
class Motion:
    """Displacements of the nodes of a plane mesh, for every step of the input: mm, shape (steps, 2, nodes)."""

    mesh: PlaneMesh
    moved_mm: Array

    def loops(self) -> list[list[tuple[int, int, int]]]:
        """The outline's edges (start, middle, end), in the order in which they follow each other."""
        corners = self.mesh.triangles
        edges = [(int(corners[a, t]), int(corners[3 + k, t]), int(corners[b, t]))
                 for k, (a, b) in enumerate(((0, 1), (1, 2), (2, 0))) for t in range(corners.shape[1])]  # fmt: skip
        count: dict[int, int] = {}
        for _, middle, _ in edges:
            count[middle] = count.get(middle, 0) + 1
        after = {edge[0]: edge for edge in edges if count[edge[1]] == 1}
        found = []
        while after:
            loop = [after.pop(next(iter(after)))]
            while loop[-1][2] in after:
                loop.append(after.pop(loop[-1][2]))
            found.append(loop)
        return found


def moved(mechanism: Mechanism, inputs_mm: Array) -> Motion:
    """Solve with CalculiX, one step for each input that is there; elastic bodies have no memory."""
    inputs_mm, again = np.unique(inputs_mm, return_inverse=True)
    region = mechanism.region
    marked = PlanarRegion(region.steps, (*region.marks_mm, *mechanism.probes.values()))
    mesh = triangulate(marked, 3.0, 0.04 * region.size_mm)
    lines = ["*NODE, NSET=ALL", *(f"{i},{x:.12g},{y:.12g},0" for i, (x, y) in enumerate(mesh.nodes_mm.T, 1))]
    lines += ["*ELEMENT, TYPE=CPS6, ELSET=BODY"]
    order = ordered(mesh)
    lines += [f"{i}," + ",".join(map(str, row + 1)) for i, row in enumerate(order.T, 1)]
    material = mechanism.material
    lines += ["*MATERIAL, NAME=BULK", "*ELASTIC", f"{material.youngs_modulus_mpa:.12g},{material.poisson_ratio:.12g}",
              "*SOLID SECTION, ELSET=BODY, MATERIAL=BULK", f"{mechanism.plate_mm:.12g}"]  # fmt: skip
    fixed = [node for face in mechanism.fixed for node in on(mesh, face, region.size_mm)]
    lines += ["*BOUNDARY", *(f"{node},1,2" for node in fixed)]
    for input_mm in inputs_mm:
        lines += ["*STEP, NLGEOM, INC=200", "*STATIC", "1.,1.", "*BOUNDARY"]
        for drive in mechanism.drives:
            axis = 1 if drive.direction[0] else 2
            value = drive.direction[axis - 1] * drive.per_input * input_mm
            lines += [f"{node},{axis},{axis},{value:.12g}" for node in on(mesh, drive.face, region.size_mm)]
        lines += ["*NODE PRINT, NSET=ALL, FREQUENCY=1000", "U", "*END STEP"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "job.inp").write_text("\n".join(lines) + "\n", encoding="ascii")
        subprocess.run(["ccx", "job"], cwd=folder, check=True, capture_output=True, timeout=1200)
        rows = [line.split() for line in (folder / "job.dat").read_text(encoding="ascii").splitlines()]
    values = np.array([[float(cell) for cell in row[1:3]] for row in rows if len(row) == 4 and row[0].isdigit()])
    nodes = mesh.nodes_mm.shape[1]
    moved_mm = values.reshape(inputs_mm.size, nodes, 2).transpose(0, 2, 1)[again]
    return Motion(PlaneMesh(mesh.nodes_mm, order), moved_mm)


@cache
def driven(subject: Subject, frames: int) -> tuple[Mechanism, Motion]:
    """Drive a mechanism to and fro: films of the same mechanism differ in how it is seen."""
    half = (frames + 1) // 2
    there = np.linspace(*subject.inputs_mm, half)
    mechanism = subject.mechanism()
    return mechanism, moved(mechanism, np.concatenate([there, there[::-1]])[:frames])


def ordered(mesh: PlaneMesh) -> NDArray[np.int64]:
    """Corners counter-clockwise, then the middles of the sides 1-2, 2-3 and 3-1, as CalculiX wants them."""
    a, b, c, ab, bc, ac = mesh.triangles
    (ax, ay), (bx, by), (cx, cy) = (mesh.nodes_mm[:, each] for each in (a, b, c))
    turned = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) < 0.0
    return np.array([a, np.where(turned, c, b), np.where(turned, b, c),
                     np.where(turned, ac, ab), bc, np.where(turned, ab, ac)])  # fmt: skip


def on(mesh: PlaneMesh, face: Face, size_mm: float) -> list[int]:
    """Numbers, from 1, of the nodes in the box of a face."""
    x, y = mesh.nodes_mm
    x0, x1, y0, y1 = face.box_mm
    near = 1e-6 * size_mm
    inside = (x >= x0 - near) & (x <= x1 + near) & (y >= y0 - near) & (y <= y1 + near)
    return [int(node) + 1 for node in np.flatnonzero(inside)]


@dataclass(frozen=True)
class View:
    """Where the mechanism lies in the picture, and how it looks."""

    angle_rad: float
    px_per_mm: float
    size_px: tuple[int, int]
    shift_px: tuple[float, float]
    is_dark: bool
    blur_px: float
    noise: float

    def to_px(self, points_mm: Array) -> Array:
        """Pixels of points in mm, shape (2, n); the y axis of the drawing points upwards."""
        c, s = np.cos(self.angle_rad), np.sin(self.angle_rad)
        turned = np.array([[c, s], [s, -c]]) @ points_mm
        return np.asarray(self.px_per_mm * turned + np.array(self.shift_px)[:, None])

    def picture(self, loops: list[Array], rng: np.random.Generator) -> NDArray[np.uint8]:
        """Fill the closed outlines, shape (2, n) in pixels, blur and add noise."""
        width, height = self.size_px
        renderer = RendererAgg(FINER * width, FINER * height, 72.0)
        vertices, codes = [], []
        for loop in loops:
            # The centre of a pixel is half a pixel from its corner; Agg counts rows from below.
            x, y = FINER * (loop + 0.5)
            vertices += [*np.stack([x, FINER * height - y]).T, (0.0, 0.0)]
            codes += [Outline.MOVETO, *[Outline.LINETO] * (x.size - 1), Outline.CLOSEPOLY]
        context = renderer.new_gc()
        context.set_linewidth(0.0)
        context.set_antialiased(True)
        with mpl.rc_context({"path.simplify": False, "path.snap": False}):
            context.set_snap(False)
            renderer.draw_path(context, Outline(vertices, codes), IdentityTransform(), (1.0, 1.0, 1.0, 1.0))
        cover = np.asarray(renderer.buffer_rgba())[..., 3].astype(np.float64) / 255.0
        fine = cv2.GaussianBlur(cover, (0, 0), FINER * self.blur_px)
        share = fine.reshape(height, FINER, width, FINER).mean(axis=(1, 3))
        body, ground = (60.0, 190.0) if self.is_dark else (190.0, 50.0)
        light = ground + (body - ground) * share + self.noise * rng.standard_normal(share.shape)
        return np.asarray(np.clip(np.round(light), 0, 255), dtype=np.uint8)


def view_of(mechanism: Mechanism, px_per_mm: float, rng: np.random.Generator) -> View:
    """Draw a view that shows the whole mechanism with a margin."""
    angle = 0.5 * np.pi * rng.integers(4) + np.radians(rng.uniform(-2.0, 2.0))
    view = View(float(angle), px_per_mm, (0, 0), (0.0, 0.0), bool(rng.integers(2)), rng.uniform(0.7, 1.2), 1.5)
    points = np.concatenate([c.at(np.linspace(c.t0, c.t1, 9)) for _, shape in mechanism.bodies
                             for c in shape.curves()], axis=1)  # fmt: skip
    seen = view.to_px(points)
    low, high = seen.min(axis=1) - 40.0, seen.max(axis=1) + 40.0
    size = np.ceil(high - low).astype(int)
    shift = rng.uniform(-0.5, 0.5, 2) - low
    return View(view.angle_rad, px_per_mm, (int(size[0]), int(size[1])), (float(shift[0]), float(shift[1])),
                view.is_dark, view.blur_px, view.noise)  # fmt: skip


def pictures(motion: Motion, view: View, rng: np.random.Generator) -> Iterator[NDArray[np.uint8]]:
    """Draw every step of a motion; each curved side is drawn by eight pieces."""
    loops = motion.loops()
    t = np.arange(8) / 8.0
    weights = np.stack([(1.0 - t) * (1.0 - 2.0 * t), 4.0 * t * (1.0 - t), t * (2.0 * t - 1.0)])
    for step in motion.moved_mm:
        at = motion.mesh.nodes_mm + step
        yield view.picture([view.to_px(np.concatenate([at[:, edge] @ weights for edge in loop], axis=1))
                            for loop in loops], rng)  # fmt: skip


def nearest(mesh: PlaneMesh, point: tuple[float, float]) -> int:
    """The node at a point."""
    return int(np.argmin(np.hypot(*(mesh.nodes_mm - np.array(point)[:, None]))))


def truths(mechanism: Mechanism, motion: Motion) -> tuple[dict[str, Array], dict[str, Array]]:
    """Distances (mm) of the pairs, and poses (mm, mm, mrad; shape (steps, 3)) of the moving bodies."""
    pairs = {}
    for name, (first, last) in mechanism.pairs.items():
        a, b = (nearest(motion.mesh, mechanism.probes[probe]) for probe in (first, last))
        places = motion.mesh.nodes_mm + motion.moved_mm
        pairs[name] = np.hypot(*(places[:, :, b] - places[:, :, a]).T)
    poses = {}
    middles = motion.mesh.nodes_mm[:, motion.mesh.triangles[:3]].mean(axis=1)
    corners = motion.mesh.nodes_mm[:, motion.mesh.triangles[:3]]
    (ax, ay), (bx, by) = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = np.abs(ax * by - ay * bx)
    for body in bodies_of(mechanism):
        inside = body.holds(middles)
        moved_mm = motion.moved_mm[:, :, motion.mesh.triangles[:3]].mean(axis=2)[:, :, inside]
        rows = []
        for step in moved_mm:
            pose = rigid_motion(middles[:, inside], step, areas[inside], body.centroid_mm, large=True)
            rows.append((pose.x_mm, pose.y_mm, pose.angle_mrad))
        if not body.is_fixed:
            poses[body.name] = np.array(rows)
    return pairs, poses


def rows_of(path: Path) -> list[dict[str, str]]:
    """Rows of a table, none if there is no such file."""
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@dataclass(frozen=True)
class Judged:
    """Errors of one quantity and their standard uncertainties, of so many values that there may be."""

    name: str
    unit: str
    wanted: int
    errors: tuple[float, ...] = ()
    u: tuple[float, ...] = ()

    @property
    def line(self) -> str:
        """One line of what is printed."""
        if not self.errors:
            return f"{self.name}: 0 of {self.wanted}"
        errors, u = np.abs(self.errors), np.array(self.u)
        return (
            f"{self.name}: {within(errors / u)} (there may be {self.wanted}), largest {errors.max():.4f} {self.unit} "
            f"(median u {np.median(u):.4f})"
        )

    def __add__(self, other: "Judged") -> "Judged":
        return Judged(self.name, self.unit, self.wanted + other.wanted, self.errors + other.errors, self.u + other.u)


def pairs_judged(out: Path, pairs: dict[str, Array]) -> Iterator[Judged]:
    """Hold what gauges.csv says of each pair against the truth."""
    gauges = rows_of(out / "gauges.csv")
    for name, truth in pairs.items():
        seen = [(row["value"], row["u"]) for row in gauges if row["gauge"] == name]
        known = [(float(value) - truth[k], float(u)) for k, (value, u) in enumerate(seen) if value]
        yield Judged(name, "mm", truth.size, tuple(error for error, _ in known), tuple(u for _, u in known))


def poses_judged(out: Path, poses: dict[str, Array], frames: int) -> Iterator[Judged]:
    """Hold what bodies.csv says of the moving bodies together against the truth."""
    bodies = rows_of(out / "bodies.csv")
    for axis, part in enumerate(("x_mm", "y_mm", "angle_mrad")):
        known = [(float(row[part]) - pose[k, axis], float(row[f"u_{part}"])) for name, pose in poses.items()
                 for k, row in enumerate(row for row in bodies if row["body"] == name)
                 if row["status"] == "ok"]  # fmt: skip
        yield Judged(f"pose {part}", part.rpartition("_")[2], frames * len(poses),
                     tuple(error for error, _ in known), tuple(u for _, u in known))  # fmt: skip


@benchmark(films=10, frames=24, seed=1, only={"type": int, "nargs": "*"}, keep="")
def main(given: Namespace) -> None:
    """Draw, measure, judge, print."""
    total: dict[str, Judged] = {}
    for number in in_turn(range(given.films)):
        if given.only and number not in given.only:
            continue
        rng = np.random.default_rng([given.seed, number])
        subject = SUBJECTS[number % len(SUBJECTS)]
        mechanism, motion = driven(subject, given.frames)
        view = view_of(mechanism, subject.px_per_mm, rng)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(given.keep or name) / f"film{number}"
            (folder / "film").mkdir(parents=True, exist_ok=True)
            for frame, picture in enumerate(pictures(motion, view, rng)):
                cv2.imwrite(str(folder / "film" / f"{frame:03}.png"), picture)
            done = subprocess.run(
                [sys.executable, "-m", "fingervision", "measure", str(folder / "film"), "--rate-hz", "25",
                 "--px-per-mm", f"{subject.px_per_mm:g}", "--mechanism", str(subject.path), "--out",
                 str(folder / "out")], capture_output=True, text=True, check=False)  # fmt: skip
            print(f"{number} {mechanism.name}, {np.degrees(view.angle_rad):.1f} deg, "
                  f"{'dark' if view.is_dark else 'light'}, exit {done.returncode}", flush=True)  # fmt: skip
            if done.returncode:
                print("    " + done.stderr.strip().replace("\n", "\n    "))
            pairs, poses = truths(mechanism, motion)
            gaps = rows_of(folder / "out" / "gaps.csv")
            print(f"    gaps.csv: {sum(row['status'] == 'ok' for row in gaps)} of {given.frames} frames with a gap")
            for kind, found in (("pairs", pairs_judged(folder / "out", pairs)),
                                ("", poses_judged(folder / "out", poses, given.frames))):  # fmt: skip
                for each in found:
                    print(f"    {each.line}", flush=True)
                    own = kind or each.name
                    total[own] = total.get(own, Judged(own, each.unit, 0)) + each
    for each in total.values():
        print(f"all films, {each.line}")
