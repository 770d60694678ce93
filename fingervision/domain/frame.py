"""One picture of a recording, or the placeholder for a picture that is missing."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.quantiser import Quantiser
from fingervision.domain.status import Status

Pixels = NDArray[np.uint8] | NDArray[np.uint16]


class Coding(StrEnum):
    """Compression between sensor and pixels, which tells which pixels share their errors.

    A lossy codec that treats every picture by itself (JPEG) leaves errors that are shared over a few pixels; one that
    predicts a picture from its neighbours (H.264) moves whole blocks.
    """

    LOSSLESS = "lossless"
    INTRAFRAME = "intraframe"
    INTERFRAME = "interframe"


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One picture with the time stamp that its source gave it.

    Parameters
    ----------
    pixels : ndarray of uint8 or uint16, shape (height, width) or (height, width, 3)
        Grey levels, or red, green and blue.
    index : int
        Place in the source, from 0.
    time_s : float or None
        Presentation time of the source; None where the source has no times.
    coding : Coding
        Whether a lossy codec stood between the sensor and these pixels: their errors are then correlated.
    hangs_on_others : bool
        Whether the picture is coded as a difference to others.
    quantiser : Quantiser or None
        How coarsely the codec has rounded it, where the stream says so.
    """

    pixels: Pixels
    index: int
    time_s: float | None = None
    coding: Coding = Coding.LOSSLESS
    hangs_on_others: bool = False
    quantiser: Quantiser | None = None

    @property
    def lossy(self) -> bool:
        """Whether the pixels differ from what the sensor saw."""
        return self.coding is not Coding.LOSSLESS

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
