"""Pictures without two fingers: drawn things, and the photographs that scikit-image ships."""

from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

import cv2
import numpy as np
import skimage

from tests.benchmarks.scenes.canvas import Canvas, Rng
from tests.benchmarks.scenes.gripper import HEIGHT, WIDTH, Shot, empty_canvas, fingers, shot, tones
from tests.benchmarks.scenes.shapes import blob, box, disc, smooth_way, turned

PHOTOGRAPHS = (
    "astronaut.png", "brick.png", "camera.png", "cell.png", "chelsea.png", "chessboard_GRAY.png", "clock_motion.png",
    "coffee.png", "coins.png", "color.png", "grass.png", "gravel.png", "horse.png", "hubble_deep_field.jpg", "ihc.png",
    "logo.png", "microaneurysms.png", "moon.png", "motorcycle_left.png", "page.png", "phantom.png", "retina.jpg",
    "rocket.jpg", "text.png",
)  # fmt: skip


@cache
def _photograph(name: str) -> np.ndarray:
    return cv2.imread(str(Path(skimage.__file__).parent / "data" / name), cv2.IMREAD_GRAYSCALE)


def photograph(rng: Rng, name: str) -> Shot:
    """A part of a photograph, at a scale and in one of eight positions at random."""
    whole = _photograph(name)
    height, width = whole.shape
    share = rng.uniform(0.4, 1.0)
    h, w = max(int(share * height), 40), max(int(share * width), 40)
    y, x = int(rng.integers(height - h + 1)), int(rng.integers(width - w + 1))
    part = np.rot90(whole[y : y + h, x : x + w], int(rng.integers(4)))
    if rng.random() < 0.5:
        part = part[:, ::-1]
    size = rng.uniform(300, 640)
    zoom = size / max(part.shape)
    return Shot(cv2.resize(np.ascontiguousarray(part), None, fx=zoom, fy=zoom, interpolation=cv2.INTER_AREA), None)


def one(rng: Rng, beside: str) -> Shot:
    """One finger, alone or with a thing that is no finger."""
    tone = tones(rng)
    canvas, pair = empty_canvas(rng, tone.ground), fingers(rng, (80, 200), 4.0)
    finger, other = pair if rng.random() < 0.5 else pair[::-1]
    x, side = other.middle_px, other.side
    thing = tone.finger if rng.random() < 0.6 else tone.between(rng.uniform(0, 0.5))
    if beside == "wire":
        way = np.array([(x, other.tip_px + rng.uniform(-20, 20)), (x + rng.uniform(-15, 15), 520.0)])
        canvas.stroke(way, rng.uniform(3, 14), thing)
    elif beside == "housing":
        inner = x - side * rng.uniform(-20, 40)
        canvas.fill(box(inner, other.tip_px + rng.uniform(-60, 60), x + side * 400, 520), thing)
    elif beside == "disc":
        r = rng.uniform(25, 60)
        canvas.fill(disc(x, other.tip_px + r + rng.uniform(-30, 60), r), thing)
    elif beside == "cable":
        way = smooth_way(
            np.array(
                [(x + side * 150, 500), (x + side * 20, 380), (x, 250), (x + side * 60, 120), (x + side * 300, 60)]
            )
        )
        canvas.stroke(way, rng.uniform(4, 14), thing)
    elif beside == "hand":
        canvas.fill(blob(x + side * 120, rng.uniform(150, 350), 120, rng, 0.2), thing, soft_px=rng.uniform(0.5, 3))
    canvas.fill(finger.outline(), tone.finger)
    return shot(canvas, rng, None)


def comb(rng: Rng) -> Shot:
    """Three to seven bars of one kind."""
    tone = tones(rng)
    canvas, n = empty_canvas(rng, tone.ground), int(rng.integers(3, 8))
    top, pitch = rng.uniform(80, 200), WIDTH / n
    for k in range(n):
        x = (k + 0.5) * pitch
        canvas.fill(box(x - 0.3 * pitch, top + rng.uniform(-3, 3), x + 0.3 * pitch, 520), tone.finger)
    return shot(canvas, rng, None)


def hand(rng: Rng) -> Shot:
    """A hand with four or five fingers spread."""
    tone = tones(rng)
    canvas = empty_canvas(rng, tone.ground)
    x, y = WIDTH / 2 + rng.uniform(-60, 60), HEIGHT - 30
    canvas.fill(blob(x, y, 110, rng, 0.1), tone.finger)
    for angle in np.radians(np.linspace(-55, 50, int(rng.integers(4, 6))) + rng.uniform(-5, 5)):
        end = (x + 300 * np.sin(angle), y - 280 * np.cos(angle))
        canvas.stroke(np.array([(x, y), end]), 42, tone.finger)
        canvas.fill(disc(*end, 21), tone.finger)
    return shot(canvas, rng, None)


