"""Parts held between the fingers, or lying free between them: twelve kinds of part and place."""

from collections.abc import Callable
from functools import partial

import numpy as np

from tests.benchmarks.scenes.canvas import Canvas, Points, Rng
from tests.benchmarks.scenes.gripper import BELOW_PX, HEIGHT, Shot, empty_canvas, fingers, shot, tones
from tests.benchmarks.scenes.shapes import Finger, box, disc, turned

# Under the fingers, so that its edge is the finger's.
UNDER_PX = 3.0


def _scene(rng: Rng) -> tuple[Canvas, tuple[Finger, Finger], float, float, float]:
    tone = tones(rng)
    pair = fingers(rng, (40.0, 180.0), 3.0)
    return empty_canvas(rng, tone.ground), pair, tone.finger, tone.ground, max(finger.tip() for finger in pair)


def _paint(canvas: Canvas, pair: tuple[Finger, Finger], tone: float) -> None:
    for finger in pair:
        canvas.fill(finger.outline(), tone)


def _between(pair: tuple[Finger, Finger], top: float, bottom: float) -> Points:
    """A bar that fills the room between two fingers, from one height to another."""
    left, right = pair
    corner = max(left.inner_corner_px, 1.0)
    # Above the straight flanks the part has the breadth that it has where they begin.
    straight = max(top, left.tip() + corner, right.tip() + corner)
    heights = (straight, max(bottom, straight))
    inner = [(left.inner(h) - UNDER_PX, right.inner(h) + UNDER_PX) for h in heights]
    if bottom <= heights[0]:
        inner[1] = inner[0]
    elif top < heights[0]:
        inner[0] = (inner[0][0] + UNDER_PX + 0.2, inner[0][1] - UNDER_PX - 0.2)
    return np.array([(inner[0][0], top), (inner[0][1], top), (inner[1][1], bottom), (inner[1][0], bottom)])


def _held(pair: tuple[Finger, Finger], height: float) -> float:
    """Room between the two straight flanks at a height."""
    left, right = pair
    low = height + 60.0
    slope = [(finger.inner(low + 50.0) - finger.inner(low)) / 50.0 for finger in pair]
    return right.inner(low) - left.inner(low) - (low - height) * (slope[1] - slope[0])


def _tone(rng: Rng, finger: float, ground: float, kind: str) -> float:
    if kind == "alike":
        return finger + rng.uniform(-8, 8)
    share = rng.uniform(0.3, 0.7) if kind == "between" else rng.uniform(1.12, 1.25)
    return float(np.clip(finger + share * (ground - finger), 5, 250))


def bar(rng: Rng, top: tuple[float, float], length: tuple[float, float], kind: str) -> Shot:
    """A bar; `top` is counted from the tips' measuring height."""
    canvas, pair, finger, ground, tip = _scene(rng)
    upper = tip + BELOW_PX + rng.uniform(*top)
    lower = upper + rng.uniform(*length)
    canvas.fill(_between(pair, upper, lower), _tone(rng, finger, ground, kind))
    _paint(canvas, pair, finger)
    hidden = upper < tip + BELOW_PX + 1.0 and lower > tip + BELOW_PX - 1.0 and kind == "alike"
    held = _held(pair, 0.5 * (max(upper, tip) + min(lower, HEIGHT - 1.0)))
    return shot(canvas, rng, pair, held_px=held, is_hidden=hidden)


def round_part(rng: Rng, middle: tuple[float, float], kind: str, sides: int = 0) -> Shot:
    """A disc or a polygon that touches both fingers; `middle` is counted from the measuring height."""
    canvas, pair, finger, ground, tip = _scene(rng)
    centre = max(tip + BELOW_PX + rng.uniform(*middle), tip + pair[0].inner_corner_px + 1.0)
    left, right = pair[0].inner(centre), pair[1].inner(centre)
    radius, x = 0.5 * (right - left) + 0.3, 0.5 * (left + right)
    part = disc(x, centre, radius)
    if sides:
        angle = 2.0 * np.pi * np.arange(sides) / sides
        part = np.column_stack((x + radius * np.cos(angle), centre + radius * np.sin(angle)))
    canvas.fill(part, _tone(rng, finger, ground, kind))
    _paint(canvas, pair, finger)
    hidden = abs(centre - tip - BELOW_PX) < 2.0 and kind == "alike"
    return shot(canvas, rng, pair, held_px=right - left, is_hidden=hidden)


