"""The scale that a measurement uses: a bare number of pixels per millimetre, or a calibration."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from calib.distances import Distances
from fingervision.domain.errors import UsageError

# From a picture of a street to one through a microscope; what lies beyond is a slip, and overflows later.
LEAST_PX_PER_MM, MOST_PX_PER_MM = 1e-3, 1e6

Floats = NDArray[np.float64]


def check_px_per_mm(px_per_mm: float) -> None:
    """Refuse a stated scale outside the range of real cameras.

    Raises
    ------
    UsageError
        The scale lies outside the bounds.
    """
    if not LEAST_PX_PER_MM <= px_per_mm <= MOST_PX_PER_MM:
        raise UsageError(
            f"--px-per-mm must be between {LEAST_PX_PER_MM:g} and {MOST_PX_PER_MM:g}, but is {px_per_mm:g}: state how "
            "many pixels of the picture show one millimetre."
        )


class Scale(Protocol):
    """Conversion from pixels to millimetres; see `calib.calibration.BareScale` for shapes and units."""

    @property
    def px_per_mm(self) -> float:
        """Pixels per millimetre."""
        ...

    @property
    def edge_bias_px(self) -> float:
        """Edge bias b of the calibration (px): loss of width of a light gap between straight dark edges."""
        ...

    def distances(self, points_px: Floats, u_random_px: Floats, light_gap: NDArray[np.bool_]) -> Distances:
        """Distances between pairs of points."""
        ...

    def positions_mm(
        self, points_px: Floats, axis: int, light_gap: NDArray[np.bool_], frame_size_px: tuple[int, int]
    ) -> Floats:
        """Coordinates (mm) along an axis, from the picture's centre, of the two points of each distance."""
        ...

    def check_frame_size(self, width_px: int, height_px: int) -> None:
        """Refuse frames of another size than those of the calibration."""
        ...
