"""How often a body's pose lies within its stated uncertainty, where it was laid, scale, bias, lens and plane included.

    PYTHONPATH=. python -m tests.benchmarks.absolute_poses --cases 60

The scenes share nothing with the product: a body is boxes, a box seen through a Gaussian blur is the product of two
differences of error functions in its own axes, exactly; a pixel is the mean of it by Gauss and Legendre's points.
Every case draws where the mechanism lies (mirrored in every fourth), how each body moved, blur, noise, and with
`calibrated` the true scale and edge bias out of the calibration's own uncertainty, with `lens` a distortion and a
perspective that the calibration knows. With `lossy` the pictures are JPEG of quality 85. With `covered` a hand of
another level lies over a part of a moving body.
"""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from calib.calibration import BareScale
from calib.limits import Limits
from calib.measured_scale import Calibration, ScalePart
from calib.projection import Lens, Plane
from fingervision.domain.frame import Coding, Frame
from fingervision.measuring.body_poses import BodyTracker
from fingervision.measuring.drawing_placement import GivenPoint
from fingervision.measuring.scale import Scale
from fingervision.storage.mechanism_toml import mechanism_from_tables
from fingervision.vision.pipeline import LINEAR_CAMERA, Settings
from tests.benchmarks.frame import Namespace, benchmark
from tests.benchmarks.scores import within
from tests.diagnosis.lever_drawing import TABLES

Array = NDArray[np.float64]

WIDTH, HEIGHT = 330, 560
SCALE = 5.4
BOXES = {
    "pillar": ((31, 39, 0, 31),),
    "shuttle": ((14, 22, 10, 31),),
    "finger": ((10, 39, 40, 50), (10, 18, 50, 90), (31, 39, 37, 40), (14, 22, 37, 40)),
}
"""The lever of `tests/diagnosis/lever_drawing.py` between its notches, x and y in mm."""
NECKS = ((34.6, 35.4, 31, 37), (17.6, 18.4, 31, 37))
KNOWN_LIGHT = Settings(below_tip_px=1.0, camera=LINEAR_CAMERA)
"""The pictures' levels are light, and that is known."""
MIDDLE_MM = np.array([24.5, 45.0])
SUB = np.array([-0.5, 0.5]) / 3.0**0.5
"""Gauss and Legendre's two points of a pixel: the mean of what is of third order in it."""


@dataclass(frozen=True)
class Truth:
    """Where the drawing lies and how the bodies moved in it: angle in rad, x and y in mm about the body's centroid."""

    scale: float
    angle: float
    shift_px: Array
    is_mirrored: bool
    moves: dict[str, tuple[float, float, float]]
    grown_mm: float
    """Outward shift of every edge, in pixels of the picture over the scale."""


def picture(truth: Truth, centroids: dict[str, Array], seen: "Scale", blur_px: float, dark: bool) -> Array:
    """Draw the scene, without noise."""
    total = np.zeros((HEIGHT, WIDTH))
    by_x, by_y = stretches(seen)
    for sub_y in SUB:
        for sub_x in SUB:
            x, y = np.meshgrid(np.arange(WIDTH) + sub_x, np.arange(HEIGHT) + sub_y)
            points = np.stack([x.ravel(), y.ravel()], axis=1)
            flat = seen.flatten(points) if isinstance(seen, Calibration) else points
            away = (flat - truth.shift_px).T / truth.scale
            c, s = np.cos(truth.angle), np.sin(truth.angle)
            side = 1.0 if truth.is_mirrored else -1.0
            drawn = np.stack([c * away[0] + s * away[1], side * (-s * away[0] + c * away[1])]) + MIDDLE_MM[:, None]
            sigma = blur_px / truth.scale
            covered = np.zeros(points.shape[0])
            parts = [(name, box) for name, boxes in BOXES.items() for box in boxes]
            parts += [("finger", box) for box in NECKS]
            for name, (x0, x1, y0, y1) in parts:
                mx, my, turn = truth.moves[name]
                cc, ss = np.cos(turn), np.sin(turn)
                arm = drawn - (centroids[name] + (mx, my))[:, None]
                own_x = cc * arm[0] + ss * arm[1] + centroids[name][0]
                own_y = -ss * arm[0] + cc * arm[1] + centroids[name][1]
                # The sensor shifts an edge by pixels of the picture: in the plane by the stretch across it.
                turned = truth.angle + side * turn
                (g_x, g_y) = (truth.grown_mm * np.hypot(by_x @ n, by_y @ n)
                              for n in (np.array([np.cos(turned), np.sin(turned)]),
                                        np.array([-np.sin(turned), np.cos(turned)])))  # fmt: skip
                # Boxes of a body that abut are grown on their outer sides alone; necks are no edges.
                outer = (False,) * 4 if (x0, x1, y0, y1) in NECKS else _outer(name, (x0, x1, y0, y1))
                gx0, gx1, gy0, gy1 = (
                    g if is_outer else 0.0 for g, is_outer in zip((g_x, g_x, g_y, g_y), outer, strict=True)
                )
                across = ndtr((x1 + gx1 - own_x) / sigma) - ndtr((x0 - gx0 - own_x) / sigma)
                along = ndtr((y1 + gy1 - own_y) / sigma) - ndtr((y0 - gy0 - own_y) / sigma)
                covered += across * along
            total += covered.reshape(HEIGHT, WIDTH) / SUB.size**2
    ground, body = (205.0, 55.0) if dark else (55.0, 205.0)
    return ground + (body - ground) * np.clip(total, 0.0, 1.0)


