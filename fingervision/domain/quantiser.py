"""How coarsely a codec has rounded each place of a picture."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# Codecs state a quantiser for every so many pixels.
BLOCK_PX = 16


@dataclass(frozen=True, slots=True, eq=False)
class Quantiser:
    """Quantiser steps of a codec: to which multiples it rounds the coefficients of its cosine transform.

    A coder sends no change that is less than a fraction of a step, so that an edge may be displaced by that much
    unnoticed. The steps of other codecs, whose dead zone is another fraction, are given as the H.264 steps with the
    same dead zone.

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
        """Return the quantiser of the part of the picture that begins at this column and row."""
        return Quantiser(self.step, (self.first_px[0] - x_px, self.first_px[1] - y_px))

    def turned(self, quarters: int, width_px: int, height_px: int) -> "Quantiser":
        """Return the quantiser of the picture turned anticlockwise by `quarters` right angles.

        Width and height are those before the turn.
        """
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
