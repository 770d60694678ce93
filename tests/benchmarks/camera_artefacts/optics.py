"""From distances to light on the sensor: sampled sixteen times a pixel, blurred, summed over each pixel."""

from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.camera_artefacts.scene import Finger

Floats = NDArray[np.float64]
SAMPLES = 4


@dataclass(frozen=True)
class Surface:
    """What the fingers and the ground look like; levels are shares of full scale in linear light.

    Parameters
    ----------
    ground, finger : float
        Light of the two.
    texture, texture_px : float
        Standard deviation and correlation length of the finger's own pattern.
    rough_px, rough_length_px : float
        Standard deviation of the edge about its mean line, and its correlation length along the edge.
    shadow, shadow_px : float
        Share of the ground's light that is missing at the edge, and over how many pixels it comes back.
    wall_px, wall : float
        Breadth of a side wall in view, on the gap's side, and its level between finger (0) and ground (1).
    glare, glare_inside_px : float
        Extra light of a line along the edge, and how far inside it lies.
    motion_px : (float, float)
        Way of each finger across, while the shutter is open.
    """

    ground: float = 0.75
    finger: float = 0.12
    texture: float = 0.0
    texture_px: float = 3.0
    rough_px: float = 0.0
    rough_length_px: float = 4.0
    shadow: float = 0.0
    shadow_px: float = 6.0
    wall_px: float = 0.0
    wall: float = 0.5
    glare: float = 0.0
    glare_inside_px: float = 1.5
    motion_px: tuple[float, float] = field(default=(0.0, 0.0))


def light_on_sensor(
    fingers: tuple[Finger, Finger],
    surface: Surface,
    blur_px: float,
    size_px: tuple[int, int],
    rng: np.random.Generator,
) -> Floats:
    """Mean light on every pixel, shape (height, width); 1 is full scale."""
    width, height = size_px
    step = 1.0 / SAMPLES
    x = ((np.arange(width * SAMPLES) + 0.5) * step - 0.5).astype(np.float32)
    y = ((np.arange(height * SAMPLES) + 0.5) * step - 0.5).astype(np.float32)
    shape = (y.size, x.size)
    away = [finger.distance(x[None, :], y[:, None]) for finger in fingers]
    if surface.rough_px:
        away = [d + surface.rough_px * _field(shape, surface.rough_length_px, rng) for d in away]
    light = np.full(shape, surface.ground, dtype=np.float32)
    nearest = np.minimum(*away)
    if surface.shadow:
        light *= 1.0 - surface.shadow * np.clip(1.0 - nearest / surface.shadow_px, 0.0, 1.0)
    face = np.full(shape, surface.finger, dtype=np.float32)
    if surface.texture:
        face += surface.texture * _field(shape, surface.texture_px, rng)
    for k, d in enumerate(away):
        if surface.wall_px:
            sense = 1.0 if k == 0 else -1.0
            back = replace(fingers[k], across_px=fingers[k].across_px + sense * surface.wall_px)
            level = surface.finger + surface.wall * (surface.ground - surface.finger)
            behind = _covered(back.distance(x[None, :], y[:, None]), surface.motion_px[k])
            light += behind * (level - light)
        own = face
        if surface.glare:
            line = np.exp(-0.5 * ((d + surface.glare_inside_px) / 0.5) ** 2)
            own = face + surface.glare * line
        light += _covered(d, surface.motion_px[k]) * (own - light)
    sigma = blur_px * SAMPLES
    spread = cv2.GaussianBlur(light, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE)
    summed = spread.reshape(height, SAMPLES, width, SAMPLES).mean(axis=(1, 3), dtype=np.float64)
    return np.asarray(summed)


def _covered(distance: Floats, motion_px: float) -> Floats:
    """Share of each sample that is covered, on average while the finger moves by so much."""
    covered = np.clip(0.5 - distance * SAMPLES, 0.0, 1.0)
    wide = round(motion_px * SAMPLES)
    return covered if wide < 2 else np.asarray(cv2.blur(covered, (wide | 1, 1), borderType=cv2.BORDER_REPLICATE))


def _field(shape: tuple[int, int], length_px: float, rng: np.random.Generator) -> Floats:
    """Gaussian field of unit variance with this correlation length."""
    coarse = rng.standard_normal((shape[0] // SAMPLES + 1, shape[1] // SAMPLES + 1))
    smooth = cv2.GaussianBlur(coarse, (0, 0), length_px / np.sqrt(2.0), borderType=cv2.BORDER_REFLECT)
    smooth /= smooth.std()
    return np.asarray(cv2.resize(smooth.astype(np.float32), (shape[1], shape[0]), interpolation=cv2.INTER_LINEAR))
