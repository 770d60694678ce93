"""Error and coverage of the gap for finger tips of many shapes, turned by up to 22 degrees, class by class.

    python -m tests.benchmarks.finger_tips [--pictures 42] [--seed 1] [--only NAME]

Outlines are filled by area (Matplotlib's Agg, 16 cells a pixel) and blurred before the pixels; nothing is shared with
the product's renderer. A class is a shape of the inner or of both tips: square, with chamfers or fillets of so many
pixels, half a circle or half an ellipse (drop), a top that descends by so many pixels towards the gap, other shapes
left and right. In the rough ones, waves that are correlated over 8 px displace the outline along its normal by so many
pixels. Blurs of 0.7 to 2 px, noise of 0.8 to 4 grey levels, gaps of 60 to 120 px. `scores` explains the columns.
"""

from argparse import Namespace

import cv2
import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.path import Path as Outline
from matplotlib.transforms import IdentityTransform
from numpy.typing import NDArray

from fingervision.domain.frame import Frame
from fingervision.vision.pipeline import LINEAR_CAMERA, Settings
from tests.benchmarks.frame import benchmark
from tests.benchmarks.scores import Scores, print_classes

Floats = NDArray[np.float64]
HEIGHT, BREADTH, FINER, LENGTH_PX, BELOW_PX = 300, 440, 4, 700.0, 10.2
TURNS_DEG = (0, 1, 2, 4, 8, 14, 22)


def corner(kind: str, px: float) -> list[tuple[float, float]]:
    """Outline of the inner half of a tip, from its highest point to its flank at x = 0; y runs down (pixels)."""
    turn = np.linspace(0.0, 0.5 * np.pi, 80)
    if kind in ("fillet", "drop"):
        tall = 1.6 * px if kind == "drop" else px
        return list(zip(px * (np.sin(turn) - 1.0), tall * (1.0 - np.cos(turn)), strict=True))
    deep = {"square": 0.0, "chamfer": px, "steep": 1.5 * px}[kind]
    return [(-px, 0.0), (0.0, deep)] if deep else [(0.0, 0.0)]


def finger(inner: str, outer: str, width: float, px: float) -> Floats:
    """Outline of a finger, whose inner flank is at x = 0 and whose root is below, from the outer flank on."""
    if inner == "slant":  # the top descends towards the gap
        top = [(-width, 0.0), (0.0, px)]
    else:
        top = [(-width - x, y) for x, y in reversed(corner(outer, px))] + corner(inner, px)
    return np.array([(-width, LENGTH_PX), *top, (0.0, LENGTH_PX)])


def inner_edge(outline: Floats) -> tuple[float, float]:
    """Position of the inner side of an outline at the measuring height below its tip, and that height."""
    height = float(outline[:, 1].min()) + BELOW_PX
    k = next(k for k in range(int(outline[:, 1].argmin()), len(outline)) if outline[k + 1, 1] >= height)
    (x0, y0), (x1, y1) = outline[k : k + 2]
    return x0 + (height - y0) * (x1 - x0) / (y1 - y0), height


def roughened(outline: Floats, deviation_px: float, rng: np.random.Generator) -> Floats:
    """Displace an outline along its normal."""
    length = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(outline, axis=0).T))))
    at = np.arange(0.0, length[-1], 0.5)
    fine = np.column_stack([np.interp(at, length, outline[:, k]) for k in (0, 1)])
    wave = np.convolve(rng.standard_normal(at.size), np.ones(16), "same")
    along = np.gradient(fine, axis=0)
    normal = np.column_stack([along[:, 1], -along[:, 0]]) / np.hypot(*along.T)[:, None]
    return np.asarray(fine + normal * (wave * deviation_px / wave.std())[:, None])


def filled(outlines: list[Floats], blur_px: float) -> Floats:
    """Light of polygons (pixels) that are filled with exact coverage, and blurred before the pixels."""
    renderer = RendererAgg(FINER * BREADTH, FINER * HEIGHT, 72.0)
    context = renderer.new_gc()
    context.set_linewidth(0.0)
    context.set_snap(False)
    with mpl.rc_context({"path.simplify": False, "path.snap": False}):
        for outline in outlines:
            x, y = FINER * (np.vstack([outline, outline[:1]]).T + 0.5)
            codes = [Outline.MOVETO, *[Outline.LINETO] * (x.size - 2), Outline.CLOSEPOLY]
            path = Outline(np.column_stack([x, FINER * HEIGHT - y]), codes)
            renderer.draw_path(context, path, IdentityTransform(), (1.0, 1.0, 1.0, 1.0))
    cover = np.asarray(renderer.buffer_rgba())[..., 3].astype(np.float64) / 255.0
    light = cv2.GaussianBlur(cover, (0, 0), blur_px * FINER)
    return np.asarray(light.reshape(HEIGHT, FINER, BREADTH, FINER).mean(axis=(1, 3)))


