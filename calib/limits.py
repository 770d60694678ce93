"""Limits of the bench stated by the user: the range of each imperfection."""

from dataclasses import dataclass, fields
from math import radians, sqrt

from calib.errors import CalibrationError


@dataclass(frozen=True, slots=True)
class Limits:
    """Half-widths of the imperfections that no picture shows; the true value lies within +- the limit.

    A limit a stands for the standard uncertainty a / sqrt(3) of a rectangular distribution (JCGM 100:2008, 4.3.7). The
    defaults are those of an ordinary set-up: a camera at 100 mm distance, perpendicular, set up with care.

    Parameters
    ----------
    estimator_px : float
        Phase bias of the edge finder, each edge (pixels).
    edge_bias_px : float
        Edge bias by blooming and threshold, both edges together, if the references do not determine it (pixels).
    plane_mm : float
        Distance of the gripper from the plane of the reference.
    camera_distance_mm : float
        Distance of the camera's centre of projection (about the lens's front) from that plane; not a limit but a value.
    tilt_deg : float
        Tilt of the plane of the gripper against the picture's, about either axis.
    lens_relative : float
        Residual lens distortion, as a fraction of the radius at the corner of the picture.
    temperature_k : float
        Difference between the temperature of the reference and that of its certificate.
    expansion_per_k : float
        Thermal expansion of the reference (steel by default); not a limit but a value.
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
                "give the distance from the lens's front to the reference."
            )
        if self.tilt_deg >= 45.0:
            raise CalibrationError(
                f"tilt_deg must be below 45, but is {self.tilt_deg}: calibrate so oblique a view with a chessboard."
            )

    @property
    def tilt_rad(self) -> float:
        """`tilt_deg` in radians."""
        return radians(self.tilt_deg)


def rectangular(limit: float) -> float:
    """Return the standard uncertainty of a value known to lie within +- `limit` (JCGM 100:2008, 4.3.7)."""
    return limit / sqrt(3.0)
