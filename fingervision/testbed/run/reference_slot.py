"""Measure a reference slot of known width in place of the gripper, to check the scale."""

from collections.abc import Sequence
from math import sqrt

import numpy as np

from calib.errors import CalibrationError
from calib.known_widths import KnownSize, find_widths
from fingervision.domain.errors import DeviceError
from fingervision.domain.frame import Frame
from fingervision.measuring.scale import Scale
from fingervision.vision.grey import to_grey


def measured_slot(frames: Sequence[Frame], size_mm: float, scale: Scale) -> dict[str, float]:
    """Measure a slot in every frame.

    Parameters
    ----------
    frames : sequence of Frame
        Frames of the slot at rest.
    size_mm : float
        Known width of the slot.
    scale : Scale
        Scale of the test bed's camera.

    Returns
    -------
    dict
        `measured_mm` (mean over the frames), `u_random_mm` (its standard uncertainty), `ratio` (measured over known
        width).

    Raises
    ------
    DeviceError
        No slot is visible.
    """
    pictures = [KnownSize(f"frame {frame.index}", "slot", size_mm, 0.0, to_grey(frame.pixels)) for frame in frames]
    try:
        widths = [find_widths([picture], px_per_mm=scale.px_per_mm)[0] for picture in pictures]
    except CalibrationError as error:
        raise DeviceError(
            f"The reference slot of {size_mm:g} mm must be visible, but was not measured: {error}"
        ) from error
    if not widths:
        raise DeviceError(f"The reference slot of {size_mm:g} mm must be visible, but the camera gave no frame.")
    points = np.array([width.points_px for width in widths])
    u_px = np.array([width.u_width_px for width in widths])
    found = scale.distances(points, u_px, np.array([width.light for width in widths]))
    mean_mm = float(np.mean(found.value_mm))
    # The uncertainty of the mean follows from the scatter of the frames, or from the scatter of the rows within a
    # frame, whichever is larger.
    scatter_mm = float(np.std(found.value_mm, ddof=1)) / sqrt(len(widths)) if len(widths) > 1 else 0.0
    u_mm = max(scatter_mm, float(np.mean(found.u_random_mm)) / sqrt(len(widths)))
    return {"measured_mm": mean_mm, "u_random_mm": u_mm, "ratio": mean_mm / size_mm}