def stretches(seen: "Scale") -> tuple[Array, Array]:
    """Motion in the plane by a pixel along x and along y, at every pixel; shape (pixels, 2)."""
    x, y = np.meshgrid(np.arange(WIDTH, dtype=float), np.arange(HEIGHT, dtype=float))
    points = np.stack([x.ravel(), y.ravel()], axis=1)
    if not isinstance(seen, Calibration):
        return np.tile([1.0, 0.0], (x.size, 1)), np.tile([0.0, 1.0], (x.size, 1))
    halves = np.array([[0.5, 0.0], [0.0, 0.5]])
    along = [seen.flatten(points + half) - seen.flatten(points - half) for half in halves]
    return along[0], along[1]


def _outer(name: str, box: tuple[float, ...]) -> tuple[bool, bool, bool, bool]:
    """Whether the sides of a box are the body's own outline: left, right, lower, upper."""
    y0, y1 = box[2:]
    if name != "finger" or (y0, y1) == (40, 50):
        return True, True, True, True
    return True, True, y0 != 50, y1 != 40


def centroid(name: str) -> Array:
    """Middle of the area of the product's own body."""
    return next(o.body.centroid_mm for o in BodyTracker(mechanism_of(), BareScale(SCALE)).outlines
                if o.body.name == name)  # fmt: skip


def mechanism_of():  # type: ignore[no-untyped-def]
    """Read the drawing."""
    return mechanism_from_tables(TABLES, "lever")


def joined_moves(centroids: Mapping[str, Array], turns: Array, slips: Array) -> dict[str, tuple[float, float, float]]:
    """Move finger and shuttle as their necks let them: turns in rad about each neck, and what each neck gives in mm.

    A neck is 6 mm long; bodies that no flexure could join would rightly have no pose.
    """
    first, second = (np.array([0.5 * (x0 + x1), 0.5 * (y0 + y1)]) for x0, x1, y0, y1 in NECKS)

    def turned(by: float, arm: Array) -> Array:
        c, s = np.cos(by), np.sin(by)
        return np.array([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]]) - arm

    finger = slips[0] + turned(turns[0], centroids["finger"] - first)
    shuttle = slips[0] + turned(turns[0], second - first) + slips[1] + turned(turns[1], centroids["shuttle"] - second)
    return {"pillar": (0.0, 0.0, 0.0), "shuttle": (*shuttle, turns[1]), "finger": (*finger, turns[0])}


def scale_of(kind: str, rng: np.random.Generator) -> tuple[Scale, float, float]:
    """Return the scale that is stated, the true one, and the true edge bias in px."""
    if kind in ("bare", "lossy", "covered"):
        return BareScale(SCALE), SCALE, 0.0
    u_scale, u_bias, bias = 2e-4 * SCALE, 0.05, 0.12
    none = Limits(estimator_px=0.0, plane_mm=0.0, tilt_deg=0.0, lens_relative=0.0, temperature_k=0.0)
    lens, plane = None, None
    if kind == "lens":
        lens = Lens(np.array([620.0, 620.0, 165.0, 280.0, -0.18, 0.05, 5e-4, -3e-4, 0.0]), np.zeros((9, 9)))
        tilt = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [4e-5, -3e-5, 1.0]])
        to = np.array([[1.0, 0.0, -164.5], [0.0, 1.0, -279.5], [0.0, 0.0, 1.0]])
        plane = Plane(np.linalg.inv(to) @ tilt @ to)
        u_scale, u_bias = 1e-9, 1e-9
    part = ScalePart("reference", np.diag([u_scale**2, u_bias**2]))
    made = Calibration(SCALE, bias, (part,), (WIDTH, HEIGHT), limits=none, lens=lens, plane=plane)
    return made, float(rng.normal(SCALE, u_scale)), float(rng.normal(bias, u_bias))


