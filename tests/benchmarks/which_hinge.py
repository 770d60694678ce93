"""Identify a changed hinge, link or pivot by lumped flexures, in data from finite elements of the changed outline.

    PYTHONPATH=. python -m tests.benchmarks.which_hinge --tables 60

Every change is made in the outline of the published gripper, which is computed by plane-stress finite elements on its
own mesh. Play of a pivot is modelled by a cut through the neck, whose two faces are tied except for the slip. The
condensed bodies of the diagnosis are not used for the data. Tables have two runs, noise of various size and
correlation, an input error of 0.2 um, and a drawing that is rotated by a milliradian in the picture.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bmat, csr_matrix
from scipy.sparse.linalg import spsolve

from fingervision.diagnosis.bodies.body_evidence import body_evidence
from fingervision.domain.measured_table import Channel, MeasuredTable
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.gripper_mechanism import whole_mechanism
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_bodies import bodies_of, plate_poses
from fingervision.models.place_answers import PlaceAnswers
from fingervision.models.plane_shapes import Polygon
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.triangulate import triangulate
from fingervision.storage.gripper_toml import read_gripper
from tests.benchmarks.frame import Namespace, Tally, benchmark
from tests.benchmarks.scores import within

Array = NDArray[np.float64]

BODIES = ("left_finger", "right_finger", "drive")
POSES = tuple(f"{body}.{part}" for body in BODIES for part in ("x_mm", "y_mm", "angle_mrad"))
TIPS = ("left tip_x_mm", "right tip_x_mm")
HINGES = ("left hinge 1", "left hinge 2", "right hinge 1", "right hinge 2")
NECK_MM = 0.002
"""Width of the cut through a pivot's neck, in mm: as if rigid, it makes a neck of 1 mm stiffer by a thousandth."""


@dataclass(frozen=True)
class Hidden:
    """A simulated change: effect, places that count as right, response of each channel per 1 mm of input, and size."""

    effect: str
    places: tuple[str, ...]
    words: str
    slopes: dict[str, float]
    size: float
    slip: tuple[Array, Array, dict[str, Array], float] | None = None


@cache
def drawn() -> Mechanism:
    """Drawing of the published gripper as a mechanism."""
    gripper = read_gripper(Path("sample_frames/paper/gripper.toml"))
    return whole_mechanism(gripper, gripper, "gripper")


def slopes_of(mechanism: Mechanism) -> dict[str, float]:
    """Response of every channel per 1 mm of input; poses refer to the reference points of the unchanged drawing."""
    own = MechanismPlate(mechanism)
    state = own.state(1.0)
    points = {body.name: body.centroid_mm for body in bodies_of(drawn())}
    bodies = [replace(body, centroid_mm=points[body.name]) for body in own.bodies]
    return _channels(own.plate, bodies, state.displacement_mm, state.force_n, state.probes_mm)


def _channels(plate, bodies, moved, force_n, probes) -> dict[str, float]:  # type: ignore[no-untyped-def]
    poses = plate_poses(plate, bodies, moved, large=False)
    found = {f"{name}.{part}": getattr(pose, part) for name, pose in poses.items()
             for part in ("x_mm", "y_mm", "angle_mrad")}  # fmt: skip
    left, right = probes["left tip"], probes["right tip"]
    return found | {"gap_mm": right[0] - left[0], "force_n": force_n, TIPS[0]: left[0], TIPS[1]: right[0]}


def thicker(number: int, thickness_mm: float) -> Mechanism:
    """Drawing in which one hinge has another thickness."""
    mechanism = drawn()
    flexures = list(mechanism.flexures)
    flexures[number] = replace(flexures[number], thickness_mm=thickness_mm)
    return replace(mechanism, flexures=tuple(flexures))


def shifted(number: int, x_mm: float, y_mm: float) -> Mechanism:
    """Drawing in which one hinge has another position."""
    mechanism = drawn()
    flexures = list(mechanism.flexures)
    x, y = flexures[number].at_mm
    flexures[number] = replace(flexures[number], at_mm=(x + x_mm, y + y_mm))
    return replace(mechanism, flexures=tuple(flexures))


