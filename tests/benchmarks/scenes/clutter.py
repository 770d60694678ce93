"""Untidy scenes: two fingers, and one of forty kinds of things about them."""

from collections.abc import Callable
from functools import partial

import cv2
import numpy as np

from tests.benchmarks.scenes.canvas import Canvas, Floats, Rng
from tests.benchmarks.scenes.gripper import (
    BELOW_PX,
    HEIGHT,
    WIDTH,
    Shot,
    Tones,
    empty_canvas,
    fingers,
    shot,
    tones,
)
from tests.benchmarks.scenes.shapes import Finger, blob, box, disc, smooth_way, turned

Pair = tuple[Finger, Finger]


class Scene:
    """Canvas, fingers and tones; things are painted before or after the fingers."""

    def __init__(self, rng: Rng, gap: tuple[float, float] = (40.0, 180.0), tilt_deg: float = 4.0, **options: object):
        self.rng = rng
        self.tones: Tones = tones(rng)
        self.canvas: Canvas = empty_canvas(rng, self.tones.ground)
        self.pair: Pair = fingers(rng, gap, tilt_deg, **options)

    @property
    def left(self) -> float:
        """How far the ground reaches beside the left finger."""
        return float(self.pair[0].outline()[:, 0].min())

    @property
    def tip(self) -> float:
        return min(finger.tip() for finger in self.pair)

    def some_tone(self) -> float:
        return self.tones.between(self.rng.uniform(-0.1, 0.8))

    def paint(self) -> list[Floats]:
        return [self.canvas.fill(finger.outline(), self.tones.finger) for finger in self.pair]

    def done(self) -> Shot:
        return shot(self.canvas, self.rng, self.pair)


def hand(rng: Rng, kind: str) -> Shot:
    """Thumb and palm that reach in from a side, from above, or over the roots."""
    s = Scene(rng)
    tone = s.some_tone()
    palm, fingers_at = {
        "side": ((WIDTH + 30, rng.uniform(60, 420)), (WIDTH - rng.uniform(60, 130), 0)),
        "above": ((rng.uniform(60, 580), -60), (0, 0)),
        "roots": ((rng.uniform(120, 520), HEIGHT + 20), (0, 0)),
    }[kind]
    if kind == "roots":
        s.paint()
    x, y = palm
    s.canvas.fill(blob(x, y, 90, rng, 0.15), tone, soft_px=rng.uniform(0.5, 4))
    for _ in range(3):
        if kind == "side":
            end = (fingers_at[0] + rng.uniform(-20, 40), y + rng.uniform(-80, 80))
        elif kind == "above":
            end = (x + rng.uniform(-80, 80), min(s.tip - 35, rng.uniform(40, 110)))
        else:
            end = (x + rng.uniform(-60, 60), rng.uniform(350, 420))
        s.canvas.stroke(np.array([(x, y), end]), rng.uniform(28, 44), tone)
        s.canvas.fill(disc(*end, 18), tone)
    if kind != "roots":
        s.paint()
    return s.done()


def cable(rng: Rng, kind: str) -> Shot:
    """A cable: across the ground above the tips, beside the fingers, into a root, behind both fingers, or on them."""
    s = Scene(rng)
    tone, breadth = s.some_tone(), rng.uniform(3, 14)
    low, high, left = 40.0, max(s.tip - 25.0, 45.0), max(s.left - 20, 10)
    across = [-20.0, 200.0, 430.0, 660.0]
    ways = {
        "above": [(x, rng.uniform(low, high)) for x in across],
        "beside": [(rng.uniform(5, 40), -20), (rng.uniform(5, left), 200), (rng.uniform(5, 60), 500)],
        "root": [(-20, rng.uniform(250, 400)), (s.left - 20, rng.uniform(330, 420)), (s.left + 60, 440)],
        "behind": [(x, rng.uniform(300, 420)) for x in across],
        "on": [(x, rng.uniform(300, 420)) for x in across],
    }
    way = smooth_way(np.array(ways[kind], dtype=float))
    if kind == "on":
        s.paint()
        s.canvas.stroke(way, breadth, tone)
    else:
        s.canvas.stroke(way, breadth, tone)
        s.paint()
    return s.done()


