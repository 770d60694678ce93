"""Limits of the set-up's imperfections, as stated by the user."""

from dataclasses import dataclass, fields
from math import radians, sqrt

from calib.errors import CalibrationError


@dataclass(frozen=True, slots=True)
class Limits:
    """Half-widths of imperfections that no picture shows: each true value lies within +- the limit.

    A limit a corresponds to the standard uncertainty a / sqrt(3) of a rectangular distribution (JCGM 100:2008, 4.3.7).
    The defaults are those of an ordinary laboratory set-up: a camera at 100 mm distance, perpendicular to the scene,
    set up with care.

    Parameters
    ----------
    estimator_px : float
        Phase error of the edge fit, for each edge (pixels).
    edge_bias_px : float
        Edge bias of both edges together (blooming and threshold), if the references do not determine it (pixels): 0.3
        px per edge.
    plane_mm : float
        Distance of the gripper from the plane of the reference.
    camera_distance_mm : float
        Distance of the camera's centre of projection (near the front of the lens) from the plane of the reference; a
        value, not a limit.
    tilt_deg : float
        Tilt of the gripper's plane relative to the picture's plane, about either axis.
    lens_relative : float
        Distortion that is not corrected by a lens calibration, as a share of the radius at the picture's corner.
    temperature_k : float
        Difference between the temperature of the reference's certificate and that during the calibration.
    expansion_per_k : float
        Thermal expansion coefficient of the reference (steel by default); a value, not a limit.
    """

    estimator_px: float = 0.02
    edge_bias_px: float = 0.6
    plane_mm: float = 0.5
    camera_distance_mm: float = 100.0
    tilt_deg: float = 2.0
    lens_relative: float = 0.001
    temperature_k: float = 2.0
    expansion_per_k: float = 11.5e-6

    def __post_init__(self) -> None:
        """Refuse an impossible limit."""
        for field in fields(self):
            value = getattr(self, field.name)
            if not (isinstance(value, int | float) and 0.0 <= value < float("inf")):
                raise CalibrationError(f"The limit {field.name} must be a number of zero or more, but is {value!r}.")
        if self.camera_distance_mm <= 0.0:
            raise CalibrationError(
                f"camera_distance_mm must be positive, but is {self.camera_distance_mm}: "
                "give the distance from the front of the lens to the reference."
            )
        if self.tilt_deg >= 45.0:
            raise CalibrationError(
                f"tilt_deg must be below 45, but is {self.tilt_deg}: calibrate an oblique view with a chessboard."
            )

    @property
    def tilt_rad(self) -> float:
        """`tilt_deg` in radians."""
        return radians(self.tilt_deg)


def rectangular(limit: float) -> float:
    """Return the standard uncertainty of a value known to lie within +- `limit` (JCGM 100:2008, 4.3.7)."""
    return limit / sqrt(3.0)
