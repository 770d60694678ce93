"""Measured poses of a mechanism's bodies in a video frame, and its flexures at rest."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

OK, COVERED, OUT_OF_VIEW, NOT_FOUND, DAMAGED = "ok", "covered", "out_of_view", "not_found", "damaged"


@dataclass(frozen=True, slots=True, eq=False)
class SeenPose:
    """Measured pose of a body, or angle of a hinge, in a video frame, in the axes of the drawing.

    Parameters
    ----------
    status : str
        `ok`; `covered`: too little of the body's outline is visible; `out_of_view`; `not_found`: the shape that was
        found is not at the end of the body's flexures, so that it must be a similar but different object; `damaged`:
        the picture of the frame cannot be used.
    x_mm, y_mm, angle_mrad : float or None
        Displacement and rotation relative to the drawing as it was aligned with the first video frame; a hinge has only
        an angle.
    covariance : ndarray of float, shape (3, 3), or None
        Covariance of x and y in mm and the angle in mrad. It contains the uncertainty of the body's edges in this
        frame, of the alignment of the drawing, and of the calibration (scale, edge bias, plane, tilt, lens); a scale
        that was stated without an uncertainty contributes nothing.
    random : ndarray of float, shape (3, 3), or None
        The random part of the covariance, which differs from frame to frame.
    motion : ndarray of float, shape (3, 3), or None
        Covariance of the difference between this pose and the first one of the same body: without the errors that
        displace both alike, such as those of the drawing's placement.
    """

    status: str
    x_mm: float | None = None
    y_mm: float | None = None
    angle_mrad: float | None = None
    covariance: NDArray[np.float64] | None = None
    random: NDArray[np.float64] | None = None
    motion: NDArray[np.float64] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class FramePoses:
    """Measured poses of all bodies and hinges in one video frame, by name."""

    frame: int
    time_s: float | None
    poses: Mapping[str, SeenPose]


# Measured thickness and place of a flexure at rest.


@dataclass(frozen=True, slots=True)
class FlexureOutline:
    """Thickness and place of one flexure in the still frames of a recording, each with its standard uncertainty.

    Parameters
    ----------
    flexure : str
        Name of the flexure in the drawing.
    frames : int
        Number of still frames.
    thickness_mm : (float, float)
        Least height.
    along_mm : (float, float) or None
        Distance from the drawn place along the flexure's axis; None for a flexure of constant height.
    across_mm : (float, float)
        Distance from the drawn place across the axis.
    """

    flexure: str
    frames: int
    thickness_mm: tuple[float, float]
    along_mm: tuple[float, float] | None
    across_mm: tuple[float, float]
