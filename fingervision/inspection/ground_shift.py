"""Vibration of the camera, from registration of the background beyond the fingers' tips against the first frame.

The background is divided into two halves, which are registered separately. A motion of the camera shifts both halves
equally. A difference between the shifts of the two halves, caused by too little texture, gives the uncertainty of the
mean shift.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from skimage.registration import phase_cross_correlation

from fingervision.domain.direction import Direction
from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.vision.grey import to_grey
from fingervision.vision.orientation import Orientation

Floats = NDArray[np.float64]

# Distance (pixels) of the background strip from the higher tip, which excludes the blur of the tip's edge.
MARGIN_PX = 12
# Smallest number of rows of a strip that can be registered, and largest number that improves the result.
FEWEST_ROWS, MOST_ROWS = 24, 256
# The registration is refined to 1/50 pixel; more than 60 frames would not improve the result.
UPSAMPLED, MOST_FRAMES = 50, 60
# Structures coarser than this (pixels) are removed, because uneven light does not move with the background.
COARSE_PX = 8.0
# Largest standard uncertainty (pixels) from the difference between the two halves; above this limit, noise is
# registered instead of texture.
AGREE_PX = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class GroundShift:
    """Displacement of the background.

    Parameters
    ----------
    across_px, along_px : ndarray of float, shape (n,)
        Displacement of each frame relative to the first, across and along the fingers.
    u_px : float or None
        Standard uncertainty of each displacement; None if the background cannot be registered.
    """

    across_px: Floats
    along_px: Floats
    u_px: float | None


@dataclass(slots=True)
class GroundTracker:
    """Tracks the background from frame to frame."""

    _reference: list[Floats] | None = None
    _rows: int = 0
    _direction: Direction | None = None
    _found: list[Floats] = field(default_factory=list)

    def add(self, frame: Frame, outcome: GapMeasurement) -> None:
        """Add a frame in which the gap was measured to the tracking of the background."""
        if len(self._found) >= MOST_FRAMES or (self._direction not in (None, outcome.direction)):
            return
        grey = to_grey(frame.pixels)
        orientation = Orientation(outcome.direction, *grey.shape)
        upright = orientation.view(grey)
        tips = [edge.tip_px for edge in (outcome.left, outcome.right)]
        if orientation.is_flipped:
            tips = [orientation.along_size - 1 - tip for tip in tips]
        room = int(min(tips)) - MARGIN_PX
        if self._reference is None:
            # A second margin is left free, because the tips move.
            self._rows, self._direction = min(room - MARGIN_PX, MOST_ROWS), outcome.direction
            if self._rows >= FEWEST_ROWS:
                self._reference = self._halves(upright[:room])
            return
        if room >= self._rows:
            halves = self._halves(upright[: self._rows])
            # A half that is completely clipped to black or white has no texture.
            if all(half.any() for half in (*self._reference, *halves)):
                self._register(halves)

    def shift(self) -> GroundShift:
        """Return the displacement of the background (px) in the frames that were added."""
        if len(self._found) < 2:
            return GroundShift(np.zeros(0), np.zeros(0), None)
        both = np.array(self._found)
        # The uncertainty is at least half a step of the refinement; otherwise, dirt on the sensor, whose shift is
        # exactly zero, would be registered with no uncertainty.
        apart = max(float(np.std(both[:, 0] - both[:, 1])) / 2.0, 0.5 / UPSAMPLED)
        middle = np.vstack([np.zeros((1, 2)), both.mean(axis=1)])
        return GroundShift(middle[:, 1], middle[:, 0], apart if apart < AGREE_PX else None)

    def _halves(self, strip: NDArray[np.uint8] | NDArray[np.uint16]) -> list[Floats]:
        strip = strip[: self._rows]
        middle = strip.shape[1] // 2
        return [_detail(part.astype(np.float32)) for part in (strip[:, :middle], strip[:, middle:])]

    def _register(self, halves: list[Floats]) -> None:
        assert self._reference is not None  # noqa: S101 - made from the first frame
        self._found.append(
            np.array([-_registered(first, now) for first, now in zip(self._reference, halves, strict=True)])
        )


def _registered(first: Floats, now: Floats) -> Floats:
    """Shift (rows, columns; px) of the largest cross-correlation, refined by a Fourier transform about its peak [1]_.

    References
    ----------
    .. [1] Guizar-Sicairos, Thurman and Fienup, 2008, Efficient subpixel image registration algorithms, Optics Letters
       33(2), 156-158, doi:10.1364/OL.33.000156.
    """
    register: Callable[..., Any] = phase_cross_correlation  # the library states no types
    return np.asarray(register(first, now, upsample_factor=UPSAMPLED, normalization=None)[0], dtype=np.float64)


def _detail(levels: NDArray[np.float32]) -> Floats:
    """Texture of a piece of background, tapered to zero at its border."""
    fine = cv2.GaussianBlur(levels, (0, 0), 1.0) - cv2.GaussianBlur(levels, (0, 0), COARSE_PX)
    window = np.hanning(levels.shape[0])[:, None] * np.hanning(levels.shape[1])
    return np.asarray(fine * window, dtype=np.float64)