def wire(rng: Rng, where: str) -> Shot:
    """A straight wire that comes in from the roots' border, beside the fingers or between them far below the tips."""
    s = Scene(rng, (60.0, 180.0))
    breadth = rng.uniform(3, 14)
    if where == "beside":
        x = rng.uniform(8, max(s.left - 15, 12))
        top = rng.uniform(60, 300)
    else:
        x = 0.5 * (s.pair[0].inner(400) + s.pair[1].inner(400)) + rng.uniform(-10, 10)
        top = s.tip + BELOW_PX + rng.uniform(40, 150)
    s.canvas.stroke(np.array([(x, top), (x + rng.uniform(-12, 12), 520)]), breadth, s.tones.finger)
    s.paint()
    return s.done()


def table(rng: Rng, side: str) -> Shot:
    """The edge of a table, a bench or a housing along one border of the picture."""
    s = Scene(rng, tip_px=rng.uniform(130, 190)) if side == "tips" else Scene(rng)
    tone = s.tones.between(rng.uniform(-0.1, 0.75)) if rng.random() < 0.7 else s.tones.between(1.15)
    deep, lean = rng.uniform(15, 70), rng.uniform(-8, 8)
    if side == "tips":
        s.canvas.fill(np.array([(-5, -5), (645, -5), (645, deep + lean), (-5, deep)]), tone)
    elif side == "roots":
        s.canvas.fill(np.array([(-5, 485), (645, 485), (645, 480 - deep + lean), (-5, 480 - deep)]), tone)
    else:
        deep = rng.uniform(10, max(min(s.left - 20, 120), 15))
        s.canvas.fill(np.array([(-5, -5), (-5, 485), (deep + lean, 485), (deep, -5)]), tone)
    s.paint()
    return s.done()


def label(rng: Rng, where: str) -> Shot:
    """A label or text: on the ground, on a finger, or as the camera's own time stamp."""
    s = Scene(rng)
    words = "".join(chr(c) for c in rng.integers(65, 91, 8))
    paper, ink = (240.0, 25.0) if rng.random() < 0.5 else (s.tones.between(1.1), s.tones.finger)
    if where == "ground":
        x, y = rng.uniform(5, max(s.left - 90, 6)), rng.uniform(20, 60)
        s.canvas.fill(turned(box(x, y, x + 130, y + 44), rng.uniform(-10, 10), (x, y)), paper)
        s.canvas.text(words[:6], x + 8, y + 30, 0.8, ink)
        s.paint()
    elif where == "finger":
        s.paint()
        x, y = s.pair[0].middle_px - 0.3 * s.pair[0].width_px, rng.uniform(300, 380)
        s.canvas.fill(box(x, y, x + 0.55 * s.pair[0].width_px, y + 60), paper)
        s.canvas.text(words[:2], x + 3, y + 35, 0.5, ink)
    elif where == "text":
        s.canvas.text(words, rng.uniform(10, 380), rng.uniform(30, 70), rng.uniform(0.5, 1.1), ink)
        s.paint()
    else:
        s.paint()
        s.canvas.text("2026-11-22 07:03:21", 8, rng.choice([24, 470]), 0.6, rng.choice([5.0, 250.0]))
    return s.done()


