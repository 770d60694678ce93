"""A frame in the form that gauges use: levels are converted to light where needed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calib.camera_response import CameraResponse
from fingervision.domain.frame import Coding, Frame
from fingervision.vision.coded_picture import EIGHT_BITS, displaced_px
from fingervision.vision.grey import GreyImage, to_grey, top_level
from fingervision.vision.pipeline import Settings

Floats = NDArray[np.float64]

# Number of neighbouring pixels whose codec errors are alike and which therefore count as one pixel.
SHARED_PIXELS = {Coding.LOSSLESS: 1.0, Coding.INTRAFRAME: 2.5, Coding.INTERFRAME: 12.0}
# The same number for edges, which is larger along the borders of a codec's blocks; it follows from the scatter of a
# pair gauge across upright fingers in HEVC at 1 Mbit/s.
EDGE_SHARED_PIXELS = SHARED_PIXELS | {Coding.INTERFRAME: 36.0}


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """One frame in the form that gauges use.

    Parameters
    ----------
    frame : Frame
        The frame itself.
    grey : ndarray, shape (height, width)
        Grey levels of the frame.
    light : ndarray of float, shape (levels,), or None
        Light for every level (look-up table); None if the levels are proportional to light.
    top : float
        Highest level of the scale.
    settings : Settings
        Settings of the measurement.
    """

    frame: Frame
    grey: GreyImage
    light: Floats | None
    top: float
    settings: Settings

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        return self.grey.shape[1], self.grey.shape[0]

    @property
    def coding(self) -> Coding:
        """Compression between the sensor and the pixels."""
        return self.frame.coding

    @property
    def shared_pixels(self) -> float:
        """Number of neighbouring pixels with the same codec error, which count as one pixel."""
        return SHARED_PIXELS[self.frame.coding]

    @property
    def edge_shared_pixels(self) -> float:
        """Number of pixels with the same error for edge fits; 1 if `displaced_px` already accounts for the codec."""
        return EDGE_SHARED_PIXELS[self.frame.coding] if self.frame.quantiser is None else 1.0

    def displaced_px(
        self, place_px: tuple[float, float], half_px: tuple[float, float], inside: float, contrast: float
    ) -> float:
        """Standard uncertainty of an edge's position (px) from a codec error that the whole edge shares.

        Parameters
        ----------
        place_px : (float, float)
            Middle of the edge.
        half_px : (float, float)
            Half width and half height of the area of pixels that determine the edge.
        inside, contrast : float
            Light on one side of the edge, and light on the other side minus this.
        """
        quantiser = self.frame.quantiser
        if quantiser is None:
            return 0.0
        levels = [inside, inside + contrast]
        if self.light is not None:
            scale = self.light[: int(self.top) + 1]
            levels = list(np.interp(levels, scale, np.arange(scale.size)))
        return displaced_px(quantiser.near(*place_px, *half_px), (levels[1] - levels[0]) * EIGHT_BITS / self.top)

    def part(self, x_px: int, y_px: int, width_px: int, height_px: int) -> tuple[Floats, tuple[int, int]]:
        """Light in a rectangle clipped to the picture, with the first column and row of the clipped rectangle."""
        width, height = self.size_px
        left, top = min(max(x_px, 0), width), min(max(y_px, 0), height)
        right, bottom = min(max(x_px + width_px, left), width), min(max(y_px + height_px, top), height)
        stored = self.grey[top:bottom, left:right]
        return (stored.astype(np.float64) if self.light is None else self.light[stored]), (left, top)

    def holds(self, x_px: float, y_px: float, width_px: float, height_px: float) -> bool:
        """Whether the picture contains the whole of a rectangle."""
        width, height = self.size_px
        return x_px >= -0.5 and y_px >= -0.5 and x_px + width_px <= width + 0.5 and y_px + height_px <= height + 0.5


def picture_of(frame: Frame, settings: Settings) -> Picture:
    """Prepare a frame for the gauges."""
    grey = to_grey(frame.pixels)
    response: CameraResponse = settings.response
    top = top_level(grey, settings.bits if response.top_level is None else response.top_level.bit_length())
    light = None if response.name == "linear" else response.table(top, int(np.iinfo(grey.dtype).max) + 1)
    return Picture(frame, grey, light, float(top), settings)
