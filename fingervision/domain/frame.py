"""One picture of a recording, or the hole where one should be."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.status import Status

Pixels = NDArray[np.uint8] | NDArray[np.uint16]


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One picture with the source's own time.

    Parameters
    ----------
    pixels : ndarray of uint8 or uint16, shape (height, width) or (height, width, 3)
        Grey levels, or red, green and blue.
    index : int
        Place in the source, from 0.
    time_s : float or None
        Presentation time of the source; None where the source has no times.
    lossy : bool
        Whether a lossy codec stood between the sensor and these pixels: their errors are then correlated.
    """

    pixels: Pixels
    index: int
    time_s: float | None = None
    lossy: bool = False

    @property
    def height_px(self) -> int:
        """Number of rows."""
        return int(self.pixels.shape[0])

    @property
    def width_px(self) -> int:
        """Number of columns."""
        return int(self.pixels.shape[1])


@dataclass(frozen=True, slots=True)
class LostFrame:
    """A frame that the source announced and that cannot be measured.

    Parameters
    ----------
    index : int
        Place in the source, from 0.
    time_s : float or None
        Presentation time, where it is known.
    status : Status
        `Status.DAMAGED` or `Status.DUPLICATE`.
    words : str
        What happened, in a sentence.
    """

    index: int
    time_s: float | None
    status: Status
    words: str
