"""Settings of a measurement as far as image processing needs them."""

from dataclasses import dataclass

from calib.camera_response import CameraResponse, standard_response
from fingervision.domain.direction import Direction
from fingervision.domain.region import Region

# What is taken of a camera that says nothing, and what it may be as well.
LINEAR, SRGB = standard_response("linear"), standard_response("srgb")


@dataclass(frozen=True, slots=True)
class Settings:
    """What the user chose for the measurement.

    Parameters
    ----------
    below_tip_px : float
        Height of measuring below each finger's tip; positive.
    direction : Direction or None
        Where the tips point; None finds out in every frame.
    region : Region or None
        The part of the frame that is looked at; None is all of it.
    response : CameraResponse
        Which light a grey level is taken for.
    other_response : CameraResponse or None
        What the response may be as well (one of the standards); None where it is known.
    bits : int or None
        Depth of levels that are stored in 16 bits; None finds it in the picture.
    fingers_are_dark : bool or None
        Whether the fingers are darker than the ground; None finds out in every frame.
    is_outline : bool
        Whether a thick part is measured at its whole outline, side walls included, and not at its front face.
    """

    below_tip_px: float
    direction: Direction | None = None
    region: Region | None = None
    response: CameraResponse = LINEAR
    other_response: CameraResponse | None = SRGB
    bits: int | None = None
    fingers_are_dark: bool | None = None
    is_outline: bool = False
