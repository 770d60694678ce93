"""Quantiser steps of a video codec over the picture."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# Side of a block in pixels for which codecs state a quantiser step.
BLOCK_PX = 16


@dataclass(frozen=True, slots=True, eq=False)
class Quantiser:
    """Quantiser steps of a codec, to multiples of which the coefficients of its cosine transform are rounded.

    A picture's encoder does not transmit changes that are smaller than a fraction of a step (the dead zone), so that an
    edge may be displaced by a corresponding amount. The steps of other codecs, whose dead zone is another fraction, are
    stated as the H.264 steps with the same dead zone.

    Parameters
    ----------
    step : ndarray of float32, shape (rows, columns)
        Step of every block of 16 x 16 pixels, in 8-bit grey levels, for a transform of unit gain.
    first_px : (int, int)
        Column and row of the picture at which the first block begins.
    """

    step: NDArray[np.float32]
    first_px: tuple[int, int] = (0, 0)

    def near(self, x_px: float, y_px: float, across_px: float, along_px: float) -> float:
        """Largest step in a rectangle centred at a point, with half sides `across_px` and `along_px`."""
        rows, columns = self.step.shape
        x0_px, y0_px = self.first_px
        left, right = self._block(x_px - across_px - x0_px, columns), self._block(x_px + across_px - x0_px, columns)
        top, bottom = self._block(y_px - along_px - y0_px, rows), self._block(y_px + along_px - y0_px, rows)
        return float(self.step[top : bottom + 1, left : right + 1].max())

    def at(self, x_px: NDArray[np.float64], y_px: NDArray[np.float64]) -> float:
        """Largest step of the blocks in which any of the given points lies."""
        rows, columns = self.step.shape
        x, y = ((p - first + 0.5) // BLOCK_PX for p, first in zip((x_px, y_px), self.first_px, strict=True))
        return float(self.step[np.clip(y, 0, rows - 1).astype(int), np.clip(x, 0, columns - 1).astype(int)].max())

    def seen_from(self, x_px: int, y_px: int) -> "Quantiser":
        """Return the quantiser steps of the part of the picture that begins at this column and row."""
        return Quantiser(self.step, (self.first_px[0] - x_px, self.first_px[1] - y_px))

    def turned(self, quarters: int, width_px: int, height_px: int) -> "Quantiser":
        """Return the quantiser steps for the picture rotated anticlockwise by `quarters` right angles.

        Width and height are those of the picture before the rotation.
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
