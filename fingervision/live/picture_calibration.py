"""Calibration from a reference object in the live picture, whose region and size the user states."""

from calib.errors import CalibrationError
from calib.known_widths import KnownSize, find_widths
from calib.limits import Limits
from calib.measured_scale import Calibration, Reference
from calib.scale_from_sizes import MeasuredSize, scale_from_sizes
from fingervision.domain.errors import NoCalibrationError
from fingervision.domain.frame import Frame
from fingervision.domain.region import Region
from fingervision.vision.grey import to_grey

NAME = "the live picture"


def calibrated(frame: Frame, region: Region, kind: str, size_mm: float, u_size_mm: float) -> Calibration:
    """Calibrate on one bar or slot in a rectangle of the picture.

    Parameters
    ----------
    frame : Frame
        The picture.
    region : Region
        Rectangle that contains the reference object.
    kind : str
        "bar" or "slot".
    size_mm, u_size_mm : float
        Size of the reference object, and the standard uncertainty of this size.

    Returns
    -------
    Calibration
        Calibration from a single size, so that the uncorrected edge bias is a contribution to the budget.

    Raises
    ------
    NoCalibrationError
        The part of the picture shows no reference of that kind.
    """
    try:
        picture = KnownSize(NAME, kind, size_mm, u_size_mm, to_grey(frame.pixels).copy())
        box = (region.x_px, region.y_px, region.width_px, region.height_px)
        (edges,) = find_widths((picture,), box)
        reference = Reference(f"{kind} in the live picture", size_mm, u_size_mm, "", "")
        size = MeasuredSize(reference, edges.width_px, edges.u_width_px, edges.points_px, edges.light)
        return scale_from_sizes((size,), (frame.width_px, frame.height_px), Limits()).calibration
    except CalibrationError as error:
        raise NoCalibrationError(str(error)) from error
