"""A scale measured on a reference object: the same interface as `calib.calibration.BareScale`, with uncertainty."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from calib.budget import Budget, distance_budget
from calib.camera_response import CameraResponse
from calib.errors import CalibrationError
from calib.limits import Limits
from calib.picture_shift import centre_px
from calib.projection import Lens, Plane
from calib.short_repr import ShortRepr


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Distances(ShortRepr):
    """Distances between pairs of points of a flat scene.

    Parameters
    ----------
    value_mm : ndarray of float, shape (n,)
        The distances.
    u_mm : ndarray of float, shape (n,), or None
        Standard uncertainties that include the scale's whole budget; None if the scale has no stated uncertainty.
    u_random_mm : ndarray of float, shape (n,)
        Random standard uncertainties, due to effects that vary from frame to frame.

    Examples
    --------
    >>> import numpy as np, calib
    >>> scale = calib.StatedScale(34.0, 0.1).for_frames((640, 480))
    >>> ends_px = np.array([[[100.0, 150.0], [300.0, 150.0]]])
    >>> found = scale.distances(ends_px, np.array([0.02]), np.array([True]))
    >>> print(f"{found.value_mm[0]:.3f} mm, u = {found.u_mm[0]:.3f} mm")
    5.882 mm, u = 0.028 mm
    """

    value_mm: NDArray[np.float64]
    u_mm: NDArray[np.float64] | None
    u_random_mm: NDArray[np.float64]


Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Reference:
    """One object whose size is known.

    Parameters
    ----------
    what : str
        Kind of object (bar, slot, chessboard or ChArUco board), and the picture's name.
    size_mm, u_size_mm : float
        Certified size and its standard uncertainty.
    certificate, date : str
        Name and date of the certificate; empty if not stated.
    """

    what: str
    size_mm: float
    u_size_mm: float
    certificate: str = ""
    date: str = ""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ScalePart(ShortRepr):
    """Contribution of one cause to the covariance of scale and edge bias.

    Parameters
    ----------
    source : str
        Name of the cause.
    covariance : ndarray, shape (2, 2)
        Covariance of (px_per_mm, edge_bias_px) from this cause alone.
    supplied : str
        Origin of the value.
    """

    source: str
    covariance: Floats
    supplied: str = ""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Response(ShortRepr):
    """Derivatives of the fitted (px_per_mm, edge_bias_px) by lens distortion and tilt during the calibration.

    Parameters
    ----------
    lens : ndarray, shape (2,)
        Derivatives per unit of `calib.picture_shift.lens_shift_px`.
    tilt : ndarray, shape (2, 2)
        Derivatives per radian about each axis; the first index is the axis.
    """

    lens: Floats = field(default_factory=lambda: np.zeros(2))
    tilt: Floats = field(default_factory=lambda: np.zeros((2, 2)))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Calibration(ShortRepr):
    """Conversion of a flat scene from pixels to millimetres, with uncertainty.

    For a light gap, gap_mm = (gap_px + b) / s.

    Parameters
    ----------
    px_per_mm : float
        Scale s.
    edge_bias_px : float
        Edge bias b of a light gap between dark edges; the sign reverses for a dark gap.
    parts : tuple of ScalePart
        Contributions of the causes to the covariance of (s, b).
    frame_size_px : tuple of int
        Width and height of the pictures for which the calibration is valid.
    limits : Limits
        Limits of the set-up's imperfections.
    stated : frozenset of str
        Names of the limits stated by the user; the others are defaults.
    response : Response
        Derivatives of scale and edge bias by lens distortion and tilt.
    lens : Lens or None
        Lens distortion to be corrected.
    plane : Plane or None
        Perspective to be corrected.
    references : tuple of Reference
        Reference objects of the calibration.
    camera : mapping of str to str
        Settings of the camera, if known.
    made_at, software : str
        Time (ISO 8601) and software of the calibration.
    camera_response : CameraResponse or None
        Camera response assumed for the calibration's pictures; None if not stated.
    response_known : bool
        Whether that response was stated or measured, rather than assumed.
    response_shift_px : float or None
        Width of a light gap between the calibration's edges minus its width under the other standard response; None if
        not stated.

    Examples
    --------
    >>> import calib
    >>> scale = calib.StatedScale(34.0, 0.1).for_frames((640, 480))
    >>> print(f"{scale.px_per_mm:g} px/mm, u = {scale.u_px_per_mm:.1f} px/mm")
    34 px/mm, u = 0.1 px/mm
    """

    px_per_mm: float
    edge_bias_px: float
    parts: tuple[ScalePart, ...]
    frame_size_px: tuple[int, int]
    limits: Limits = field(default_factory=Limits)
    stated: frozenset[str] = frozenset()
    response: Response = field(default_factory=Response)
    lens: Lens | None = None
    plane: Plane | None = None
    references: tuple[Reference, ...] = ()
    camera: Mapping[str, str] = field(default_factory=dict)
    made_at: str = ""
    software: str = ""
    camera_response: CameraResponse | None = None
    response_known: bool = False
    response_shift_px: float | None = None

    def __post_init__(self) -> None:
        """Refuse an impossible calibration."""
        if not 0.0 < self.px_per_mm < float("inf"):
            raise CalibrationError(f"px_per_mm must be positive, but is {self.px_per_mm}.")
        if not np.isfinite(self.edge_bias_px):
            raise CalibrationError(f"edge_bias_px must be a number, but is {self.edge_bias_px}.")
        if min(self.frame_size_px) < 1:
            raise CalibrationError(f"The frame size must be positive, but is {self.frame_size_px}.")

    @property
    def covariance(self) -> Floats:
        """Covariance of (px_per_mm, edge_bias_px), shape (2, 2): the sum over independent causes."""
        return np.asarray(np.sum([part.covariance for part in self.parts] or [np.zeros((2, 2))], axis=0))

    @property
    def u_px_per_mm(self) -> float:
        """Standard uncertainty of the scale.

        The standard uncertainty of the scale does not include plane, tilt and lens, which are part of a distance's
        budget.
        """
        return sqrt(float(self.covariance[0, 0]))

    @property
    def u_edge_bias_px(self) -> float:
        """Standard uncertainty of the edge bias."""
        return sqrt(float(self.covariance[1, 1]))

    @property
    def states_no_limits(self) -> bool:
        """Whether the calibration has no limit of distance, tilt, lens and temperature: a file of another program."""
        limits = (self.limits.plane_mm, self.limits.tilt_deg, self.limits.lens_relative, self.limits.temperature_k)
        return not self.stated and not any(limits)

    def how_stated(self, name: str, unit: str) -> str:
        """Limit `name` in words; a note says whether the user stated it, or whether another program's file lacks it."""
        if name not in self.stated and getattr(self.limits, name) == 0.0:
            return f"0 {unit} (not in the calibration file)"
        return f"+-{getattr(self.limits, name):g} {unit} ({'stated' if name in self.stated else 'default'})"

    def flatten(self, points_px: Floats) -> Floats:
        """Remove lens distortion and perspective from measured points, shape (..., 2); pictures are never resampled."""
        return self.flatten_by(self.lens, points_px)

    def flatten_by(self, lens: Lens | None, points_px: Floats) -> Floats:
        """Remove another lens's distortion, and this calibration's perspective, from points, as `flatten` does."""
        flat = np.asarray(points_px, dtype=np.float64)
        if lens is not None:
            flat = lens.undistort(flat)
        return flat if self.plane is None else self.plane.flatten(flat)

    def unflatten(self, points_px: Floats) -> Floats:
        """Apply lens distortion and perspective to points of the undistorted plane, shape (..., 2).

        The function `unflatten` is the inverse of `flatten`.
        """
        seen = np.asarray(points_px, dtype=np.float64)
        if self.plane is not None:
            seen = self.plane.unflatten(seen)
        return seen if self.lens is None else self.lens.distort(seen)

    def budget(
        self, points_px: Floats, u_random_px: Floats, light_gap: NDArray[np.bool_], shares: Floats | None = None
    ) -> Budget:
        """Uncertainty budget of each distance; the arguments are those of `distances`."""
        return self._measured(points_px, u_random_px, light_gap, shares)[1]

    def distances(
        self, points_px: Floats, u_random_px: Floats, light_gap: NDArray[np.bool_], shares: Floats | None = None
    ) -> Distances:
        """Distances between pairs of points.

        Parameters
        ----------
        points_px : ndarray, shape (n, 2, 2)
            Coordinates measured in the picture, with the indices: distance, first or second point, x or y.
        u_random_px : ndarray, shape (n,)
            Standard uncertainty of each distance due to effects that vary from frame to frame.
        light_gap : ndarray of bool, shape (n,)
            True for a light gap between dark edges.
        shares : ndarray, shape (n, 2), optional
            Displacement of the first and the second point across the gap, as a share of the displacement of an outline
            along its normal; 1, the default, for straight parallel edges.

        Returns
        -------
        Distances
            Values, standard uncertainties with the full budget, and random standard uncertainties; millimetres.
        """
        value_mm, budget = self._measured(points_px, u_random_px, light_gap, shares)
        return Distances(value_mm=value_mm, u_mm=budget.u_mm, u_random_mm=budget.u_random_mm)

    def positions_mm(
        self,
        points_px: Floats,
        axis: int,
        light_gap: NDArray[np.bool_],
        frame_size_px: tuple[int, int],
        shares: Floats | None = None,
    ) -> Floats:
        """Coordinates of both points of each distance along an axis of the picture, from the picture's centre (mm).

        Half of the edge bias is applied to each edge, so that the difference is the distance's component along the
        axis.

        Parameters
        ----------
        points_px, light_gap, shares
            As for `distances`.
        axis : int
            0 for x (to the right), 1 for y (downwards).
        frame_size_px : tuple of int
            Width and height of the frames.

        Returns
        -------
        ndarray, shape (n, 2)
            Coordinates in millimetres.
        """
        flat = self.flatten(points_px)
        apart = flat[:, 1] - flat[:, 0]
        length = np.linalg.norm(apart, axis=1)
        along = np.divide(apart[:, axis], length, out=np.ones_like(length), where=length > 0.0)
        half_px = np.where(light_gap, 0.5, -0.5) * self.edge_bias_px * along
        outward_px = np.stack([-half_px, half_px], axis=1) * (1.0 if shares is None else shares)
        return np.asarray((flat[:, :, axis] - centre_px(frame_size_px)[axis] + outward_px) / self.px_per_mm)

    def check_frame_size(self, width_px: int, height_px: int) -> None:
        """Refuse frames of another size, because another camera, binning or crop has another scale."""
        if (width_px, height_px) != self.frame_size_px:
            width, height = self.frame_size_px
            raise CalibrationError(
                f"The calibration was made on frames of {width}x{height} pixels, but these are {width_px}x{height_px}: "
                "calibrate again with the present settings of the camera."
            )

    def check_camera(self, settings: Mapping[str, str]) -> None:
        """Refuse a camera with settings that differ from the calibration's (where both are known)."""
        for name, value in settings.items():
            known = self.camera.get(name)
            if known is not None and known != value:
                raise CalibrationError(
                    f"The calibration was made with the camera's {name} = {known}, but now {name} is {value}: restore "
                    "this setting, or calibrate again."
                )

    def _measured(
        self, points_px: Floats, u_random_px: Floats, light_gap: NDArray[np.bool_], shares: Floats | None
    ) -> tuple[Floats, Budget]:
        points = np.asarray(points_px, dtype=np.float64)
        flat = self.flatten(points)
        flat_gap_px = np.linalg.norm(flat[:, 1] - flat[:, 0], axis=1)
        gap_px = np.linalg.norm(points[:, 1] - points[:, 0], axis=1)
        magnified = np.divide(flat_gap_px, gap_px, out=np.ones_like(gap_px), where=gap_px > 0.0)
        polarity = np.where(light_gap, 1.0, -1.0) * (1.0 if shares is None else np.mean(shares, axis=1))
        value_mm = (flat_gap_px + polarity * self.edge_bias_px) / self.px_per_mm
        budget = distance_budget(
            self, points, flat, value_mm, magnified * np.asarray(u_random_px, dtype=np.float64), polarity
        )
        return value_mm, budget
