"""Poses from pictures: the paper's sample, deformed by finite elements, rendered, followed and diagnosed.

    PYTHONPATH=. python -m tests.benchmarks.bodies_in_pictures --frames 40 --px-per-mm 6 --out /tmp/bodies

A hinge of the right half sits 0.2 mm off where it is drawn. The picture is drawn from the deformed outline, with blur
and noise; the truth of every body is the rigid motion nearest to the displacements of its area. Printed: how often the
motion since the first frame lies within 2 u of the truth, the uncertainties, and the place that the poses tell.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from click.testing import CliRunner

from fingervision.cli import cli as fingervision
from fingervision.diagnosis.bodies.body_prediction import BodyPrediction
from fingervision.diagnosis.bodies.place_search import PlaceSearch
from fingervision.diagnosis.bodies.place_words import set_words
from fingervision.measuring.body_outlines import Placement
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.mechanism_bodies import bodies_of, plate_poses
from fingervision.models.place_answers import PlaceAnswers
from fingervision.rendering import Camera, Patch, Scene, render
from fingervision.rendering.deformed_plate import deformed_outlines
from tests.benchmarks.which_hinge import BODIES, Array, drawn, shifted

SAMPLE = Path("sample_frames/paper/gripper.toml")


NODES = (-0.3, 0.3, 0.6, 0.9, 1.2)


def deformed(model: MechanismPlate) -> Callable[[float], Array]:
    """Return displacements in the deformed shape: a polynomial through equilibria and rest, good to nanometres."""
    fields = np.array([model.state(u, large_rotation=True).displacement_mm / u for u in NODES])

    def at(u: float) -> Array:
        weights = [np.prod([(u - other) / (own - other) for other in NODES if other != own]) for own in NODES]
        return np.asarray(u * np.array(weights) @ fields)

    return at


def main(arguments: Sequence[str] | None = None) -> None:
    """Render, measure, look for the place, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--px-per-mm", type=float, default=6.0)
    parser.add_argument("--noise", type=float, default=2.0)
    parser.add_argument("--off-mm", type=float, default=0.2)
    parser.add_argument("--out", type=Path, default=Path("/tmp/bodies_in_pictures"))
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    rng = np.random.default_rng(given.seed)
    scale = given.px_per_mm
    model = MechanismPlate(shifted(2, given.off_mm, 0.0) if given.off_mm else drawn())
    plate, field = model.plate, deformed(model)
    points = {body.name: body.centroid_mm for body in bodies_of(drawn())}
    bodies = [replace(body, centroid_mm=points[body.name]) for body in model.bodies]
    width, height = round(scale * 104), round(scale * 116)
    place = Placement(scale, np.array([0.5 * width + 0.3, scale * 108]), 0.004, False)
    half = given.frames // 2
    inputs = np.concatenate([np.linspace(-0.3, 1.2, half), np.linspace(1.2, -0.3, given.frames - half)])
    folder = given.out / "frames"
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.png"):
        old.unlink()
    truth = []
    for number, u in enumerate(inputs):
        moved = field(float(u))
        nodes = plate.nodes_mm + np.stack([moved[plate.x_dofs], moved[plate.y_dofs]])
        outlines = deformed_outlines(plate.outline_edges, place.to_px(nodes))
        scene = Scene(width_px=width, height_px=height, before=(Patch(outlines, 50.0),))
        picture = render(scene, Camera(blur_px=0.9, noise_grey=given.noise), rng)
        cv2.imwrite(str(folder / f"{number:04d}.png"), picture)
        truth.append(plate_poses(plate, bodies, moved, large=True))
    times = 0.1 * np.arange(given.frames)
    drive = given.out / "drive.csv"
    drive.write_text("time_s,input_mm\n" + "".join(f"{t:.3f},{u:.6f}\n" for t, u in zip(times, inputs, strict=True)))
    results = given.out / "measured"
    at = []
    for point in ((-39.0, 0.0), (39.0, 0.0), (0.0, 2.57)):
        x, y = place.to_px(np.array(point)[:, None])[:, 0]
        at += ["--at", f"{x + 1.5:.1f},{y - 1.0:.1f}={point[0]:g},{point[1]:g}"]
    run = CliRunner().invoke(
        fingervision,
        ["measure", str(folder), "--px-per-mm", str(scale), "--rate-hz", "10", "--drive", str(drive),
         "--drive-offset-s", "0", "--mechanism", str(SAMPLE), "--out", str(results), *at],
    )  # fmt: skip
    print(run.output, run.exception or "")
    rows = [line.split(",") for line in (results / "bodies.csv").read_text().splitlines()[1:]]
    inside: dict[str, list[bool]] = {"x_mm": [], "y_mm": [], "angle_mrad": []}
    sizes: dict[str, list[float]] = {"x_mm": [], "y_mm": [], "angle_mrad": []}
    first: dict[str, list[float]] = {}
    for row in rows:
        frame, name = int(row[0]), row[2]
        if row[3] != "ok" or name not in truth[frame]:
            continue
        seen, u = [float(v) for v in row[4:7]], [float(v) for v in row[7:10]]
        pose = truth[frame][name]
        error = [s - t for s, t in zip(seen, (pose.x_mm, pose.y_mm, pose.angle_mrad), strict=True)]
        if name not in first:
            first[name] = error
            continue
        for k, part in enumerate(inside):
            inside[part].append(abs(error[k] - first[name][k]) < 2.0 * np.sqrt(2.0) * u[k])
            sizes[part].append(u[k])
    for part, hits in inside.items():
        unit_name = "um" if part.endswith("mm") else "mrad"
        size = np.median(sizes[part]) * (1e3 if unit_name == "um" else 1.0)
        print(f"{part}: {100 * np.mean(hits):.0f} % of {len(hits)} within 2 u, u {size:.3g} {unit_name}")
    names = tuple(f"{body}.{part}" for body in BODIES for part in inside)
    values: dict[str, dict[int, tuple[float, float]]] = {name: {} for name in names}
    for row in rows:
        for k, part in enumerate(inside):
            if row[3] == "ok" and f"{row[2]}.{part}" in values:
                values[f"{row[2]}.{part}"][int(row[0])] = float(row[4 + k]), float(row[7 + k])
    frames = sorted(set.intersection(*(set(each) for each in values.values())))
    measured = np.array([[values[name][frame][0] for name in names] for frame in frames])
    floors = np.array([np.median([values[name][frame][1] for frame in frames]) for name in names])
    prediction = BodyPrediction(PlaceAnswers(drawn()), names, inputs[frames])
    found = PlaceSearch(prediction, measured, (slice(0, len(frames)),), floors, timed=True).run(rng)
    print(f"{len(frames)} frames: {set_words(found.members) or 'nothing named'}")


if __name__ == "__main__":
    main()
