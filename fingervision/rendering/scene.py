"""The scene in front of the camera: fingers, other objects, dust, highlights, a bright rim, light."""

from dataclasses import dataclass
from math import cos, hypot, radians, sin, sqrt
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from fingervision.domain.errors import DataError
from fingervision.domain.field import Field, Limited
from fingervision.rendering.finger import Finger
from fingervision.rendering.outline import Motion, Outline
from fingervision.rendering.polygon import polygon

Level = Annotated[float, Field("grey level", low=0.0, high=255.0)]
# A steeper slope would make the light negative at a border of the frame.
Slope = Annotated[float, Field("relative rise of the light across the frame", low=-2.0, high=2.0)]
# Illumination of the scene: levels of background and fingers, a slope across the frame, a step.


@dataclass(frozen=True, slots=True)
class LightStep(Limited):
    """A straight border beyond which the light is stronger or weaker.

    Parameters
    ----------
    factor : float
        Light beyond the border, relative to this side.
    at_px : float
        Distance of the border from the frame's centre.
    towards_deg : float
        Direction of the side beyond the border: 0 is to the right, 90 is down.
    """

    factor: Annotated[float, Field(low=0.0)]
    at_px: float = 0.0
    towards_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class Light(Limited):
    """Grey levels of background and fingers, and the variation of light over the frame.

    Parameters
    ----------
    ground : float
        Grey level 0..255 of the background.
    fingers : float
        Grey level 0..255 of the fingers; below `ground` for dark fingers on a light ground, above for the reverse.
    slope_x, slope_y : float
        Relative rise of the light from one border of the frame to the other, with no change at the centre: 0.4 is -20 %
        to +20 %.
    step : LightStep or None
        A step in the light.
    exposure : float
        Factor on all levels; levels above the full scale are clipped.

    Raises
    ------
    FingervisionError
        If the light would be negative somewhere in the frame.
    """

    ground: Level = 200.0
    fingers: Level = 40.0
    slope_x: Slope = 0.0
    slope_y: Slope = 0.0
    step: LightStep | None = None
    exposure: Annotated[float, Field(low=0.0)] = 1.0

    def field(self, width_px: int, height_px: int, blur_px: float) -> NDArray[np.float64] | float:
        """Factor by which the light changes each pixel's grey level; a single number if the light is uniform."""
        field: NDArray[np.float64] | float = self.exposure
        if self.slope_x:
            field = field * (1.0 + self.slope_x * (np.arange(width_px) - (width_px - 1) / 2) / width_px)
        if self.slope_y:
            column = 1.0 + self.slope_y * (np.arange(height_px) - (height_px - 1) / 2) / height_px
            field = field * column[:, None]
        if self.step is not None:
            angle = radians(self.step.towards_deg)
            x = (np.arange(width_px) - (width_px - 1) / 2) * cos(angle)
            y = (np.arange(height_px) - (height_px - 1) / 2) * sin(angle)
            spread = sqrt(2.0) * hypot(blur_px, sqrt(1 / 12))
            beyond = 0.5 * (1.0 + erf((x + y[:, None] - self.step.at_px) / spread))
            field = field * (1.0 + (self.step.factor - 1.0) * beyond)
        return field


EVEN_LIGHT = Light()


@dataclass(frozen=True, slots=True)
class Patch(Limited):
    """A shape with its own grey level, painted over what is below.

    Parameters
    ----------
    outlines : tuple of Outline
        Solids that do not overlap, and holes in them.
    level : float
        Grey level 0..255.
    """

    outlines: tuple[Outline, ...]
    level: Level


@dataclass(frozen=True, slots=True)
class Rim(Limited):
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

    width_px: Annotated[float, Field(above=0.0)]
    level: Level


@dataclass(frozen=True, slots=True)
class Scene(Limited):
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
    width_px: Annotated[int, Field(low=1)] = 640
    height_px: Annotated[int, Field(low=1)] = 480
    light: Light = EVEN_LIGHT
    behind: tuple[Patch, ...] = ()
    before: tuple[Patch, ...] = ()
    rim: Rim | None = None


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
        raise DataError(
            "The number of grains must be at least 0, their sizes positive, and their grey levels at least one, "
            f"but they are {count}, {size_px} px and {levels}."
        )
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
