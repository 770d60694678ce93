"""More of what lies about on a bench: straps, hairs, tape, screws, text over an edge, a second tool, mirror images."""

from collections.abc import Callable
from functools import partial

import cv2
import numpy as np

from tests.benchmarks.scenes.canvas import Rng
from tests.benchmarks.scenes.clutter import Scene
from tests.benchmarks.scenes.gripper import BELOW_PX, HEIGHT, WIDTH, Shot
from tests.benchmarks.scenes.shapes import box, disc, smooth_way, turned


def across(rng: Rng, kind: str) -> Shot:
    """A straight strap, a hair or two wires over both fingers, anywhere from the tips to the roots."""
    s = Scene(rng)
    s.paint()
    for _ in range(2 if kind == "wires" else 1):
        y0, y1 = s.tip + rng.uniform(-10, 220, 2) if kind != "strap" else s.tip + rng.uniform(30, 200) + np.zeros(2)
        breadth = {"strap": rng.uniform(15, 60), "hair": rng.uniform(0.8, 2.5), "wires": rng.uniform(3, 9)}[kind]
        tone = s.tones.between(rng.uniform(0.3, 1.1)) if kind == "strap" else s.some_tone()
        way = smooth_way(np.array([(-20.0, y0), (320.0, 0.5 * (y0 + y1) + rng.uniform(-9, 9)), (660.0, y1)]))
        s.canvas.stroke(way, breadth, tone)
    return s.done()


def shade_of_wire(rng: Rng) -> Shot:
    """The soft shadow of a wire out of view, over fingers and ground."""
    s = Scene(rng)
    s.paint()
    way = np.array([(rng.uniform(0, WIDTH), -10.0), (rng.uniform(0, WIDTH), HEIGHT + 10.0)])
    mask = cv2.GaussianBlur(s.canvas.coverage(way, rng.uniform(6, 30)), (0, 0), rng.uniform(2, 8))
    s.canvas.light *= 1.0 - rng.uniform(0.1, 0.5) * mask
    return s.done()


def tape(rng: Rng, where: str) -> Shot:
    """Tape around a finger below the measuring height, or on the ground."""
    s = Scene(rng, (60.0, 180.0))
    tone = s.tones.between(rng.uniform(0.4, 1.05))
    finger = s.pair[int(rng.integers(2))]
    if where == "ground":
        s.canvas.fill(turned(box(-50, 200, 700, 200 + rng.uniform(20, 80)), rng.uniform(-30, 30), (320, 230)), tone)
        s.paint()
        return s.done()
    s.paint()
    y = s.tip + rng.uniform(60, 200)
    half = 0.5 * finger.width_px + rng.uniform(1, 8)
    deep = rng.uniform(20, 60)
    s.canvas.fill(box(finger.middle_px - half, y, finger.middle_px + half, y + deep), tone)
    return s.done()


def screws_on(rng: Rng) -> Shot:
    """Bright and dark screw heads on the fingers, now and then cut by the inner edge."""
    s = Scene(rng)
    s.paint()
    for finger in s.pair:
        for _ in range(int(rng.integers(1, 4))):
            y = finger.tip() + rng.uniform(20, 240)
            x = finger.middle_px + rng.uniform(-0.4, 0.4) * finger.width_px
            r = rng.uniform(3, 9)
            s.canvas.fill(disc(x, y, r), s.tones.between(rng.uniform(-0.2, 1.0)))
            s.canvas.stroke(np.array([(x - 0.7 * r, y), (x + 0.7 * r, y)]), 1.5, s.tones.between(-0.2))
    return s.done()


def written(rng: Rng) -> Shot:
    """Text of an overlay across the fingers' edges."""
    s = Scene(rng)
    s.paint()
    words = "".join(chr(c) for c in rng.integers(97, 123, 14))
    s.canvas.text(
        words, rng.uniform(20, 250), s.tip + rng.uniform(-20, 120), rng.uniform(0.6, 1.4), rng.choice([5.0, 250.0])
    )
    return s.done()


def tool(rng: Rng, kind: str) -> Shot:
    """Tweezers beside the gripper, a needle that points at it from beyond, or a plate behind it."""
    s = Scene(rng, (40.0, 110.0))
    tone = s.tones.finger if rng.random() < 0.5 else s.some_tone()
    if kind == "tweezers":
        x, y = rng.uniform(15, max(s.left - 60, 20)), s.tip + rng.uniform(-60, 120)
        for side in (-1, 1):
            s.canvas.stroke(np.array([(x + 20 + 9 * side, y), (x + 20 + 22 * side, 500)]), rng.uniform(5, 11), tone)
    elif kind == "needle":
        x = rng.uniform(150, 490)
        s.canvas.fill(np.array([(x - 8.0, -5.0), (x + 8.0, -5.0), (x + rng.uniform(-40, 40), s.tip - 20.0)]), tone)
    else:
        top = s.tip + rng.uniform(40, 200)
        s.canvas.fill(box(-5, top, 645, 500), s.tones.between(rng.uniform(0.3, 0.85)))
    s.paint()
    return s.done()


def mirrored(rng: Rng) -> Shot:
    """A glossy table beyond the tips, in which the fingers are seen again, fainter."""
    s = Scene(rng)
    line = s.tip - rng.uniform(4, 40)
    seen = rng.uniform(0.2, 0.9)
    for finger in s.pair:
        outline = finger.outline().copy()
        outline[:, 1] = 2.0 * line - outline[:, 1]
        s.canvas.fill(outline, s.tones.finger, opacity=seen, soft_px=rng.uniform(0.0, 2.0))
    s.paint()
    return s.done()


def notched(rng: Rng) -> Shot:
    """A notch in the inner edge of one finger, below the measuring height."""
    s = Scene(rng)
    covered = s.paint()
    k = int(rng.integers(2))
    finger = s.pair[k]
    y = finger.tip() + BELOW_PX + rng.uniform(12, 80)
    x, deep, high = finger.inner(y), rng.uniform(1.5, 8), rng.uniform(3, 14)
    notch = s.canvas.coverage(box(x - deep, y, x + deep, y + high))
    s.canvas.light += covered[k] * notch * (s.tones.ground - s.tones.finger)
    return s.done()


THINGS: dict[str, Callable[[Rng], Shot]] = {
    **{f"across-{kind}": partial(across, kind=kind) for kind in ("strap", "hair", "wires")},
    "shade-of-wire": shade_of_wire,
    **{f"tape-{kind}": partial(tape, where=kind) for kind in ("side", "ground")},
    "screws-on": screws_on,
    "written": written,
    **{f"tool-{kind}": partial(tool, kind=kind) for kind in ("tweezers", "needle", "plate")},
    "mirrored": mirrored,
    "notched": notched,
}