@cache
def slipping_fields(number: int) -> tuple[PlaneStressPlate, Array, Array]:
    """Cut a neck, and tie the two faces of the cut.

    Returned are the plate, its displacements by 1 mm of input and by slips of 1 mm along x and y, shape (unknowns, 3),
    and the pull of the ties by the same three, shape (2, 3). Tied without a slip, the sample takes the force of the
    uncut one to 2e-4; with the faces' means tied instead of their nodes it differed by -1 to +6 %.
    """
    mechanism = drawn()
    flexure = mechanism.flexures[number]
    h, w = flexure.thickness_mm, 0.5 * NECK_MM
    slab = Polygon(tuple(flexure.point_mm(a, b) for a, b in ((-w, -h), (w, -h), (w, h), (-w, h))))
    region = mechanism.region
    cut = type(region)((*region.steps, (False, slab)), region.marks_mm)
    zones = tuple(each.zone(mechanism.plate_mm) for each in mechanism.flexures)
    plate = PlaneStressPlate(
        triangulate(cut, 4.0, 0.025 * region.size_mm), mechanism.material, mechanism.plate_mm, zones
    )
    x, y = plate.nodes_mm
    near = 1e-6 * region.size_mm
    held = []
    for face in mechanism.fixed:
        x0, x1, y0, y1 = face.box_mm
        on = (x > x0 - near) & (x < x1 + near) & (np.abs(y - y0) < near)
        held += [plate.x_dofs[on], plate.y_dofs[on]]
        del y1
    on = driven_nodes(plate)
    held.append(plate.x_dofs[on])
    fixed, driven = np.concatenate(held), plate.y_dofs[on]
    along = (x - flexure.at_mm[0]) * np.cos(np.radians(flexure.axis_deg)) + (y - flexure.at_mm[1]) * np.sin(
        np.radians(flexure.axis_deg)
    )
    across = -(x - flexure.at_mm[0]) * np.sin(np.radians(flexure.axis_deg)) + (y - flexure.at_mm[1]) * np.cos(
        np.radians(flexure.axis_deg)
    )
    inside = np.abs(across) < 0.6 * h
    near_side, far_side = (np.flatnonzero(inside & (np.abs(along - side * w) < 1e-6)) for side in (-1.0, 1.0))
    # Node by node: all of the neck goes along with the slip, and bends as if there were no cut.
    pairs = list(zip(near_side[np.argsort(across[near_side])], far_side[np.argsort(across[far_side])], strict=True))
    size, count = plate.unknowns, len(pairs)
    ties = np.zeros((2 * count, size))
    for row, (one, other) in enumerate(pairs):
        for direction, dofs in enumerate((plate.x_dofs, plate.y_dofs)):
            ties[direction * count + row, dofs[other]] = 1.0
            ties[direction * count + row, dofs[one]] = -1.0
    tie = csr_matrix(ties)
    free = np.setdiff1d(np.arange(size), np.concatenate([fixed, driven]))
    K = plate.stiffness_n_mm.tocsr()
    T = tie[:, free]
    whole = bmat([[K[free][:, free], T.T], [T, None]], format="csc")
    unit = np.zeros(size)
    unit[driven] = 1.0
    right = np.zeros((free.size + 2 * count, 3))
    right[: free.size, 0] = -(K @ unit)[free]
    # The flexure's axis says which face is the far one: a slip moves the far body against the near one.
    right[free.size : free.size + count, 1] = right[free.size + count :, 2] = 1.0
    solved = spsolve(whole, right)
    pull = solved[free.size :].reshape(2, count, 3).sum(axis=1)
    moved = np.zeros((size, 3))
    moved[free] = solved[: free.size]
    moved[:, 0] += unit
    return plate, moved, -pull