def lying(rng: Rng, kind: str) -> Shot:
    """Several things that lie in view: discs, boxes, blobs, rings."""
    tone = tones(rng)
    canvas = empty_canvas(rng, tone.ground)
    for _ in range(int(rng.integers(1, 9))):
        x, y, r = rng.uniform(30, 610), rng.uniform(30, 450), rng.uniform(12, 70)
        if kind == "discs":
            canvas.fill(disc(x, y, r), tone.finger)
        elif kind == "boxes":
            shape = box(x - r, y - rng.uniform(0.3, 1) * r, x + r, y + rng.uniform(0.3, 1) * r)
            canvas.fill(turned(shape, rng.uniform(0, 90), (x, y)), tone.finger)
        elif kind == "blobs":
            canvas.fill(blob(x, y, r, rng, 0.5), tone.finger)
        else:
            canvas.fill(disc(x, y, r), tone.finger)
            canvas.fill(disc(x, y, rng.uniform(0.3, 0.8) * r), tone.ground)
    return shot(canvas, rng, None)


def cables(rng: Rng) -> Shot:
    """A few cables from border to border."""
    tone = tones(rng)
    canvas = empty_canvas(rng, tone.ground)
    for _ in range(int(rng.integers(1, 5))):
        places = np.column_stack((np.linspace(-30, 670, 5), rng.uniform(20, 460, 5)))
        canvas.stroke(smooth_way(places), rng.uniform(4, 25), tone.finger)
    return shot(canvas, rng, None)


def edge(rng: Rng) -> Shot:
    """The edge of a table and a corner of a box."""
    tone = tones(rng)
    canvas = empty_canvas(rng, tone.ground)
    canvas.fill(turned(box(-400, rng.uniform(150, 350), 1100, 900), rng.uniform(-20, 20), (320, 240)), tone.finger)
    if rng.random() < 0.5:
        x = rng.uniform(100, 500)
        canvas.fill(box(x, rng.uniform(40, 140), x + rng.uniform(60, 250), 520), tone.between(rng.uniform(0, 0.6)))
    return shot(canvas, rng, None)


def text(rng: Rng) -> Shot:
    """Letters of any size."""
    tone = tones(rng)
    canvas, size = empty_canvas(rng, tone.ground), rng.uniform(0.6, 6.0)
    y = 30.0 * size
    while y < HEIGHT + 20:
        words = "".join(chr(c) for c in rng.integers(65, 123, 30))
        canvas.text(words, rng.uniform(-20, 30), y, size, tone.finger)
        y += 36.0 * size
    return shot(canvas, rng, None)


def noise(rng: Rng) -> Shot:
    """Correlated noise, thresholded or not."""
    field = cv2.GaussianBlur(rng.normal(size=(HEIGHT, WIDTH)), (0, 0), rng.uniform(1, 25))
    field /= field.std()
    if rng.random() < 0.5:
        field = np.sign(field) * 1.5
    return shot(Canvas(WIDTH, HEIGHT, 125 + 45 * np.clip(field, -2.5, 2.5)), rng, None)


def gears(rng: Rng) -> Shot:
    """A toothed wheel, or two."""
    tone = tones(rng)
    canvas = empty_canvas(rng, tone.ground)
    for _ in range(int(rng.integers(1, 3))):
        n, r = int(rng.integers(6, 24)), rng.uniform(80, 200)
        angle = np.linspace(0, 2 * np.pi, 40 * n, endpoint=False)
        radius = r * (1 + 0.12 * np.sign(np.sin(n * angle + rng.uniform(0, 6))))
        x, y = rng.uniform(100, 540), rng.uniform(100, 400)
        canvas.fill(np.column_stack((x + radius * np.cos(angle), y + radius * np.sin(angle))), tone.finger)
    return shot(canvas, rng, None)


def letter(rng: Rng) -> Shot:
    """Big profiles that are open at a side: brackets, T, L, and steps."""
    tone = tones(rng)
    canvas, x, y = empty_canvas(rng, tone.ground), rng.uniform(120, 260), rng.uniform(60, 160)
    a, t = rng.uniform(120, 260), rng.uniform(25, 60)
    kind = rng.choice(["L", "T", "Z", "O"])
    boxes = {
        "L": [(0, 0, t, a), (0, a - t, a, a)],
        "T": [(0, 0, a, t), (a / 2 - t / 2, 0, a / 2 + t / 2, a)],
        "Z": [(0, 0, a, t), (a - t, 0, a, a), (a - t, a - t, 2 * a - t, a)],
        "O": [(0, 0, a, t), (0, a - t, a, a), (0, 0, t, a), (a - t, 0, a, a)],
    }[str(kind)]
    tilt = rng.uniform(-15, 15)
    for x0, y0, x1, y1 in boxes:
        canvas.fill(turned(box(x + x0, y + y0, x + x1, y + y1), tilt, (x, y)), tone.finger)
    return shot(canvas, rng, None)


DRAWN: dict[str, Callable[[Rng], Shot]] = {
    **{f"one-{kind}": partial(one, beside=kind) for kind in ("alone", "wire", "housing", "disc", "cable", "hand")},
    **{f"lying-{kind}": partial(lying, kind=kind) for kind in ("discs", "boxes", "blobs", "rings")},
    "comb": comb,
    "hand": hand,
    "cables": cables,
    "edge": edge,
    "text": text,
    "noise": noise,
    "gears": gears,
    "letter": letter,
}
EMPTY: dict[str, Callable[[Rng], Shot]] = {
    **DRAWN,
    **{f"photo-{name.split('.')[0]}": partial(photograph, name=name) for name in PHOTOGRAPHS},
}
