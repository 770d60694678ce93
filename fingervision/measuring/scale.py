"""The scale that a measurement uses: a bare number of pixels per millimetre, or a calibration."""

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from calib.calibration import BareScale, StatedScale
from calib.errors import CalibrationError
from calib.measured_scale import Calibration, Distances
from fingervision.domain.errors import DataError, UsageError

# Permitted scales, from a picture of a street to a picture through a microscope; other values are typing errors, and
# would cause an overflow.
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


def stated_scale(px_per_mm: float, u_px_per_mm: float | None = None) -> BareScale:
    """Return a scale that the user states, with its standard uncertainty if the user states one.

    Raises
    ------
    UsageError
        The scale is not positive or outside the range of real cameras, or its uncertainty is not positive or not
        smaller than the scale.
    """
    if not px_per_mm > 0.0:
        raise UsageError(f"--px-per-mm must be positive, but is {px_per_mm:g}.")
    check_px_per_mm(px_per_mm)
    if u_px_per_mm is None:
        return BareScale(px_per_mm)
    if not 0.0 < u_px_per_mm < px_per_mm:
        raise UsageError(
            f"--u-px-per-mm must be positive and smaller than --px-per-mm ({px_per_mm:g}), but is {u_px_per_mm:g}: "
            "state the standard uncertainty of the scale in pixels per millimetre, or leave it out."
        )
    return StatedScale(px_per_mm, u_px_per_mm)


def field_of_view(frame_size_px: tuple[int, int], px_per_mm: float) -> str:
    """Width and height that a picture shows at a scale, in the unit that a person would use.

    A scale that is wrong by a factor of 1000 is easily overlooked as a number, and not as a picture of a house.

    Examples
    --------
    >>> field_of_view((640, 480), 34.0), field_of_view((640, 480), 0.034)
    ('18.8 x 14.1 mm', '18.8 x 14.1 m')
    """
    width_mm, height_mm = (size_px / px_per_mm for size_px in frame_size_px)
    in_unit, unit = (1e-3, "m") if width_mm >= 1e3 else (1.0, "mm") if width_mm >= 1.0 else (1e3, "µm")
    return f"{in_unit * width_mm:.3g} x {in_unit * height_mm:.3g} {unit}"


def check_one_scale(calibration: object, px_per_mm: object, u_px_per_mm: object) -> None:
    """Refuse two scales at once, and an uncertainty that is stated without its scale.

    Raises
    ------
    UsageError
        Both a calibration and a scale are given, or the uncertainty of a scale that is not.
    """
    if calibration is not None and px_per_mm is not None:
        raise UsageError(
            "The scale must be given by either --calibration or --px-per-mm, but both are given: leave out one of them."
        )
    if u_px_per_mm is not None and calibration is not None:
        raise UsageError(
            "--u-px-per-mm belongs to --px-per-mm, but --calibration is given, which has its own uncertainty: leave "
            "out one of them."
        )
    if u_px_per_mm is not None and px_per_mm is None:
        raise UsageError("--u-px-per-mm states the uncertainty of a scale, but no scale is given: add --px-per-mm S.")


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

    def distances(
        self, points_px: Floats, u_random_px: Floats, light_gap: NDArray[np.bool_], shares: Floats | None = None
    ) -> Distances:
        """Distances between pairs of points."""
        ...

    def positions_mm(
        self,
        points_px: Floats,
        axis: int,
        light_gap: NDArray[np.bool_],
        frame_size_px: tuple[int, int],
        shares: Floats | None = None,
    ) -> Floats:
        """Coordinates (mm) along an axis, from the picture's centre, of the two points of each distance."""
        ...

    def check_frame_size(self, width_px: int, height_px: int) -> None:
        """Refuse frames of another size than those of the calibration."""
        ...


def scale_for_frames(scale: Scale, frame_size_px: tuple[int, int]) -> Scale:
    """Return the scale for frames of a given size; a stated uncertainty becomes an uncertainty budget.

    Parameters
    ----------
    scale : Scale
        The scale as it was given; only one that was stated with its uncertainty is changed.
    frame_size_px : (int, int)
        Width and height of the frames.

    Raises
    ------
    DataError
        The scale is for other frames.
    """
    try:
        scale.check_frame_size(*frame_size_px)
    except ValueError as error:
        raise DataError(str(error)) from error
    return scale.for_frames(frame_size_px) if isinstance(scale, StatedScale) else scale


# Check that the camera has the same settings as at its calibration.


def other_camera(scale: Scale | None, camera: Mapping[str, str]) -> str:
    """Sentence that names the camera settings that differ from those of the calibration.

    Parameters
    ----------
    scale : Scale or None
        Scale of the measurement; a bare scale contains no camera settings.
    camera : mapping of str to str
        Camera settings of the recording, as far as known.

    Returns
    -------
    str
        A sentence; empty if no setting known for both differs.
    """
    if isinstance(scale, Calibration):
        try:
            scale.check_camera(camera)
        except CalibrationError as error:
            return str(error)
    return ""
