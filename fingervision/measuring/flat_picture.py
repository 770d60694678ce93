"""Lens and plane of a calibration as a map between the picture and the plane without perspective and distortion."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calib.measured_scale import Calibration
from fingervision.measuring.scale import Scale
from fingervision.vision.outline_chunks import FlatMap

Array = NDArray[np.float64]

FOLDED_PX = 0.5
"""Largest error of mapping a point forth and back; with a larger error, the lens's distortion polynomial is not
invertible at this point, which then cannot appear in a picture.
"""
NOWHERE_PX = -1e6


@dataclass(frozen=True, slots=True, eq=False)
class FlatPicture:
    """Converts pixels of the picture to pixels of the plane without perspective and distortion, and back.

    Parameters
    ----------
    calibration : Calibration
        Calibration that includes a lens, a plane or both.
    """

    calibration: Calibration

    def to_flat(self, points: Array) -> Array:
        """Remove lens distortion and perspective from points, shape (2, n)."""
        return self.calibration.flatten(points.T).T

    def to_picture(self, points: Array) -> Array:
        """Apply lens distortion and perspective; points that the lens cannot image are mapped far outside."""
        seen = self.calibration.unflatten(points.T).T
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            apart = np.hypot(*(self.to_flat(seen) - points))
        return np.where(apart < FOLDED_PX, seen, NOWHERE_PX)


def flat_map_of(scale: Scale) -> FlatMap | None:
    """Return the map of a calibration; None where the picture needs no correction."""
    if isinstance(scale, Calibration) and (scale.lens is not None or scale.plane is not None):
        return FlatPicture(scale)
    return None