# Shapes of the inner and outer corners of the left and of the right finger, width, size of the corners, and roughness.
CLASSES = {
    "square 80": ("square", "square", "square", "square", 80, 0, 0.0),
    "square 50": ("square", "square", "square", "square", 50, 0, 0.0),
    "chamfer 4": ("chamfer", "chamfer", "chamfer", "chamfer", 50, 4, 0.0),
    "chamfer 8": ("chamfer", "chamfer", "chamfer", "chamfer", 60, 8, 0.0),
    "chamfer 16": ("chamfer", "chamfer", "chamfer", "chamfer", 70, 16, 0.0),
    "chamfer inside": ("steep", "square", "steep", "square", 50, 12, 0.0),
    "fillet 4": ("fillet", "fillet", "fillet", "fillet", 50, 4, 0.0),
    "fillet 14": ("fillet", "fillet", "fillet", "fillet", 50, 14, 0.0),
    "fillet 22": ("fillet", "fillet", "fillet", "fillet", 70, 22, 0.0),
    "round 40": ("fillet", "fillet", "fillet", "fillet", 40, 20, 0.0),
    "drop 40": ("drop", "drop", "drop", "drop", 40, 20, 0.0),
    "slant 4": ("slant", "", "slant", "", 60, 4, 0.0),
    "slant 10": ("slant", "", "slant", "", 44, 10, 0.0),
    "fillet and chamfer": ("fillet", "fillet", "chamfer", "chamfer", 50, 12, 0.0),
    "square and fillet": ("square", "square", "fillet", "fillet", 60, 6, 0.0),
    "square, rough 0.2": ("square", "square", "square", "square", 60, 0, 0.2),
    "chamfer, rough 0.2": ("chamfer", "chamfer", "chamfer", "chamfer", 60, 8, 0.2),
    "fillet, rough 0.2": ("fillet", "fillet", "fillet", "fillet", 50, 14, 0.2),
    "square, rough 0.5": ("square", "square", "square", "square", 60, 0, 0.5),
    "chamfer, rough 0.5": ("chamfer", "chamfer", "chamfer", "chamfer", 60, 12, 0.5),
    "fillet, rough 0.5": ("fillet", "fillet", "fillet", "fillet", 50, 14, 0.5),
}


def picture(name: str, turn_deg: float, rng: np.random.Generator) -> tuple[Frame, float]:
    """Draw a picture of a class, and the gap (pixels) in it."""
    left_inner, left_outer, right_inner, right_outer, wide, size, rough_px = CLASSES[name]
    width, px = wide * rng.uniform(0.9, 1.1), size * rng.uniform(0.9, 1.1)
    px = min(px, 0.5 * width) if wide > 2 * size else 0.5 * width
    turn = np.radians(turn_deg * rng.uniform(0.9, 1.1)) * rng.choice([-1.0, 1.0])
    turned = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    half_gap, centre = rng.uniform(30.0, 60.0), np.array([0.5 * BREADTH, 0.35 * HEIGHT]) + rng.uniform(-8.0, 8.0, 2)
    outlines, ends = [], []
    for sign, shapes in ((1.0, (left_inner, left_outer)), (-1.0, (right_inner, right_outer))):
        outline = (finger(*shapes, width, px) - [half_gap, 0.0]) * [sign, 1.0] @ turned + centre
        x, y = inner_edge((outline - centre) * [sign, 1.0] + centre)
        ends.append((sign * (x - centre[0]), y))
        outlines.append(roughened(outline, rough_px, rng) if rough_px else outline)
    ground, tone = (200.0, 40.0) if rng.random() < 0.7 else (40.0, 200.0)
    light = filled(outlines, float(np.exp(rng.uniform(np.log(0.7), np.log(2.0)))))
    noise = rng.uniform(0.8, 4.0) * rng.standard_normal(light.shape)
    levels = np.round(ground + (tone - ground) * light + noise)
    return Frame(np.clip(levels, 0, 255).astype(np.uint8), 0), float(np.hypot(*np.subtract(*ends)))


def scored(name: str, pictures: int, seed: int) -> Scores:
    """Measure the pictures of a class, whose camera is stated as linear."""
    rng, scores = np.random.default_rng([list(CLASSES).index(name), seed]), Scores()
    for k in range(pictures):
        frame, gap_px = picture(name, TURNS_DEG[k % len(TURNS_DEG)], rng)
        scores.measure(frame, Settings(BELOW_PX, camera=LINEAR_CAMERA), gap_px)
    return scores


@benchmark(pictures=42, seed=1, only={"nargs": "*"})
def main(options: Namespace) -> None:
    """Print the table."""
    print_classes(options.only or CLASSES, lambda name: scored(name, options.pictures, options.seed))
