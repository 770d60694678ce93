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

import time
from collections import Counter
from collections.abc import Sequence

import numpy as np

from calib.calibration import BareScale
from fingervision.diagnosis.bodies.body_prediction import BodyPrediction
from fingervision.diagnosis.bodies.place_findings import PlaceFindings
from fingervision.diagnosis.bodies.place_search import PlaceSearch
from fingervision.domain.body_poses import FramePoses
from fingervision.domain.errors import FingervisionError
from fingervision.measuring.body_poses import BodyTracker
from fingervision.measuring.drawing_placement import GivenPoint
from fingervision.models.mechanism_bodies import bodies_of, plate_poses
from fingervision.models.place_answers import PlaceAnswers
from tests.benchmarks.drawn_hinges import Hidden, frames_of, hidden, view_of
from tests.benchmarks.frame import Namespace, Tally, benchmark
from tests.benchmarks.scores import within
from tests.benchmarks.which_hinge import BODIES, Array, drawn

PARTS = ("x_mm", "y_mm", "angle_mrad")
VIEWS, KINDS = ("plain", "alike", "mirrored", "scaled"), ("nothing", "hinge", "link", "play")
VERDICTS = ("named", "in the set", "wrong place", "unknown", "missed", "claims nothing", "claim where nothing is",
            "too few rows", "refused")  # fmt: skip
GIVEN_MM = ((-39.0, 0.0), (39.0, 0.0), (0.0, 2.57))


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
    """Count `ok` poses of moving bodies that are off the truth by 0.2 mm or 5 mrad and four stated uncertainties."""
    points = {body.name: body for body in bodies_of(drawn())}
    bodies, wrong = [points[name] for name in BODIES], 0
    for each, u in zip(seen, inputs, strict=True):
        truth = plate_poses(what.model.plate, bodies, what.moved_at(float(u)), large=True)
        for name in BODIES:
            pose = each.poses[name]
            if pose.x_mm is not None and pose.y_mm is not None and pose.angle_mrad is not None:
                u_x, u_y, u_angle = np.sqrt(np.diag(np.asarray(pose.covariance)))
                off = np.hypot(pose.x_mm - truth[name].x_mm, pose.y_mm - truth[name].y_mm)
                turned = abs(pose.angle_mrad - truth[name].angle_mrad)
                wrong += bool(off > 0.2 + 4.0 * np.hypot(u_x, u_y) or turned > 5.0 + 4.0 * u_angle)
    return wrong


def verdict_of(what: Hidden, found: PlaceFindings, scale_off: float) -> tuple[str, list[str], list[float]]:
    """What is told, held against what was hidden: a verdict, the places, and errors of sizes over their stated u."""
    told = list(dict.fromkeys(member.candidate.key for member in found.members)) if not found.structure else []
    if not told:
        return ("unknown" if found.structure else "claims nothing" if not what.sizes else "missed"), told, []
    if not what.sizes and scale_off == 0.0:
        return "claim where nothing is", told, []
    # Two links that mirror each other are one explanation: the pair, named by one of them.
    pairs = {key for key in told for own in what.sizes if f"@{own.partition('@')[2]} and its" in key}
    offs = [(member.size - what.sizes[key]) / member.u_stated for key in what.sizes
            for member in [m for m in found.members if m.candidate.key == key][:1]]  # fmt: skip
    # A stated scale that is off is an answer too, and then the right one.
    right = bool(offs) or (scale_off != 0.0 and "scale_error" in told) or (len(what.sizes) > 1 and bool(pairs))
    return (("named" if len(told) == 1 else "in the set") if right else "wrong place"), told, offs


@benchmark(
    recordings=20,
    frames=40,
    px_per_mm=6.0,
    seed=1,
    bodies={"nargs": "+", "choices": BODIES, "default": list(BODIES)},
    hidden={"choices": ("one", "two"), "default": "one"},
    view={"nargs": "+", "choices": VIEWS, "default": ["plain"]},
    points={"type": int, "choices": (2, 3), "default": 3},
)
def main(given: Namespace) -> None:
    """Render, follow, diagnose, print."""
    answers = PlaceAnswers(drawn())
    names = tuple(f"{body}.{part}" for body in given.bodies for part in PARTS)
    tally = Tally(*VERDICTS, "poses off")
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
            tally.add([view_kind], ["refused"])
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
            (verdict, told, own), structure = verdict_of(what, found, view.off), found.structure
            offs += own
        tally.add([view_kind], Counter({verdict: 1, "poses off": wrong}))
        print(
            f"{view_kind} {100 * view.off:+.1f} %, {what.words}: {verdict} {' | '.join(told)} ({rows.size} of "
            f"{given.frames} frames, {wrong} poses off, structure {structure:.0f}, "
            f"{time.process_time() - began:.0f} s) {' / '.join(notes)}", flush=True,
        )  # fmt: skip
    tally.show()
    if offs:
        print(f"sizes: {within(offs, 1.96)}")