def hand(clean: Array, truth: Truth, rng: np.random.Generator) -> None:
    """Cover a disc of 6 to 10 mm about a point of a moving body's outline, with an edge blurred by 3 px."""
    at = np.array([(18.0, 70.0), (10.0, 60.0), (28.0, 50.0), (22.0, 20.0)][int(rng.integers(4))])
    away = at - MIDDLE_MM
    c, s, side = np.cos(truth.angle), np.sin(truth.angle), 1.0 if truth.is_mirrored else -1.0
    x, y = np.array([c * away[0] - side * s * away[1], s * away[0] + side * c * away[1]]) * truth.scale + truth.shift_px
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    share = ndtr((rng.uniform(6.0, 10.0) * truth.scale - np.hypot(columns - x, rows - y)) / 3.0)
    clean += share * (rng.uniform(90.0, 170.0) - clean)


def given_point(truth: Truth, scale: Scale, at: tuple[float, float], rng: np.random.Generator) -> GivenPoint:
    side = 1.0 if truth.is_mirrored else -1.0
    away = np.array(at) - MIDDLE_MM
    c, s = np.cos(truth.angle), np.sin(truth.angle)
    turned = np.array([c * away[0] - side * s * away[1], s * away[0] + side * c * away[1]])
    px = (turned * truth.scale + truth.shift_px)[None, :]
    if isinstance(scale, Calibration):
        px = scale.unflatten(px)
    x, y = px[0] + rng.uniform(-1.0, 1.0, 2)
    return GivenPoint(float(x), float(y), *at)


@benchmark(cases=60, seed=1, kinds={"nargs": "+", "default": ["bare", "calibrated", "lens", "lossy"]})
def main(given: Namespace) -> None:
    """Print the coverage of every kind."""
    centroids = {name: centroid(name) for name in BOXES}
    for kind in given.kinds:
        rng = np.random.default_rng([given.seed, len(kind)])
        scores, own, silent = defaultdict[str, list[float]](list), defaultdict[str, list[float]](list), 0
        for case in range(given.cases):
            scale, s_true, bias = scale_of(kind, rng)
            dark = bool(rng.random() < 0.7)
            truth = Truth(
                s_true, rng.uniform(-0.06, 0.06),
                np.array([0.5 * WIDTH, 0.5 * HEIGHT]) + rng.uniform(-4.0, 4.0, 2), case % 4 == 3,
                joined_moves(centroids, rng.uniform(-0.012, 0.012, 2), rng.uniform(-0.3, 0.3, (2, 2))),
                (0.5 if dark else -0.5) * bias / s_true,
            )  # fmt: skip
            blur, noise = rng.uniform(0.7, 1.6), rng.uniform(1.0, 4.0)
            clean = picture(truth, centroids, scale, blur, dark)
            if kind == "covered":
                hand(clean, truth, rng)
            grey = np.clip(np.round(clean + rng.normal(0.0, noise, clean.shape)), 0, 255).astype(np.uint8)
            coding = Coding.LOSSLESS
            if kind == "lossy":
                grey = cv2.imdecode(cv2.imencode(".jpg", grey, [cv2.IMWRITE_JPEG_QUALITY, 85])[1], cv2.IMREAD_GRAYSCALE)
                coding = Coding.INTRAFRAME
            points = tuple(given_point(truth, scale, at, rng) for at in ((31.0, 0.0), (39.0, 0.0), (35.0, 20.0)))
            seen = next(
                BodyTracker(mechanism_of(), scale, points, KNOWN_LIGHT).poses([Frame(grey, 0, 0.0, coding)])
            ).poses
            for name in ("finger", "shuttle"):
                pose = seen[name]
                if pose.x_mm is None or pose.y_mm is None or pose.angle_mrad is None or pose.covariance is None:
                    silent += 1
                    continue
                x, y, turn = truth.moves[name]
                error = np.array([pose.x_mm - x, pose.y_mm - y, pose.angle_mrad - 1e3 * turn])
                for k, part in enumerate(("x", "y", "angle")):
                    scores[part].append(error[k] / pose.covariance[k, k] ** 0.5)
                    own[part].append(error[k] / pose.random[k, k] ** 0.5)
            for name, first, last in (("hinge 1", "pillar", "finger"), ("hinge 2", "shuttle", "finger")):
                pose = seen[name]
                if pose.angle_mrad is None:
                    continue
                # The flexure's axis says which body is the far one.
                turn = 1e3 * (truth.moves[last][2] - truth.moves[first][2])
                scores["hinge"].append((pose.angle_mrad - turn) / pose.covariance[2, 2] ** 0.5)
                own["hinge"].append((pose.angle_mrad - turn) / pose.random[2, 2] ** 0.5)
        print(f"{kind}: {given.cases} cases, {silent} without a pose")
        for part, values in scores.items():
            print(f"  {part}: {within(values, 1.96)}, largest {np.abs(values).max():.1f}")
            print(f"    by the frame's own part alone: {within(own[part], 1.96)}", flush=True)
