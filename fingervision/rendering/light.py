"""Illumination of the scene: levels of background and fingers, a slope across the frame, a step."""

from dataclasses import dataclass
from math import cos, hypot, radians, sin, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from fingervision.domain.errors import DataError


@dataclass(frozen=True, slots=True)
class LightStep:
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

    factor: float
    at_px: float = 0.0
    towards_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class Light:
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

    ground: float = 200.0
    fingers: float = 40.0
    slope_x: float = 0.0
    slope_y: float = 0.0
    step: LightStep | None = None
    exposure: float = 1.0

    def __post_init__(self) -> None:
        factor = 1.0 if self.step is None else self.step.factor
        if not (abs(self.slope_x) <= 2.0 and abs(self.slope_y) <= 2.0 and factor >= 0.0 and self.exposure >= 0.0):
            msg = (
                "The light must not be negative: slopes must lie between -2 and 2, and factors must be 0 or more, but "
                "slope_x is "
                f"{self.slope_x:g}, slope_y {self.slope_y:g}, the step {factor:g} and the exposure {self.exposure:g}."
            )
            raise DataError(msg)

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