def part(rng: Rng, where: str) -> Shot:
    """A third part: lying beside the fingers, above the tips, or standing beside them; or screws on the ground."""
    s = Scene(rng, (40.0, 140.0))
    tone = s.some_tone() if rng.random() < 0.5 else s.tones.finger
    if where == "beside":
        x, y, r = rng.uniform(20, max(s.left - 45, 25)), rng.uniform(80, 400), rng.uniform(15, 38)
        s.canvas.fill(turned(box(x - r, y - r, x + r, y + r * rng.uniform(0.4, 2)), rng.uniform(0, 90), (x, y)), tone)
    elif where == "above":
        x, r = rng.uniform(120, 520), rng.uniform(12, 26)
        y = max(s.tip - r - rng.uniform(12, 40), r - 5)
        s.canvas.fill(disc(x, y, r) if rng.random() < 0.5 else box(x - r, y - r, x + r, y + r), tone)
    elif where == "standing":
        x, half = rng.uniform(15, max(s.left - 40, 20)), rng.uniform(10, 25)
        s.canvas.fill(box(x - half, s.tip + rng.uniform(140, 220), x + half, 500), tone)
    elif where == "housing":
        s.canvas.fill(box(-5, rng.uniform(40, 250), max(s.left - rng.uniform(15, 50), 12), 500), tone)
    else:
        for _ in range(int(rng.integers(2, 7))):
            s.canvas.fill(disc(rng.uniform(0, WIDTH), rng.uniform(0, HEIGHT), rng.uniform(6, 20)), tone)
    s.paint()
    return s.done()


def shaped(rng: Rng, kind: str) -> Shot:
    """Fingers of other shapes."""
    options: dict[str, object] = {}
    if kind == "cut-inner":
        options = {"is_cut": True, "inner_corner_px": rng.uniform(4, 28), "outer_corner_px": 1.0}
    elif kind == "cut-both":
        cut = rng.uniform(4, 18)
        options = {"is_cut": True, "inner_corner_px": cut, "outer_corner_px": cut}
    elif kind == "cut-outer":
        options = {"is_cut": True, "inner_corner_px": 1.0, "outer_corner_px": rng.uniform(4, 30)}
    elif kind == "taper":
        options = {"taper": rng.uniform(0.02, 0.09)}
    s = Scene(rng, **options)
    if kind == "unequal":
        a, b = rng.permutation([rng.uniform(45, 60), rng.uniform(80, 110)])
        s.pair = fingers(rng, (40, 160), 4.0)
        half = 0.5 * (s.pair[1].middle_px - s.pair[0].middle_px - 0.5 * (s.pair[0].width_px + s.pair[1].width_px))
        made = []
        for finger, width in zip(s.pair, (a, b), strict=True):
            made.append(
                Finger(
                    WIDTH / 2 + finger.side * (half + 0.5 * width), finger.tip_px, width, 6.0, 6.0, finger.tilt_deg,
                    finger.side,
                )
            )  # fmt: skip
        s.pair = (made[0], made[1])
    s.paint()
    return s.done()


def turned_fingers(rng: Rng, kind: str) -> Shot:
    """Both fingers turned together, by 10 to 25 degrees, or leaning towards each other."""
    angle = rng.uniform(10, 25) * rng.choice([-1.0, 1.0])
    s = Scene(rng, (60.0, 150.0), 0.0, tip_px=rng.uniform(150, 190))
    if kind == "together":
        centre = (WIDTH / 2, s.pair[0].tip_px + 60)
        made = []
        for finger in s.pair:
            x, y = turned(np.array([(finger.middle_px, finger.tip_px)]), angle, centre)[0]
            made.append(
                Finger(x, y, finger.width_px, finger.inner_corner_px, finger.outer_corner_px, angle, finger.side)
            )
        s.pair = (made[0], made[1])
    else:
        lean = rng.uniform(6, 14)
        s.pair = fingers(rng, (60.0, 160.0), 0.0, tip_px=rng.uniform(110, 170))
        s.pair = tuple(  # type: ignore[assignment]
            Finger(f.middle_px, f.tip_px, f.width_px, f.inner_corner_px, f.outer_corner_px, -f.side * lean, f.side)
            for f in s.pair
        )
    s.paint()
    return s.done()


