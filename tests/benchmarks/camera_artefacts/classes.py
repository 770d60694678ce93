"""The classes of pictures: one function each, from a random generator to a picture with its true gap."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from tests.benchmarks.camera_artefacts import electronics as e
from tests.benchmarks.camera_artefacts.optics import Surface, light_on_sensor
from tests.benchmarks.camera_artefacts.scene import Finger, true_gap

BELOW_PX = 0.3 * 34.0
SIZE_PX = (448, 320)
NOISE = 2.0 / 255.0

Rng = np.random.Generator


@dataclass(frozen=True)
class Shot:
    """One picture with its truth; `is_jpeg` where it is read as JPEG, `transfer` the curve that its camera has."""

    picture: e.Picture
    gap_px: float
    is_jpeg: bool = False
    transfer: str = "linear"


def gripper(rng: Rng, tilt_deg: float = 4.0, scale: float = 1.0) -> tuple[Finger, Finger]:
    """Two fingers at random."""
    gap, middle = rng.uniform(50.0, 130.0) / scale, 0.5 * (SIZE_PX[0] - 1) + rng.uniform(-4.0, 4.0)
    width = rng.uniform(80.0, 110.0) / scale
    radius = rng.uniform(4.0, 36.0) / scale
    tips = 0.5 * SIZE_PX[1] - (60.0 + rng.uniform(-10.0, 10.0, 2)) / scale
    tilts = rng.uniform(-tilt_deg, tilt_deg, 2)
    left = Finger(middle - 0.5 * (gap + width), tips[0], width, radius, tilts[0])
    return left, Finger(middle + 0.5 * (gap + width), tips[0] + rng.uniform(-3.0, 3.0) / scale, width, radius, tilts[1])


def plain(rng: Rng, surface: Surface, blur_px: float | None = None) -> Shot:
    fingers = gripper(rng)
    light = light_on_sensor(fingers, surface, blur_px or rng.uniform(0.8, 1.2), SIZE_PX, rng)
    return Shot(e.stored(e.noisy(light, NOISE, rng)), true_gap(*fingers, BELOW_PX))


def gamma(rng: Rng, blur_px: float) -> Shot:
    fingers = gripper(rng)
    light = light_on_sensor(fingers, Surface(ground=0.7, finger=0.06), blur_px, SIZE_PX, rng)
    levels = e.power_law(e.noisy(light, 0.6 * NOISE, rng))
    return Shot(e.stored(levels), true_gap(*fingers, BELOW_PX), transfer="power")


def webcam(rng: Rng) -> Shot:
    fingers = gripper(rng)
    light = light_on_sensor(fingers, Surface(ground=0.65, finger=0.06), rng.uniform(0.9, 1.2), SIZE_PX, rng)
    levels = e.sharpened(e.power_law(e.noisy(light, 0.6 * NOISE, rng)), 0.5, 1.0)
    return Shot(e.jpeg(e.stored(levels), 85), true_gap(*fingers, BELOW_PX), is_jpeg=True, transfer="power")


def shadow(rng: Rng, share: float, over_px: float) -> Shot:
    return plain(rng, Surface(shadow=share, shadow_px=over_px))


def wall(rng: Rng, breadth_px: float) -> Shot:
    return plain(rng, Surface(wall_px=breadth_px, wall=rng.uniform(0.3, 0.7)))


def glare(rng: Rng, inside_px: float) -> Shot:
    return plain(rng, Surface(glare=rng.uniform(0.3, 0.6), glare_inside_px=inside_px))


def texture(rng: Rng, rough_px: float) -> Shot:
    return plain(rng, Surface(texture=0.05, rough_px=rough_px))


def motion(rng: Rng, way_px: float) -> Shot:
    return plain(rng, Surface(motion_px=(way_px, rng.uniform(0.3, 1.0) * way_px)))


def interlaced(rng: Rng) -> Shot:
    """The right finger has moved by a pixel between the two fields; the truth is half-way."""
    left, right = gripper(rng)
    blur = rng.uniform(0.8, 1.2)
    fields = [
        light_on_sensor((left, replace(right, across_px=right.across_px + by)), Surface(), blur, SIZE_PX, rng)
        for by in (-0.5, 0.5)
    ]
    light = fields[0]
    light[1::2] = fields[1][1::2]
    return Shot(e.stored(e.noisy(light, NOISE, rng)), true_gap(left, right, BELOW_PX))


def zoom(rng: Rng, times: float) -> Shot:
    fingers = gripper(rng, scale=times)
    light = light_on_sensor(fingers, Surface(), rng.uniform(0.8, 1.2) / np.sqrt(times), SIZE_PX, rng)
    levels = e.enlarged(np.rint(255.0 * e.noisy(light, NOISE, rng)) / 255.0, times, SIZE_PX)
    return Shot(e.stored(levels), times * true_gap(*fingers, BELOW_PX / times))


def bayer(rng: Rng) -> Shot:
    fingers = gripper(rng)
    light = light_on_sensor(fingers, Surface(), rng.uniform(0.8, 1.2), SIZE_PX, rng)
    return Shot(e.stored(e.mosaic(light, NOISE, rng)), true_gap(*fingers, BELOW_PX))


def resaved(rng: Rng) -> Shot:
    shot = plain(rng, Surface())
    return replace(shot, picture=e.jpeg(shot.picture, 75))


def denoised(rng: Rng, how: str) -> Shot:
    shot = plain(rng, Surface())
    return replace(shot, picture=e.denoised(shot.picture, how))


CLASSES: dict[str, Callable[[Rng], Shot]] = {
    "plain": partial(plain, surface=Surface()),
    "gamma-blur-0.9": partial(gamma, blur_px=0.9),
    "gamma-blur-2": partial(gamma, blur_px=2.0),
    "webcam": webcam,
    "texture": partial(texture, rough_px=0.0),
    "texture-rough-0.3": partial(texture, rough_px=0.3),
    "shadow-20%-6px": partial(shadow, share=0.2, over_px=6.0),
    "shadow-40%-12px": partial(shadow, share=0.4, over_px=12.0),
    "wall-2px": partial(wall, breadth_px=2.0),
    "wall-4px": partial(wall, breadth_px=4.0),
    "glare-1.5px": partial(glare, inside_px=1.5),
    "glare-4px": partial(glare, inside_px=4.0),
    "motion-6px": partial(motion, way_px=6.0),
    "motion-10px": partial(motion, way_px=10.0),
    "interlaced-1px": interlaced,
    "zoom-1.5": partial(zoom, times=1.5),
    "zoom-2": partial(zoom, times=2.0),
    "bayer": bayer,
    "jpeg-75-resaved": resaved,
    "median": partial(denoised, how="median"),
    "bilateral": partial(denoised, how="bilateral"),
    "non-local-means": partial(denoised, how="non-local means"),
}
