"""One video frame, or the placeholder for a frame that is missing."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.quantiser import Quantiser
from fingervision.domain.status import Status

Pixels = NDArray[np.uint8] | NDArray[np.uint16]


class Coding(StrEnum):
    """Kind of compression between sensor and pixels, which determines the pixels whose errors are correlated.

    A lossy codec that codes every picture independently (JPEG) causes errors that are correlated over a few pixels; a
    codec that predicts a picture from neighbouring pictures (H.264) displaces whole blocks.

    Examples
    --------
    >>> import fingervision as fv
    >>> fv.Coding("intraframe")
    <Coding.INTRAFRAME: 'intraframe'>
    """

    LOSSLESS = "lossless"
    INTRAFRAME = "intraframe"
    INTERFRAME = "interframe"


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One video frame: its picture, with the time stamp from its source.

    Parameters
    ----------
    pixels : ndarray of uint8 or uint16, shape (height, width) or (height, width, 3)
        Grey levels, or red, green and blue.
    index : int
        Number of the frame in the source, from 0.
    time_s : float or None
        Presentation time from the source, in s; None if the source has no times.
    coding : Coding
        Compression between the sensor and these pixels; after a lossy codec, the errors of pixels are correlated.
    hangs_on_others : bool
        Whether the picture is coded as a difference from other pictures.
    quantiser : Quantiser or None
        Quantiser steps of the codec for this picture; None if the stream does not state them.

    Examples
    --------
    >>> import numpy as np, fingervision as fv
    >>> frame = fv.Frame(np.zeros((240, 320), np.uint8), index=0, time_s=0.0)
    >>> frame.lossy
    False
    """

    pixels: Pixels
    index: int
    time_s: float | None = None
    coding: Coding = Coding.LOSSLESS
    hangs_on_others: bool = False
    quantiser: Quantiser | None = None

    @property
    def lossy(self) -> bool:
        """Whether a lossy codec has changed the pixels from the sensor's values."""
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
    """A video frame that the source announced and that cannot be measured.

    Parameters
    ----------
    index : int
        Number of the frame in the source, from 0.
    time_s : float or None
        Presentation time in s; None if unknown.
    status : Status
        `Status.DAMAGED` or `Status.DUPLICATE`.
    words : str
        Sentence that states what happened to the frame.

    Examples
    --------
    >>> import fingervision as fv
    >>> fv.LostFrame(3, 0.12, fv.Status.DAMAGED, "The camera lost it.").status
    <Status.DAMAGED: 'damaged'>
    """

    index: int
    time_s: float | None
    status: Status
    words: str


# Rectangular region of a video frame.


@dataclass(frozen=True, slots=True)
class Region:
    """Region of interest in whole pixels of the full frame.

    Parameters
    ----------
    x_px, y_px : int
        First column and row.
    width_px, height_px : int
        Number of columns and rows.
    """

    x_px: int
    y_px: int
    width_px: int
    height_px: int
