"""What a codec has done to a picture, as its stream or the picture's own noise states it, and what it costs the gap."""

from dataclasses import dataclass, replace
from math import hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.frame import Coding, Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.domain.quantiser import Quantiser
from fingervision.vision.coding_error import (
    EVEN_SHIFTS,
    SHARED_SHIFTS,
    flanks_displaced_px,
    outline_step,
    step_from_noise,
    with_coding_error,
    with_shared_shift,
)
from fingervision.vision.edges import EdgePoints
from fingervision.vision.grey import GreyImage
from fingervision.vision.orientation import Orientation
from fingervision.vision.settings import Settings
from fingervision.vision.shared_profile import even_shift_px, flanks, shared_shift_px
from fingervision.vision.uneven_noise import uneven_noise

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class CodedPicture:
    """Effects of a codec on the measured region of a picture.

    Parameters
    ----------
    coding : Coding
        Coding of the picture, as its source states it; lossless if the quantiser is known, because the codec's
        contribution then follows from the quantiser instead of the kind of codec.
    quantiser : Quantiser or None
        Quantiser steps, if the stream states them.
    noise_left : float
        Noise that an unknown earlier codec has left (stored levels); 0 if no trace of a codec was found.
    """

    coding: Coding
    quantiser: Quantiser | None = None
    noise_left: float = 0.0

    def with_traces(self, grey: GreyImage) -> "CodedPicture":
        """Return the same, with the noise that an earlier codec has left, if the source states no codec."""
        if self.coding is not Coding.LOSSLESS or self.quantiser is not None:
            return self
        return replace(self, noise_left=uneven_noise(grey))

    def flanks_displaced_px(
        self, upright: GreyImage, edges: EdgePoints, orientation: Orientation, light: Floats, top_level: int
    ) -> tuple[float, float]:
        """Standard uncertainty (px) of both inner flanks' positions from codec errors that all of their rows share."""
        step = self._step(edges, orientation, light, top_level)
        if step is not None:
            return flanks_displaced_px(edges, step, light, top_level)
        if self.coding is Coding.LOSSLESS:
            return 0.0, 0.0
        alike_px = SHARED_SHIFTS[self.coding] * shared_shift_px(flanks(upright, edges, light))
        return alike_px, alike_px

    def less_sure(
        self,
        found: GapMeasurement,
        upright: GreyImage,
        edges: EdgePoints,
        orientation: Orientation,
        light: Floats,
        top_level: int,
    ) -> GapMeasurement:
        """Return the measurement with its uncertainty increased by possible errors of the codec.

        Parameters
        ----------
        found : GapMeasurement
            The measurement in the picture's pixels.
        upright : ndarray, shape (rows, columns)
            Grey levels of the picture, turned so that the tips point up.
        edges : EdgePoints
            Steps that were fitted to every line.
        orientation : Orientation
            Transformation from the fingers' axes to the picture.
        light : ndarray of float, shape (levels,)
            Light for every stored level (look-up table).
        top_level : int
            Highest level of the scale.
        """
        step = self._step(edges, orientation, light, top_level)
        if step is not None:
            found = with_coding_error(found, step, edges.inside, light, top_level)
        if self.quantiser is not None:
            return found
        if self.coding is not Coding.LOSSLESS:
            return with_shared_shift(found, shared_shift_px(flanks(upright, edges, light)), self.coding)
        if edges.beside:  # a structure beside an edge has its own contribution
            return found
        u_alike = sqrt(2.0) * EVEN_SHIFTS * even_shift_px(flanks(upright, edges, light))
        return replace(found, u_shift_px=hypot(found.u_shift_px, u_alike))

    def _step(self, edges: EdgePoints, orientation: Orientation, light: Floats, top_level: int) -> float | None:
        """Quantiser step along the outlines (8-bit grey levels), stated or estimated; None if neither is known."""
        if self.quantiser is not None:
            return outline_step(edges, orientation, self.quantiser)
        return step_from_noise(edges, self.noise_left, light, top_level) if self.noise_left else None


def coded_picture(frame: Frame, settings: Settings) -> CodedPicture:
    """Effects of a codec on the measured region of a frame, as its source states them."""
    quantiser, region = frame.quantiser, settings.region
    if quantiser is not None and region is not None:
        quantiser = quantiser.seen_from(region.x_px, region.y_px)
    return CodedPicture(frame.coding if quantiser is None else Coding.LOSSLESS, quantiser)
