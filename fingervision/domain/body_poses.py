"""Where the bodies of a mechanism were seen in a frame."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

OK, COVERED, OUT_OF_VIEW, NOT_FOUND, DAMAGED = "ok", "covered", "out_of_view", "not_found", "damaged"


@dataclass(frozen=True, slots=True, eq=False)
class SeenPose:
    """Where a body, or a hinge, was seen in a frame, in the drawing's axes.

    Parameters
    ----------
    status : str
        `ok`; `covered`: too little of its outline is seen; `out_of_view`; `not_found`: what was seen in its place is
        not joined to the bodies that its flexures join it to, so that something like it was taken for it; `damaged`:
        there is no picture.
    x_mm, y_mm, angle_mrad : float or None
        Counted from the drawing as it was laid on the first frame; a hinge has an angle alone.
    covariance : ndarray of float, shape (3, 3), or None
        Of x and y in mm and the angle in mrad: of the body's edges in this frame, of where the drawing was laid, and of
        the calibration (scale, edge bias, plane, tilt, lens); a scale that was merely stated has none.
    random : ndarray of float, shape (3, 3), or None
        The part of it that differs from frame to frame.
    """

    status: str
    x_mm: float | None = None
    y_mm: float | None = None
    angle_mrad: float | None = None
    covariance: NDArray[np.float64] | None = None
    random: NDArray[np.float64] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class FramePoses:
    """All bodies and hinges of one frame, by name."""

    frame: int
    time_s: float | None
    poses: Mapping[str, SeenPose]