def slipping(number: int) -> tuple[Array, Array, dict[str, Array]]:
    """Load on a cut neck per input, stiffness against a slip, and response of every channel to input and slip."""
    plate, moved, forces = slipping_fields(number)
    x, y = plate.nodes_mm
    mechanism, driven = drawn(), driven_nodes(plate)
    unit = np.zeros(plate.unknowns)
    unit[plate.y_dofs[driven]] = 1.0
    K = plate.stiffness_n_mm.tocsr()
    bodies = bodies_of(drawn())
    tips = {}
    for probe in ("left tip", "right tip"):
        at = mechanism.probes[probe]
        node = np.argsort(np.hypot(x - at[0], y - at[1]))[:2]
        tips[probe] = node
    columns: dict[str, list[float]] = {}
    for k in range(3):
        own = moved[:, k]
        probes = {name: (float(own[plate.x_dofs[n]].mean()), 0.0) for name, n in tips.items()}
        for name, value in _channels(plate, bodies, own, float(unit @ (K @ own)), probes).items():
            columns.setdefault(name, []).append(value)
    return -forces[:, 0], forces[:, 1:], {name: np.array(values) for name, values in columns.items()}


def driven_nodes(plate: PlaneStressPlate) -> NDArray[np.bool_]:
    """Nodes of the driven face."""
    mechanism, (x, y) = drawn(), plate.nodes_mm
    near = 1e-6 * mechanism.region.size_mm
    x0, x1, y0, _ = mechanism.drives[0].face.box_mm
    return np.asarray((x > x0 - near) & (x < x1 + near) & (np.abs(y - y0) < near))


def slip_at(load: Array, stiffness: Array, u: float, radius: float) -> Array:
    """Find the position of the pin in its hole by trying 3600 directions: slow, but independent of the package."""
    free = np.linalg.solve(stiffness, load * u)
    if np.hypot(*free) <= radius:
        return np.asarray(free)
    angle = np.linspace(0.0, 2.0 * np.pi, 3601)
    rim = radius * np.stack([np.cos(angle), np.sin(angle)])
    energy = 0.5 * np.einsum("in,ij,jn->n", rim, stiffness, rim) - (load * u) @ rim
    return np.asarray(rim[:, int(np.argmin(energy))])


def hidden_things(seed: int) -> list[Hidden]:
    """Random changes: none, hinge stiffness by 10 to 20 %, link length by 1 to 1.5 %, play of 20 um in a pivot."""
    rng = np.random.default_rng(seed)
    found = [Hidden("", (), "nothing", slopes_of(drawn()), 0.0)]
    for number, hinge in enumerate(HINGES):
        # The bending stiffness of a notch is proportional to t^2.5 / sqrt(R); the factor of t is (1.10 to 1.20)^0.4.
        ratio = rng.uniform(0.10, 0.20) * (1.0 if number % 2 else -1.0)
        found.append(Hidden("hinge_stiffness_error", (hinge,), f"{hinge} {100 * ratio:+.0f} %",
                            slopes_of(thicker(number, (1.0 + ratio) ** 0.4)), ratio))  # fmt: skip
    for number, (hinge, x) in enumerate(zip(HINGES, (-35.5, -17.68, 35.5, 17.68), strict=True)):
        side = hinge.split()[0]
        ratio = rng.uniform(0.010, 0.015) * (1.0 if number in (0, 3) else -1.0)
        out = np.sign(x) * (1.0 if hinge.endswith("1") else -1.0)
        place = f"{side}_finger, {side} hinge 1 to {side} hinge 2"
        found.append(Hidden("link_length_error", (place,), f"{place} {100 * ratio:+.1f} % at {hinge}",
                            slopes_of(shifted(number, out * 17.82 * ratio, 0.0)), ratio))  # fmt: skip
    for number in (0, 2):
        side, ratio = HINGES[number].split()[0], rng.uniform(0.010, 0.015)
        place = f"{side}_pillar, {side} clamp to {side} hinge 1"
        found.append(Hidden("link_length_error", (place,), f"{place} {100 * ratio:+.1f} %",
                            slopes_of(shifted(number, 0.0, 30.0 * ratio)), ratio))  # fmt: skip
    for number, hinge in enumerate(HINGES):
        load, stiffness, columns = slipping(number)
        slopes = {name: float(values[0]) for name, values in columns.items()}
        by_slip = {name: values[1:] for name, values in columns.items()}
        slip = (load, stiffness, by_slip, 0.01)
        found.append(Hidden("hinge_play", (hinge,), f"{hinge} 20 um of play", slopes, 0.02, slip))
    return found