def free(rng: Rng) -> Shot:
    """A part between open fingers that touches neither."""
    tone = tones(rng)
    pair = fingers(rng, (90.0, 220.0), 3.0)
    canvas, tip = empty_canvas(rng, tone.ground), max(finger.tip() for finger in pair)
    height = tip + BELOW_PX + rng.uniform(-15, 60)
    room = pair[1].inner(tip + 60) - pair[0].inner(tip + 60)
    size, x = rng.uniform(0.25, 0.7) * room, 0.5 * (pair[0].inner(tip + 60) + pair[1].inner(tip + 60))
    x += rng.uniform(-0.8, 0.8) * 0.5 * (room - size - 12)
    part = disc(x, height, 0.5 * size)
    if rng.random() < 0.5:
        part = turned(box(x - 0.45 * size, height - 0.4 * size, x + 0.45 * size, height + 0.4 * size), 0, (x, height))
    canvas.fill(part, _tone(rng, tone.finger, tone.ground, rng.choice(["alike", "between"])))
    _paint(canvas, pair, tone.finger)
    return shot(canvas, rng, pair)


def on_one(rng: Rng) -> Shot:
    """A part that sticks to one finger only, at or below the measuring height."""
    tone = tones(rng)
    pair = fingers(rng, (90.0, 220.0), 3.0)
    canvas, tip = empty_canvas(rng, tone.ground), max(finger.tip() for finger in pair)
    upper = tip + BELOW_PX + rng.uniform(-4, 50)
    lower = upper + rng.uniform(20, 80)
    part = _between(pair, upper, lower)
    share = rng.uniform(0.3, 0.7)
    if rng.random() < 0.5:
        part[1:3, 0] = part[[0, 3], 0] + share * (part[1:3, 0] - part[[0, 3], 0])
        hides = pair[0]
    else:
        part[[0, 3], 0] = part[1:3, 0] + share * (part[[0, 3], 0] - part[1:3, 0])
        hides = pair[1]
    canvas.fill(part, _tone(rng, tone.finger, tone.ground, "alike"))
    _paint(canvas, pair, tone.finger)
    own = hides.tip() + BELOW_PX
    return shot(canvas, rng, pair, is_hidden=upper - 1.0 < own < lower + 1.0)


GRIPPED: dict[str, Callable[[Rng], Shot]] = {
    "bar-at": partial(bar, top=(-9.0, -2.0), length=(20.0, 70.0), kind="alike"),
    "bar-below": partial(bar, top=(6.0, 60.0), length=(15.0, 80.0), kind="alike"),
    "bar-above": partial(bar, top=(-24.0, -18.0), length=(13.0, 14.0), kind="alike"),
    "bar-hangs-out-above": partial(bar, top=(-80.0, -20.0), length=(90.0, 160.0), kind="alike"),
    "bar-hangs-out-below": partial(bar, top=(6.0, 60.0), length=(450.0, 460.0), kind="alike"),
    "bar-other-tone": partial(bar, top=(-30.0, 20.0), length=(30.0, 90.0), kind="between"),
    "bar-lighter": partial(bar, top=(-30.0, 20.0), length=(30.0, 90.0), kind="lighter"),
    "disc-at": partial(round_part, middle=(-8.0, 8.0), kind="alike"),
    "disc-below": partial(round_part, middle=(20.0, 90.0), kind="alike"),
    "hexagon": partial(round_part, middle=(-5.0, 60.0), kind="alike", sides=6),
    "free": free,
    "on-one-finger": on_one,
}
