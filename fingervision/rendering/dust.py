"""Dust: small dark or light grains anywhere in the frame."""

from math import radians

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.rendering.plane import Motion
from fingervision.rendering.polygon import polygon
from fingervision.rendering.scene import Patch

# Largest ratio of length to width of a grain.
LONGEST_RATIO = 2.0


def dust(
    count: int,
    rng: np.random.Generator,
    *,
    frame: tuple[int, int] = (640, 480),
    size_px: tuple[float, float] = (1.0, 6.0),
    levels: tuple[float, ...] = (20.0, 230.0),
) -> tuple[Patch, ...]:
    """Scatter grains over the frame.

    Parameters
    ----------
    count : int
        Number of grains.
    rng : numpy.random.Generator
        Generator of positions, sizes, rotations and levels.
    frame : (int, int)
        Width and height of the frame.
    size_px : (float, float)
        Smallest and largest length of a grain.
    levels : tuple of float
        Grey levels 0..255, chosen with equal probability.

    Returns
    -------
    tuple of Patch
        One patch per grain, to be painted over everything else.

    Raises
    ------
    DataError
        If a size is not positive, or there is no level to choose from.
    """
    if not (count >= 0 and 0.0 < size_px[0] <= size_px[1] and levels):
        msg = (
            "The number of grains must be at least 0, their sizes positive, and their grey levels at least one, "
            f"but they are {count}, {size_px} px and {levels}."
        )
        raise DataError(msg)
    grains = []
    for _ in range(count):
        length = rng.uniform(*size_px)
        width = length / rng.uniform(1.0, LONGEST_RATIO)
        a, b = length / 2, width / 2
        place = Motion(x_px=rng.uniform(0, frame[0] - 1), y_px=rng.uniform(0, frame[1] - 1))
        grain = polygon(((-a, -b), (a, -b), (a, b), (-a, b)), (b,) * 4)
        turned = grain.moved(Motion.turn(radians(rng.uniform(0.0, 180.0)))).moved(place)
        grains.append(Patch((turned,), float(rng.choice(np.array(levels)))))
    return tuple(grains)
