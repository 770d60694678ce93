"""The scene in front of the camera: fingers, other objects, dust, highlights, a bright rim, light."""

from dataclasses import dataclass
from math import radians

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.rendering.finger import Finger
from fingervision.rendering.light import EVEN_LIGHT, Light
from fingervision.rendering.outline import Motion, Outline
from fingervision.rendering.polygon import polygon


@dataclass(frozen=True, slots=True)
class Patch:
    """A shape with its own grey level, painted over what is below.

    Parameters
    ----------
    outlines : tuple of Outline
        Solids that do not overlap, and holes in them.
    level : float
        Grey level 0..255.
    """

    outlines: tuple[Outline, ...]
    level: float


@dataclass(frozen=True, slots=True)
class Rim:
    """A bright line along the outside of the fingers' edges.

    Parameters
    ----------
    width_px : float
        Width of the line outwards from the edge.
    level : float
        Grey level 0..255.

    Raises
    ------
    FingervisionError
        If the width is not positive.
    """

    width_px: float
    level: float

    def __post_init__(self) -> None:
        if not self.width_px > 0.0:
            msg = f"width_px of a rim must be positive, but is {self.width_px:g}."
            raise DataError(msg)


@dataclass(frozen=True, slots=True)
class Scene:
    """All objects to be rendered, in the ideal picture without lens distortion, blur or noise.

    Parameters
    ----------
    fingers : tuple of Finger
        Fingers; they may overlap, so that touching fingers form one object.
    width_px, height_px : int
        Size of the frame.
    light : Light
        Levels, slope and step of the illumination, and exposure.
    behind : tuple of Patch
        Other objects in view, which the fingers cover.
    before : tuple of Patch
        Dust, and highlights inside the fingers; painted over everything else.
    rim : Rim or None
        A bright rim outside the fingers.

    Raises
    ------
    FingervisionError
        If a level is outside 0..255, or the frame has no pixels.
    """

    fingers: tuple[Finger, ...] = ()
    width_px: int = 640
    height_px: int = 480
    light: Light = EVEN_LIGHT
    behind: tuple[Patch, ...] = ()
    before: tuple[Patch, ...] = ()
    rim: Rim | None = None

    def __post_init__(self) -> None:
        if self.width_px < 1 or self.height_px < 1:
            msg = f"A frame must have at least one pixel each way, but is {self.width_px} x {self.height_px}."
            raise DataError(msg)
        levels = [self.light.ground, self.light.fingers]
        levels += [patch.level for patch in self.behind + self.before]
        levels += [self.rim.level] if self.rim else []
        for level in levels:
            if not 0.0 <= level <= 255.0:
                msg = f"A grey level must lie between 0 and 255, but is {level:g}."
                raise DataError(msg)


# Dust: small dark or light grains anywhere in the frame.


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