def drop_shadow(rng: Rng, kind: str) -> Shot:
    """The fingers' own shadow on the ground, with a hard edge, shifted to one side."""
    s = Scene(rng)
    s.tones = Tones(min(s.tones.finger, s.tones.ground), max(s.tones.finger, s.tones.ground))
    s.canvas = empty_canvas(rng, s.tones.ground)
    share = rng.uniform(0.3, 0.6) if kind == "dark" else rng.uniform(0.65, 0.88)
    by = np.array([rng.uniform(4, 30) * rng.choice([-1, 1]), rng.uniform(-10, 25)])
    soft = rng.uniform(0.0, 1.5)
    for finger in s.pair:
        s.canvas.fill(finger.outline() + by, share * s.tones.ground, soft_px=soft)
    s.paint()
    return s.done()


def crumbs(rng: Rng, where: str) -> Shot:
    """Crumbs or burrs that stick to the inner edges, or to the tips."""
    s = Scene(rng)
    for _ in range(int(rng.integers(1, 4))):
        finger = s.pair[int(rng.integers(2))]
        r = rng.uniform(2, 7)
        if where == "edge":
            y = finger.tip() + BELOW_PX + rng.uniform(-4, 60)
            x = finger.inner(y) - finger.side * rng.uniform(0, 0.6) * r
        else:
            x = finger.middle_px + rng.uniform(-0.35, 0.35) * finger.width_px
            y = finger.tip_px + rng.uniform(-0.3, 0.5) * r
        s.canvas.fill(blob(x, y, r, rng, 0.2), s.tones.finger)
    s.paint()
    return s.done()


def spot(rng: Rng, where: str) -> Shot:
    """Round glare on a finger, across its edge, or on the ground."""
    s = Scene(rng)
    covered = s.paint()
    finger = s.pair[int(rng.integers(2))]
    y = finger.tip() + rng.uniform(5, 120)
    r = rng.uniform(5, 22)
    x = {
        "finger": finger.middle_px + rng.uniform(-0.2, 0.2) * finger.width_px,
        "edge": finger.inner(max(y, finger.tip() + 6)) + finger.side * 0.4 * r,
        "ground": rng.uniform(20, WIDTH - 20),
    }[where]
    level = rng.uniform(200, 300) if s.tones.finger < s.tones.ground else 255.0
    if where == "ground":
        y = rng.uniform(20, HEIGHT - 20)
    shine = s.canvas.coverage(disc(x, y, r))
    if where == "finger":
        shine = np.asarray(cv2.GaussianBlur(shine, (0, 0), rng.uniform(0.5, 3)))
    if where == "ground":
        s.canvas.light += shine * (1.0 - np.maximum(*covered)) * (level - s.canvas.light)
    else:  # glare lies on the finger alone
        own = covered[s.pair.index(finger)]
        s.canvas.light += own * shine * (level - s.tones.finger)
    return s.done()


def pad(rng: Rng, kind: str) -> Shot:
    """A pad of another tone on each finger's inner side: its face is the finger's inner edge."""
    s = Scene(rng, (70.0, 180.0))
    tone = s.tones.between(rng.uniform(0.25, 0.6) if kind == "grey" else rng.uniform(-0.15, 0.1))
    for finger in s.pair:
        middle, half, breadth = finger.middle_px, 0.5 * finger.width_px, 14.0
        edge = middle - finger.side * half  # of the finger that the pad covers, and beyond it
        x0, x1 = sorted((edge - finger.side * 20.0, edge + finger.side * breadth))
        strip = box(x0, finger.tip_px - 20.0, x1, finger.tip_px + rng.uniform(50, 140))
        covered = s.canvas.coverage(turned(strip, finger.tilt_deg, (middle, finger.tip_px)))
        s.canvas.fill(finger.outline(), s.tones.finger + covered * (tone - s.tones.finger))
    return s.done()