def table_of(hidden: Hidden, rng: np.random.Generator, rows: int = 200) -> MeasuredTable:
    """Simulate a table with two runs, one opening and one closing."""
    low, high = rng.uniform(-0.45, -0.3), rng.uniform(1.0, 1.5)
    way = np.linspace(low, high, rows // 2)
    u = np.concatenate([way, way[::-1]])
    u_mm, u_mrad, rho = rng.uniform(0.6e-3, 1.2e-3), rng.uniform(0.03, 0.06), rng.choice([0.0, 0.0, 0.3, 0.5])
    turned = rng.normal(0.0, 1e-3)
    real = u + rng.normal(0.0, 0.0002, u.size)
    slip = np.zeros((u.size, 2))
    if hidden.slip is not None:
        load, stiffness, _, radius = hidden.slip
        slip = np.array([slip_at(load, stiffness, float(value), radius) for value in real])

    def clean(name: str) -> Array:
        own = hidden.slopes[name] * real
        return own if hidden.slip is None else own + slip @ hidden.slip[2][name]

    def noise(sd: float) -> Array:
        white = rng.normal(0.0, sd, u.size)
        for k in range(1, u.size):
            white[k] = rho * white[k - 1] + np.sqrt(1.0 - rho**2) * white[k]
        return white

    channels = {}
    for body in BODIES:
        x, y, angle = (clean(f"{body}.{part}") for part in ("x_mm", "y_mm", "angle_mrad"))
        seen = {"x_mm": x - turned * y, "y_mm": y + turned * x, "angle_mrad": angle}
        for part, rows_of in seen.items():
            sd = u_mrad if part == "angle_mrad" else u_mm
            value = rows_of + rng.normal(0.0, 0.01) + noise(sd)
            channels[f"{body}.{part}"] = Channel(value, np.ones(u.size, dtype=bool), np.full(u.size, sd))
    left, right = (clean(name) + side * 2.0 + noise(0.7 * u_mm) for name, side in zip(TIPS, (-1.0, 1.0), strict=True))
    half = u.size // 2
    return MeasuredTable(
        u, right - left, 0.5 * (left + right), 0.1 * np.arange(u.size), (slice(0, half), slice(half, u.size)),
        ("1", "2"), np.full(u.size, u_mm), channels=channels,
    )  # fmt: skip


def gap_alone(table: MeasuredTable) -> MeasuredTable:
    """Reduce a table to the motions of both fingertips across the fingers."""
    left, right = table.midline_mm - 0.5 * table.gap_mm, table.midline_mm + 0.5 * table.gap_mm
    seen = np.ones(left.size, dtype=bool)
    own = {name: Channel(side, seen, table.u_random_mm) for name, side in zip(TIPS, (left, right), strict=True)}
    return replace(table, channels=own)


def judged(hidden: Hidden, answers: PlaceAnswers, table: MeasuredTable) -> tuple[str, int, str, float | None]:
    """Judge an answer: whether it contains the true place, number of places, words, and error of the size in u."""
    evidence, _ = body_evidence(table, answers, table.input_mm, np.random.default_rng(1))
    if evidence is None:
        return "nothing", 0, "", None
    findings = evidence.findings
    keys = list(dict.fromkeys(m.candidate.key for m in findings.members)) if not findings.structure else []
    if not keys:
        return "nothing", 0, f"structure {findings.structure:.0f}" if findings.structure else "", None
    right = any(key == f"{hidden.effect}@{place}" for key in keys for place in hidden.places)
    told = [m for m in findings.members if m.candidate.key == f"{hidden.effect}@{hidden.places[0]}"] if right else []
    off = (told[0].size - hidden.size) / told[0].u_stated if told else None
    return ("named" if len(keys) == 1 else "in the set") if right else "wrong", len(keys), " | ".join(keys), off


def together(one: Hidden, other: Hidden) -> Hidden:
    """Combine two changes by adding their effects on the slopes; the neglected product is about 1e-4."""
    plain = slopes_of_drawn()
    slopes = {name: one.slopes[name] + other.slopes[name] - plain[name] for name in plain}
    slips = [each for each in (one, other) if each.slip is not None]
    words = f"{one.words} and {other.words}"
    return Hidden("two", (), words, slopes, 0.0, slips[0].slip if slips else None)


@cache
def slopes_of_drawn() -> dict[str, float]:
    """Response of the unchanged drawing."""
    return slopes_of(drawn())


def two_causes(things: Sequence[Hidden], answers: PlaceAnswers, tables: int, rng: np.random.Generator) -> None:
    """Print results for tables with two changes; a named place is wrong if it contains neither change."""
    tally = Tally("one of them, or both in a set", "wrong place", "unknown", "nothing")
    for _ in range(tables):
        first, second = (things[k] for k in rng.choice(np.arange(1, len(things)), 2, replace=False))
        if first.slip is not None and second.slip is not None:
            continue
        table = table_of(together(first, second), rng)
        evidence, _ = body_evidence(table, answers, table.input_mm, np.random.default_rng(1))
        findings = None if evidence is None else evidence.findings
        keys = [] if findings is None else [m.candidate.key for m in findings.members]
        true = {f"{each.effect}@{place}" for each in (first, second) for place in each.places}
        # Two links that are mirror images form one explanation, which has the name of one of the links.
        pairs = {key for key in keys for each in (first, second) for place in each.places if f"@{place} and its" in key}
        if findings is not None and findings.structure:
            said = "unknown"
        elif not keys:
            said = "nothing"
        else:
            said = "one of them, or both in a set" if true & set(keys) or pairs else "wrong place"
        tally.add(["two causes"], [said])
        if said in ("wrong place", "nothing"):
            print(f"  {first.words} and {second.words}: {said} {' | '.join(dict.fromkeys(keys))}", flush=True)
    tally.show()


@benchmark(tables=60, seed=1, two={"type": int, "default": 0, "help": "tables with two things hidden"}, verbose=False)
def main(given: Namespace) -> None:
    """Print the results of all tables, and their statistics."""
    began = time.perf_counter()
    answers = PlaceAnswers(drawn())
    things = hidden_things(given.seed)
    print(f"{len(things)} hidden things by finite elements: {time.perf_counter() - began:.0f} s")
    tally = Tally("named", "in the set", "wrong", "nothing")
    offs: dict[str, list[float]] = {}
    sizes: dict[str, list[int]] = {"gap": [], "bodies": []}
    rng = np.random.default_rng(given.seed + 1000)
    for number in range(given.tables):
        # Every fourth table contains no change.
        thing = things[0] if number % 4 == 0 else things[1 + (number - number // 4 - 1) % (len(things) - 1)]
        table = table_of(thing, rng)
        verdict, size, words, off = judged(thing, answers, table)
        if off is not None:
            offs.setdefault(thing.effect, []).append(off)
        kind = thing.effect or "nothing"
        tally.add([kind], [verdict])
        if thing.effect:
            other, plain, _, _ = judged(thing, answers, gap_alone(table))
            if verdict in ("named", "in the set") and other in ("named", "in the set"):
                sizes["gap"].append(plain)
                sizes["bodies"].append(size)
        if given.verbose or verdict == "wrong" or (verdict == "nothing") == bool(thing.effect):
            print(f"  {thing.words}: {verdict} {words}", flush=True)
    if given.two:
        two_causes(things, answers, given.two, rng)
    tally.show()
    for effect, values in offs.items():
        print(f"{effect}: size {within(values, 1.96)}")
    null = tally.of["nothing"]
    planted = tally.of["all"] - null
    right = planted["named"] + planted["in the set"]
    print(f"{given.tables} tables: {right} of {planted.total()} at the right place or in the set, "
          f"{planted['wrong']} wrong")  # fmt: skip
    print(f"claims where nothing is hidden: {null.total() - null['nothing']} of {null.total()}")
    if sizes["gap"]:
        print(
            f"places in the answer: tips alone {np.mean(sizes['gap']):.1f}, with bodies {np.mean(sizes['bodies']):.1f}"
        )
    print(f"{time.perf_counter() - began:.0f} s")
