"""Conversion from the picture to the object plane at any point, with the uncertainty shared by all frames."""

from dataclasses import dataclass, field
from math import cos, hypot, pi, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from calib.limits import rectangular
from calib.measured_scale import Calibration
from fingervision.measuring.scale import Scale

Floats = NDArray[np.float64]

# The relative uncertainty is computed once for all points of a square of this side, and for all directions of a sector
# of this angle, from a length of this number of pixels. Within square and sector, perspective and lens change by much
# less than their uncertainty.
SQUARE_PX, SECTOR_RAD, BASELINE_PX = 32.0, pi / 12.0, 64.0


@dataclass(frozen=True, slots=True)
class PlaneScale:
    """A scale (px/mm) with the size of the frames for which it is valid.

    Parameters
    ----------
    scale : Scale
        Conversion from pixels to millimetres.
    frame_size_px : (int, int)
        Width and height.
    """

    scale: Scale
    frame_size_px: tuple[int, int]
    _known: dict[tuple[int, int, int], float] = field(default_factory=dict)

    @property
    def px_per_mm(self) -> float:
        """Pixels per millimetre."""
        return self.scale.px_per_mm

    @property
    def edge_bias_px(self) -> float:
        """Width (px) that a light gap between dark edges loses in the picture."""
        return self.scale.edge_bias_px

    @property
    def middle_px(self) -> tuple[float, float]:
        """Centre of the picture."""
        return 0.5 * (self.frame_size_px[0] - 1), 0.5 * (self.frame_size_px[1] - 1)

    def flatten(self, points_px: Floats) -> Floats:
        """Remove lens distortion and perspective from points, shape (n, 2)."""
        return self.scale.flatten(points_px) if isinstance(self.scale, Calibration) else points_px

    def relative_u(self, point_px: tuple[float, float], direction_rad: float) -> float:
        """Relative standard uncertainty of a length at a point, shared by all frames; 0 if it is unknown.

        The relative uncertainty of a length includes scale, plane, tilt, lens and temperature, but not the bias and
        phase error of edges.
        """
        if not isinstance(self.scale, Calibration):
            return 0.0
        sector = round((direction_rad % pi) / SECTOR_RAD)
        key = (round(point_px[0] / SQUARE_PX), round(point_px[1] / SQUARE_PX), sector)
        if key not in self._known:
            self._known[key] = self._relative(self.scale, key)
        return self._known[key]

    def _relative(self, scale: Calibration, key: tuple[int, int, int]) -> float:
        x, y, angle = key[0] * SQUARE_PX, key[1] * SQUARE_PX, key[2] * SECTOR_RAD
        step_x, step_y = 0.5 * BASELINE_PX * cos(angle), 0.5 * BASELINE_PX * sin(angle)
        ends = np.array([[[x - step_x, y - step_y], [x + step_x, y + step_y]]])
        budget = scale.budget(ends, np.zeros(1), np.ones(1, dtype=bool))
        length_mm = BASELINE_PX / scale.px_per_mm
        of_edges = {"estimator", "edge noise", *(part.source for part in scale.parts)}
        variance = sum(float(line.u_mm[0]) ** 2 for line in budget.lines if line.source not in of_edges)
        of_scale = sum(float(part.covariance[0, 0]) for part in scale.parts) / scale.px_per_mm**2
        return sqrt(variance / length_mm**2 + of_scale)

    def u_edge_px(self, u_response_px: float) -> float:
        """Standard uncertainty (px) of the position of one edge from errors that are the same in all frames.

        The contributions are half of the uncertainty of the edge bias, the sub-pixel phase, and the camera response.
        """
        if not isinstance(self.scale, Calibration):
            return 0.0
        return hypot(0.5 * self.scale.u_edge_bias_px, self.u_phase_px, u_response_px)

    @property
    def u_phase_px(self) -> float:
        """Standard uncertainty of an edge or registered patch due to the sub-pixel phase (`estimator_px`)."""
        return rectangular(self.scale.limits.estimator_px) if isinstance(self.scale, Calibration) else 0.0

    @property
    def u_angle_rad(self) -> float:
        """Standard uncertainty of an angle due to tilt and lens (rad): half of the relative distortion of the axes."""
        if not isinstance(self.scale, Calibration):
            return 0.0
        limits = self.scale.limits
        return 0.5 * hypot(rectangular(1.0 - cos(limits.tilt_rad)), rectangular(limits.lens_relative))