def light(rng: Rng, kind: str) -> Shot:
    """Light that is uneven, fades to the corners, or shows the ground's own pattern."""
    s = Scene(rng)
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    if kind == "uneven":
        slope = rng.uniform(-0.7, 0.7, 2)
        s.paint()
        s.canvas.light *= 1.0 + slope[0] * (x / WIDTH - 0.5) + slope[1] * (y / HEIGHT - 0.5)
    elif kind == "vignette":
        s.paint()
        away = np.hypot((x - WIDTH / 2) / WIDTH, (y - HEIGHT / 2) / WIDTH)
        s.canvas.light *= 1.0 - rng.uniform(0.4, 0.9) * away**2 / 0.39
    elif kind == "grid":
        tone, step = s.tones.between(rng.uniform(0.5, 0.85)), int(rng.integers(30, 70))
        for k in range(0, WIDTH, step):
            s.canvas.stroke(np.array([(k + 0.3, -5.0), (k + 0.3, 485.0)]), 1.5, tone)
            s.canvas.stroke(np.array([(-5.0, k + 0.3), (645.0, k + 0.3)]), 1.5, tone)
        s.paint()
    else:
        field = cv2.GaussianBlur(rng.normal(size=(HEIGHT, WIDTH)), (0, 0), rng.uniform(3, 15))
        s.canvas.light *= 1.0 + rng.uniform(0.03, 0.08) * field / field.std()
        s.paint()
    return s.done()


def ruler(rng: Rng) -> Shot:
    """A ruler along one border."""
    s = Scene(rng, (40.0, 140.0))
    s.canvas.fill(box(-5, -5, min(max(s.left - 15, 20), 60), 485), s.tones.between(1.1))
    for k in range(0, HEIGHT, 12):
        s.canvas.stroke(np.array([(-5.0, k + 0.4), (10.0 + 8 * (k % 60 == 0), k + 0.4)]), 1.6, s.tones.finger)
    s.paint()
    return s.done()


def holes(rng: Rng) -> Shot:
    """Fingers with holes and slots in them."""
    s = Scene(rng)
    s.paint()
    for finger in s.pair:
        y = finger.tip_px + rng.uniform(80, 250)
        s.canvas.fill(disc(finger.middle_px, y, rng.uniform(6, 0.3 * finger.width_px)), s.tones.ground)
    return s.done()


def dust(rng: Rng) -> Shot:
    """Large dust of any tone anywhere."""
    s = Scene(rng)
    s.paint()
    for _ in range(25):
        s.canvas.fill(
            disc(rng.uniform(0, WIDTH), rng.uniform(0, HEIGHT), rng.uniform(1, 4)), rng.choice([20.0, 90.0, 240.0])
        )
    return s.done()


CLUTTER: dict[str, Callable[[Rng], Shot]] = {
    **{f"hand-{kind}": partial(hand, kind=kind) for kind in ("side", "above", "roots")},
    **{f"cable-{kind}": partial(cable, kind=kind) for kind in ("above", "beside", "root", "behind", "on")},
    **{f"wire-{kind}": partial(wire, where=kind) for kind in ("beside", "between")},
    **{f"table-{kind}": partial(table, side=kind) for kind in ("tips", "roots", "side")},
    **{f"label-{kind}": partial(label, where=kind) for kind in ("ground", "finger", "text", "stamp")},
    **{f"part-{kind}": partial(part, where=kind) for kind in ("beside", "above", "standing", "housing", "screws")},
    **{f"shape-{kind}": partial(shaped, kind=kind) for kind in ("cut-inner", "cut-both", "cut-outer")},
    **{f"shape-{kind}": partial(shaped, kind=kind) for kind in ("taper", "unequal")},
    **{f"turned-{kind}": partial(turned_fingers, kind=kind) for kind in ("together", "inwards")},
    **{f"shadow-{kind}": partial(drop_shadow, kind=kind) for kind in ("dark", "faint")},
    **{f"crumbs-{kind}": partial(crumbs, where=kind) for kind in ("edge", "tip")},
    **{f"spot-{kind}": partial(spot, where=kind) for kind in ("finger", "edge", "ground")},
    **{f"pad-{kind}": partial(pad, kind=kind) for kind in ("grey", "alike")},
    **{f"light-{kind}": partial(light, kind=kind) for kind in ("uneven", "vignette", "grid", "cloth")},
    "ruler": ruler,
    "holes": holes,
    "dust": dust,
}  # fmt: skip
