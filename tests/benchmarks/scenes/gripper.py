"""Two fingers at random, their tones, and the shot that is made of a scene."""

from dataclasses import dataclass

import numpy as np

from tests.benchmarks.scenes.canvas import Canvas, Picture, Rng
from tests.benchmarks.scenes.shapes import Finger, gap_between

PX_PER_MM = 34.0
BELOW_PX = 0.3 * PX_PER_MM
WIDTH, HEIGHT = 640, 480


@dataclass(frozen=True)
class Tones:
    """Grey levels of finger, ground, and everything of a third kind."""

    finger: float
    ground: float

    def between(self, share: float) -> float:
        """A tone between finger (0) and ground (1)."""
        return self.finger + share * (self.ground - self.finger)


@dataclass(frozen=True)
class Shot:
    """One picture with its truth; None where there are no two fingers, or no part is held."""

    picture: Picture
    gap_px: float | None
    held_px: float | None = None
    is_hidden: bool = False


def tones(rng: Rng, light_fingers: float = 0.25) -> Tones:
    """Dark fingers on light ground, or the other way round in this share of the scenes."""
    dark, light = rng.uniform(25, 65), rng.uniform(160, 220)
    return Tones(light, dark) if rng.random() < light_fingers else Tones(dark, light)


def fingers(
    rng: Rng, gap: tuple[float, float] = (40.0, 200.0), tilt_deg: float = 4.0, **options: object
) -> tuple[Finger, Finger]:
    """Two fingers that point up."""
    between, middle = rng.uniform(*gap), 0.5 * WIDTH + rng.uniform(-25, 25)
    width, corner = rng.uniform(45, 105), rng.uniform(2, 22)
    tip = rng.uniform(110, 190)
    made = []
    for side in (-1, 1):
        given = {
            "middle_px": middle + side * 0.5 * (between + width),
            "tip_px": tip + side * rng.uniform(-2, 2),
            "width_px": width * rng.uniform(0.96, 1.04),
            "inner_corner_px": corner,
            "outer_corner_px": corner,
            "tilt_deg": rng.uniform(-tilt_deg, tilt_deg),
            "side": side,
        }
        given.update(options)
        made.append(Finger(**given))  # type: ignore[arg-type]
    return made[0], made[1]


def empty_canvas(rng: Rng, tone: float, uneven: float = 0.15) -> Canvas:
    """Ground with a slope in its light."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    slope = rng.uniform(-uneven, uneven, 2)
    return Canvas(WIDTH, HEIGHT, tone * (1.0 + slope[0] * (x / WIDTH - 0.5) + slope[1] * (y / HEIGHT - 0.5)))


def shot(canvas: Canvas, rng: Rng, pair: tuple[Finger, Finger] | None, turn: bool = True, **truth: object) -> Shot:
    """Take the picture, in any of the four directions."""
    picture = canvas.shot(rng.uniform(0.7, 1.5), rng.uniform(1.0, 3.0), rng)
    quarter = int(rng.integers(4)) if turn else 0
    gap = None if pair is None else gap_between(*pair, BELOW_PX)
    return Shot(np.ascontiguousarray(np.rot90(picture, quarter)), gap, **truth)  # type: ignore[arg-type]
