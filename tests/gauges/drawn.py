"""Pictures with known truth, drawn by code that is independent of the program.

Shapes are signed distances, sampled eight times finer than the pixels, spread by a Gaussian and averaged over the
pixels; textures are sums of Gaussian spots whose integrals over the pixels are in closed form.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.special import erf

Floats = NDArray[np.float64]
FINE = 8
# Signed distance (pixels), positive inside, at x and y.
Shape = Callable[[Floats, Floats], Floats]


def half_plane(x_px: float, y_px: float, normal_rad: float) -> Shape:
    """Half plane beyond a line through a point, in the direction of the line's normal."""
    return lambda x, y: (x - x_px) * np.cos(normal_rad) + (y - y_px) * np.sin(normal_rad)


def bar(x_px: float, y_px: float, normal_rad: float, width_px: float) -> Shape:
    """A band about a line."""
    plane = half_plane(x_px, y_px, normal_rad)
    return lambda x, y: 0.5 * width_px - np.abs(plane(x, y))


def disc(x_px: float, y_px: float, radius_px: float) -> Shape:
    """A disc."""
    return lambda x, y: radius_px - np.hypot(x - x_px, y - y_px)


def cross(x_px: float, y_px: float, angle_rad: float, width_px: float, arm_px: float) -> Shape:
    """Two crossing bars with ends."""

    def inside(x: Floats, y: Floats) -> Floats:
        u = (x - x_px) * np.cos(angle_rad) + (y - y_px) * np.sin(angle_rad)
        v = -(x - x_px) * np.sin(angle_rad) + (y - y_px) * np.cos(angle_rad)
        first = np.minimum(0.5 * width_px - np.abs(u), arm_px - np.abs(v))
        return np.maximum(first, np.minimum(0.5 * width_px - np.abs(v), arm_px - np.abs(u)))

    return inside


def corner(x_px: float, y_px: float, angle_rad: float, opening_rad: float = np.pi / 2) -> Shape:
    """A wedge with its tip at a point, open in a given direction."""
    one = half_plane(x_px, y_px, angle_rad + np.pi / 2 - opening_rad / 2)
    other = half_plane(x_px, y_px, angle_rad - np.pi / 2 + opening_rad / 2)
    return lambda x, y: np.minimum(one(x, y), other(x, y))


def checker(x_px: float, y_px: float, angle_rad: float) -> Shape:
    """The corner at which four squares of a chessboard meet."""

    def inside(x: Floats, y: Floats) -> Floats:
        u = (x - x_px) * np.cos(angle_rad) + (y - y_px) * np.sin(angle_rad)
        v = -(x - x_px) * np.sin(angle_rad) + (y - y_px) * np.cos(angle_rad)
        return np.sign(u) * np.sign(v) * np.minimum(np.abs(u), np.abs(v))

    return inside


def drawn(shape: tuple[int, int], ground: float, things: list[tuple[Shape, float]], blur_px: float = 0.9) -> Floats:
    """Light of objects that are painted over each other on a background."""
    pad = int(np.ceil(5 * blur_px)) + 1
    fine_y, fine_x = ((np.arange((size + 2 * pad) * FINE) + 0.5) / FINE - 0.5 - pad for size in shape)
    x, y = np.meshgrid(fine_x, fine_y)
    light = np.full(x.shape, ground)
    for thing, level in things:
        share = np.clip(thing(x, y) * FINE + 0.5, 0.0, 1.0)
        light = light + share * (level - light)
    light = gaussian_filter(light, blur_px * FINE, mode="nearest", truncate=5.0)
    pixels = light.reshape(shape[0] + 2 * pad, FINE, shape[1] + 2 * pad, FINE).mean(axis=(1, 3))
    return pixels[pad:-pad, pad:-pad]


def seen(light: Floats, noise: float, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Picture with noise, rounded to eight bits."""
    return np.clip(np.rint(light + rng.normal(0.0, noise, light.shape)), 0, 255).astype(np.uint8)


class Texture:
    """Spots of a printed texture around a centre, which can be drawn exactly at any position and rotation."""

    def __init__(
        self, rng: np.random.Generator, radius_px: float, spacing_px: float = 4.0, size_px: float = 1.6
    ) -> None:
        count = int(np.pi * radius_px**2 / spacing_px**2)
        angle, away = rng.uniform(0, 2 * np.pi, count), radius_px * np.sqrt(rng.uniform(0, 1, count))
        self.x, self.y = away * np.cos(angle), away * np.sin(angle)
        self.size, self.depth = size_px * rng.uniform(0.8, 1.3, count), rng.uniform(-80, 80, count)

    def light(self, shape: tuple[int, int], x_px: float, y_px: float, turn_rad: float, ground: float = 128.0) -> Floats:
        """Light of the texture with its centre at a point, rotated by an angle."""
        light = np.full(shape, ground)
        cosine, sine = np.cos(turn_rad), np.sin(turn_rad)
        for x, y, size, depth in zip(self.x, self.y, self.size, self.depth, strict=True):
            at_x, at_y = x_px + cosine * x - sine * y, y_px + sine * x + cosine * y
            reach = int(5 * size) + 2
            columns = np.arange(max(int(at_x) - reach, 0), min(int(at_x) + reach + 1, shape[1]))
            rows = np.arange(max(int(at_y) - reach, 0), min(int(at_y) + reach + 1, shape[0]))
            if columns.size and rows.size:
                across, down = (
                    size
                    * np.sqrt(np.pi / 2)
                    * (erf((i - at + 0.5) / size / 2**0.5) - erf((i - at - 0.5) / size / 2**0.5))
                    for i, at in ((columns, at_x), (rows, at_y))
                )
                light[np.ix_(rows, columns)] += depth * down[:, None] * across[None, :]
        return light
