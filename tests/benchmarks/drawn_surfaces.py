"""Surfaces with sharp edges, drawn ten times finer than a camera's pixels, continuing beyond their borders.

They share nothing with the product and nothing with photographs; every call draws another.
"""

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Floats = NDArray[np.float64]
SIZE = 520


def _painted(paint: Callable[[NDArray[np.uint8]], None]) -> Floats:
    """What is painted beyond a border comes in at the other side."""
    light = np.zeros((3 * SIZE, 3 * SIZE), np.uint8)
    paint(light)
    return light.reshape(3, SIZE, 3, SIZE).max(axis=(0, 2)).astype(float)


def _anywhere(rng: np.random.Generator) -> tuple[int, int]:
    x, y = rng.integers(SIZE, 2 * SIZE, 2)
    return int(x), int(y)


def masonry(rng: np.random.Generator) -> Floats:
    """Bricks in rows along the pixels, with joints of 0.4 px."""
    light, y = rng.normal(0, 0.15, (SIZE, SIZE)), 0
    while y < SIZE:
        height, x = int(rng.integers(45, 85)), -int(rng.integers(0, 100))
        while x < SIZE:
            width = int(rng.integers(80, 160))
            light[y + 4 : y + height, max(x + 4, 0) : max(x + width, 0)] += 1 + rng.normal(0, 0.2)
            x += width
        y += height
    return light


def _cells(rng: np.random.Generator, count: int) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    middles, (y, x) = rng.uniform(0, SIZE, (count, 2)), np.mgrid[:SIZE, :SIZE]
    away, which = cKDTree(middles, boxsize=SIZE).query(np.stack([y.ravel(), x.ravel()], axis=1), k=2)
    return away, which


def cells(rng: np.random.Generator) -> Floats:
    """Facets of levels of their own."""
    _, which = _cells(rng, 250)
    return rng.normal(0, 1, 250)[which[:, 0]].reshape(SIZE, SIZE)


def crackle(rng: np.random.Generator) -> Floats:
    """Fine cracks between facets of one level."""
    away, _ = _cells(rng, 120)
    return -(away[:, 1] - away[:, 0] < 5.0).astype(float).reshape(SIZE, SIZE)


def speckle(rng: np.random.Generator) -> Floats:
    """Sprayed discs, as for image correlation."""

    def paint(light: NDArray[np.uint8]) -> None:
        for _ in range(400):
            cv2.circle(light, _anywhere(rng), int(rng.integers(5, 18)), 255, -1)

    return _painted(paint)


def strokes(rng: np.random.Generator) -> Floats:
    """Scratches of 0.3 to 1.2 px."""

    def paint(light: NDArray[np.uint8]) -> None:
        for _ in range(120):
            x, y = _anywhere(rng)
            across, down = rng.integers(-60, 60, 2)
            cv2.line(light, (x, y), (x + int(across), y + int(down)), 255, int(rng.integers(3, 12)))

    return _painted(paint)


def grains(rng: np.random.Generator) -> Floats:
    """White noise of half a pixel."""
    return np.kron(rng.normal(size=(SIZE // 5, SIZE // 5)), np.ones((5, 5)))


def letters(rng: np.random.Generator) -> Floats:
    """Small print."""

    def paint(light: NDArray[np.uint8]) -> None:
        for _ in range(260):
            font, letter = int(rng.integers(0, 5)), chr(int(rng.integers(65, 91)))
            cv2.putText(light, letter, _anywhere(rng), font, rng.uniform(1.2, 2.5), 255, int(rng.integers(3, 8)))

    return _painted(paint)


def confetti(rng: np.random.Generator) -> Floats:
    """Rectangles along the pixels."""

    def paint(light: NDArray[np.uint8]) -> None:
        for _ in range(200):
            x, y = _anywhere(rng)
            wide, high = rng.integers(8, 50, 2)
            cv2.rectangle(light, (x, y), (x + int(wide), y + int(high)), int(rng.integers(50, 256)), -1)

    return _painted(paint)


def needles(rng: np.random.Generator) -> Floats:
    """Thin ellipses that lie within 0.2 rad of the rows of pixels."""

    def paint(light: NDArray[np.uint8]) -> None:
        for _ in range(200):
            axes = int(rng.integers(20, 60)), int(rng.integers(2, 7))
            cv2.ellipse(
                light, _anywhere(rng), axes, np.degrees(rng.uniform(-0.2, 0.2)), 0, 360, int(rng.integers(80, 256)), -1
            )

    return _painted(paint)


SURFACES: dict[str, Callable[[np.random.Generator], Floats]] = {
    surface.__name__: surface
    for surface in (masonry, cells, crackle, speckle, strokes, grains, letters, confetti, needles)
}
