"""How coarsely a codec has rounded a picture, place by place."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# Codecs state a quantiser for every so many pixels.
BLOCK_PX = 16


@dataclass(frozen=True, slots=True, eq=False)
class Quantiser:
    """Steps to which a codec rounds what it changes in a picture (the coefficients of its cosine transform).

    A coder leaves alone what is less than a part of a step: an edge may be displaced by so much and nothing more is
    sent. Steps of codecs that leave more or less of a step alone are given as those of H.264 that leave as much.

    Parameters
    ----------
    step : ndarray of float32, shape (rows, columns)
        Step of every block of 16 x 16 pixels, in grey levels of 8 bits, for a transform of unit gain.
    first_px : (int, int)
        Column and row of the picture at which the first block begins.
    """

    step: NDArray[np.float32]
    first_px: tuple[int, int] = (0, 0)

    def near(self, x_px: float, y_px: float, across_px: float, along_px: float) -> float:
        """Coarsest step within a rectangle about a place, `across_px` wide to either side and `along_px` high."""
        rows, columns = self.step.shape
        left, right = (self._block(x_px + way - self.first_px[0], columns) for way in (-across_px, across_px))
        top, bottom = (self._block(y_px + way - self.first_px[1], rows) for way in (-along_px, along_px))
        return float(self.step[top : bottom + 1, left : right + 1].max())

    def seen_from(self, x_px: int, y_px: int) -> "Quantiser":
        """The same for a part of the picture that begins at this column and row."""
        return Quantiser(self.step, (self.first_px[0] - x_px, self.first_px[1] - y_px))

    def turned(self, quarters: int, width_px: int, height_px: int) -> "Quantiser":
        """The same for the picture turned anticlockwise by so many quarters; its size is that before the turn."""
        found = self
        for _ in range(quarters % 4):
            columns = found.step.shape[1]
            first = (found.first_px[1], width_px - found.first_px[0] - columns * BLOCK_PX)
            found = Quantiser(np.ascontiguousarray(np.rot90(found.step)), first)
            width_px, height_px = height_px, width_px
        return found

    @staticmethod
    def _block(place_px: float, count: int) -> int:
        return min(max(int((place_px + 0.5) // BLOCK_PX), 0), count - 1)
