"""Which hinge or link is off, from rendered recordings: drawn by finite elements, followed in pictures, diagnosed.

    PYTHONPATH=. python -m tests.benchmarks.hinges_in_recordings --recordings 20

As `which_hinge`, but with pictures in between: every recording shows the paper's sample with one hinge 10 to 20 % off
its stiffness or one link 1 to 1.5 % off its length (every fifth: nothing), deformed with large rotations, rendered with
blur, noise and a turn of its own. Poses are those of `measure --mechanism`; what is told is held against what was
hidden. Two causes, and a pivot's play, are in `which_hinge` alone. `--bodies` leaves poses out. The
sample's drive bends: its edges move by up to 4 um otherwise than its area, which the model predicts; before the search
allowed for that, every recording was `structure` and none was answered.
"""

import argparse
import time
from collections import Counter
from collections.abc import Sequence

import numpy as np

from calib.calibration import BareScale
from fingervision.diagnosis.bodies.body_prediction import BodyPrediction
from fingervision.diagnosis.bodies.place_search import PlaceSearch
from fingervision.domain.frame import Frame
from fingervision.measuring.body_outlines import Placement
from fingervision.measuring.body_poses import BodyTracker
from fingervision.measuring.drawing_placement import GivenPoint
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_plate import MechanismPlate
from fingervision.models.place_answers import PlaceAnswers
from fingervision.rendering import Camera, Patch, Scene, render
from fingervision.rendering.deformed_plate import deformed_outlines
from tests.benchmarks.which_hinge import BODIES, HINGES, Array, drawn, shifted, thicker

NODES = (-0.3, 0.45, 1.2)
"""Equilibria through which, and through rest, displacements are a polynomial of the input (mm)."""
PARTS = ("x_mm", "y_mm", "angle_mrad")


def hidden(number: int, rng: np.random.Generator) -> tuple[Mechanism, str, str]:
    """Draw what is hidden in one recording: the mechanism, the key that names it, words."""
    if number % 5 == 0:
        return drawn(), "", "nothing"
    hinge = int(rng.integers(4))
    side = HINGES[hinge].split()[0]
    sign = float(rng.choice([-1.0, 1.0]))
    if number % 2:
        ratio = sign * rng.uniform(0.10, 0.20)
        return (
            thicker(hinge, (1.0 + ratio) ** 0.4), f"hinge_stiffness_error@{HINGES[hinge]}",
            f"{HINGES[hinge]} {100 * ratio:+.0f} %",
        )  # fmt: skip
    ratio = sign * rng.uniform(0.010, 0.015)
    out = np.sign((-35.5, -17.68, 35.5, 17.68)[hinge]) * (1.0 if hinge % 2 == 0 else -1.0)
    place = f"{side}_finger, {side} hinge 1 to {side} hinge 2"
    return shifted(hinge, out * 17.82 * ratio, 0.0), f"link_length_error@{place}", f"{place} {100 * ratio:+.1f} %"


def poses_of(
    mechanism: Mechanism, inputs: Array, scale: float, bodies: Sequence[str], rng: np.random.Generator
) -> tuple[Array, Array, Array]:
    """Render a recording and follow it: rows with all poses, the poses, and their random uncertainty."""
    model = MechanismPlate(mechanism)
    plate = model.plate
    fields = np.array([model.state(u, large_rotation=True).displacement_mm / u for u in NODES])
    width, height = round(scale * 104), round(scale * 116)
    origin = np.array([0.5 * width, scale * 108]) + rng.uniform(-1.0, 1.0, 2)
    place = Placement(scale, origin, rng.uniform(-0.01, 0.01), False)
    blur, noise = rng.uniform(0.7, 1.3), rng.uniform(1.0, 3.0)
    frames = []
    for number, u in enumerate(inputs):
        weights = [np.prod([(u - other) / (own - other) for other in NODES if other != own]) for own in NODES]
        moved = u * np.array(weights) @ fields
        nodes = plate.nodes_mm + np.stack([moved[plate.x_dofs], moved[plate.y_dofs]])
        scene = Scene(width_px=width, height_px=height, before=(
            Patch(deformed_outlines(plate.outline_edges, place.to_px(nodes)), 50.0),))  # fmt: skip
        frames.append(Frame(render(scene, Camera(blur_px=blur, noise_grey=noise), rng), number, 0.1 * number))
    points = []
    for point in ((-39.0, 0.0), (39.0, 0.0), (0.0, 2.57)):
        x, y = place.to_px(np.array(point)[:, None])[:, 0] + rng.uniform(-1.5, 1.5, 2)
        points.append(GivenPoint(float(x), float(y), *point))
    rows, values, u_values = [], [], []
    for number, seen in enumerate(BodyTracker(drawn(), BareScale(scale), points).poses(frames)):
        poses = [seen.poses[body] for body in bodies]
        if any(pose.x_mm is None or pose.random is None for pose in poses):
            continue
        rows.append(number)
        values.append([value for pose in poses for value in (pose.x_mm, pose.y_mm, pose.angle_mrad)])
        u_values.append([value for pose in poses for value in np.sqrt(np.diag(np.asarray(pose.random)))])
    return np.array(rows), np.array(values), np.median(np.array(u_values), axis=0)


def main(arguments: Sequence[str] | None = None) -> None:
    """Render, follow, diagnose, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recordings", type=int, default=20)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--px-per-mm", type=float, default=6.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--bodies", nargs="+", choices=BODIES, default=list(BODIES))
    given = parser.parse_args(arguments)
    answers = PlaceAnswers(drawn())
    names = tuple(f"{body}.{part}" for body in given.bodies for part in PARTS)
    counts: Counter[str] = Counter()
    for number in range(given.recordings):
        began = time.process_time()
        rng = np.random.default_rng([given.seed, number])
        mechanism, key, words = hidden(number, rng)
        half = given.frames // 2
        inputs = np.concatenate([np.linspace(-0.3, 1.2, half), np.linspace(1.2, -0.3, given.frames - half)])
        rows, measured, floors = poses_of(mechanism, inputs, given.px_per_mm, given.bodies, rng)
        prediction = BodyPrediction(answers, names, inputs[rows] + rng.normal(0.0, 2e-4, rows.size))
        found = PlaceSearch(prediction, measured, (slice(0, rows.size),), floors, timed=True).run(rng)
        told = list(dict.fromkeys(member.candidate.key for member in found.members)) if not found.structure else []
        if not told:
            verdict = "claims nothing" if not key else "missed"
        elif not key:
            verdict = "claim where nothing is"
        else:
            verdict = ("named" if len(told) == 1 else "in the set") if key in told else "wrong place"
        counts[verdict] += 1
        print(
            f"{words}: {verdict} {' | '.join(told)} ({rows.size} of {given.frames} frames, "
            f"structure {found.structure:.0f}, {time.process_time() - began:.0f} s)", flush=True,
        )  # fmt: skip
    print(", ".join(f"{name} {count}" for name, count in counts.items()))


if __name__ == "__main__":
    main()
