"""A whole gripper: two fingers that are joined by a base in view, with what else such a base shows."""

import numpy as np

from tests.benchmarks.scenes.canvas import Rng
from tests.benchmarks.scenes.gripper import HEIGHT, WIDTH, Shot, empty_canvas, fingers, shot, tones
from tests.benchmarks.scenes.shapes import box, disc


def whole(rng: Rng) -> Shot:
    """Fingers on a common base, which ends in view, is cut off by the border, or stands on a stem."""
    tone = tones(rng)
    canvas, pair = empty_canvas(rng, tone.ground), None
    tip = rng.uniform(60, 120)
    top = tip + rng.uniform(110, 230)
    pair = fingers(rng, (30.0, 160.0), 4.0, tip_px=tip, length_px=top - tip + 25.0)
    low = min(top + rng.uniform(50, 130), HEIGHT - 20.0) if rng.random() < 0.7 else HEIGHT + 50.0
    left, right = pair[0].outline()[:, 0].min(), pair[1].outline()[:, 0].max()
    out = rng.uniform(-5, 45)
    if rng.random() < 0.25:
        left, right = -50.0, WIDTH + 50.0
    for finger in pair:
        canvas.fill(finger.outline(), tone.finger)
    canvas.fill(box(left - out, top, right + out, low), tone.finger)
    if rng.random() < 0.4 and low < HEIGHT:
        middle, half = 0.5 * (left + right), rng.uniform(15, 60)
        canvas.fill(box(middle - half, low - 5, middle + half, HEIGHT + 50), tone.finger)
    if rng.random() < 0.4:
        for x in np.linspace(left + 20, right - 20, int(rng.integers(2, 5))):
            canvas.fill(disc(x, 0.5 * (top + min(low, HEIGHT - 1)), rng.uniform(5, 14)), tone.ground)
    return shot(canvas, rng, pair)
