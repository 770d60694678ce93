"""Protocol of a conversion of pixels to millimetres, and a scale that the user states without uncertainty."""

from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from calib.limits import Limits, rectangular
from calib.measured_scale import Calibration, Distances, ScalePart

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class BareScale:
    """A scale stated by the user, without uncertainty.

    Parameters
    ----------
    px_per_mm : float
        Pixels per millimetre; positive.

    Raises
    ------
    ValueError
        If the scale is not positive.

    Examples
    --------
    >>> import calib
    >>> calib.BareScale(34.0)
    BareScale(px_per_mm=34.0)
    """

    px_per_mm: float

    def __post_init__(self) -> None:
        """Refuse an impossible scale."""
        if not (isfinite(self.px_per_mm) and self.px_per_mm > 0.0):
            raise ValueError(f"px_per_mm must be positive, but is {self.px_per_mm}.")

    @property
    def edge_bias_px(self) -> float:
        """Zero, because the edge bias is not known."""
        return 0.0

    def distances(
        self, points_px: Floats, u_random_px: Floats, light_gap: NDArray[np.bool_], shares: Floats | None = None
    ) -> Distances:
        """Distances between pairs of points, without the (unknown) uncertainty of the scale.

        Parameters
        ----------
        points_px : ndarray, shape (n, 2, 2)
            Coordinates, with the indices: distance, first or second point, x or y.
        u_random_px : ndarray, shape (n,)
            Standard uncertainty of each distance due to effects that vary from frame to frame.
        light_gap : ndarray of bool, shape (n,)
            True for a light gap between dark edges; without an edge bias it makes no difference.
        shares : ndarray, shape (n, 2), optional
            Share of the edge bias at each point; without an edge bias it makes no difference.

        Returns
        -------
        Distances
            Values and their random standard uncertainties; `u_mm` is None.
        """
        points = np.asarray(points_px, dtype=np.float64)
        length_px = np.linalg.norm(points[:, 1] - points[:, 0], axis=1)
        return Distances(
            value_mm=length_px / self.px_per_mm,
            u_mm=None,
            u_random_mm=np.asarray(u_random_px, dtype=np.float64) / self.px_per_mm,
        )

    def positions_mm(
        self,
        points_px: Floats,
        axis: int,
        light_gap: NDArray[np.bool_],
        frame_size_px: tuple[int, int],
        shares: Floats | None = None,
    ) -> Floats:
        """Coordinates (mm) of both points of each distance along an axis of the picture, from the picture's centre.

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
        middle_px = (frame_size_px[axis] - 1) / 2
        points = np.asarray(points_px, dtype=np.float64)
        return np.asarray((points[:, :, axis] - middle_px) / self.px_per_mm)

    def check_frame_size(self, width_px: int, height_px: int) -> None:
        """Do nothing: a bare scale is valid for any frame size."""


STATED = "scale, as stated"
"""Name of the stated uncertainty's line in a budget."""


@dataclass(frozen=True, slots=True)
class StatedScale(BareScale):
    """A scale stated by the user together with its standard uncertainty.

    Until the size of the frames is known, the object serves as a scale without uncertainty; `for_frames` then gives the
    calibration by which distances get their full uncertainty.

    Parameters
    ----------
    px_per_mm : float
        Pixels per millimetre; positive.
    u_px_per_mm : float
        Standard uncertainty of `px_per_mm`; positive and smaller than `px_per_mm`.

    Raises
    ------
    ValueError
        If the scale or its uncertainty is impossible.

    Examples
    --------
    >>> import calib
    >>> print(f"{calib.StatedScale(34.0, 0.1).for_frames((640, 480)).u_px_per_mm:.2f} px/mm")
    0.10 px/mm
    """

    u_px_per_mm: float

    def __post_init__(self) -> None:
        """Refuse an impossible scale or uncertainty."""
        # `super()` without arguments fails here, because a dataclass with slots is a new class.
        BareScale.__post_init__(self)
        if not (isfinite(self.u_px_per_mm) and 0.0 < self.u_px_per_mm < self.px_per_mm):
            raise ValueError(
                f"u_px_per_mm must be positive and smaller than px_per_mm ({self.px_per_mm:g}), "
                f"but is {self.u_px_per_mm:g}."
            )

    def for_frames(self, frame_size_px: tuple[int, int]) -> Calibration:
        """Return the calibration that corresponds to the stated values.

        The stated uncertainty is one contribution to the calibration's budget. As with a single reference object, the
        edge bias is unknown, and the set-up's imperfections have their default limits (`calib.limits.Limits`).

        Parameters
        ----------
        frame_size_px : (int, int)
            Width and height of the frames to be measured.
        """
        limits = Limits()
        parts = (
            ScalePart(STATED, np.diag([self.u_px_per_mm**2, 0.0]), "(--u-px-per-mm)"),
            ScalePart(
                "edge bias",
                np.diag([0.0, rectangular(limits.edge_bias_px) ** 2]),
                f"+-{limits.edge_bias_px:g} px (default); a stated scale does not determine the edge bias, but a bar "
                "and a slot do",
            ),
        )
        # The scale was not measured on edges in a picture, so that it has no error of the camera response in common
        # with the recording.
        return Calibration(self.px_per_mm, 0.0, parts, frame_size_px, limits, response_shift_px=0.0)


def is_stated(scale: object) -> bool:
    """Whether a scale was stated by the user instead of measured on a reference object."""
    if isinstance(scale, Calibration):
        return any(part.source == STATED for part in scale.parts)
    return isinstance(scale, BareScale)
