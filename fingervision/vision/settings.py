"""Settings of a measurement as far as image processing needs them."""

from dataclasses import dataclass

from calib.camera_response import CameraResponse, standard_response
from fingervision.domain.camera import ASSUMED_CAMERA, CameraModel
from fingervision.domain.direction import Direction
from fingervision.domain.region import Region

# Response assumed for a camera that does not state its response, and the other possible response.
LINEAR, SRGB = standard_response("linear"), standard_response("srgb")


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings of a measurement that the image processing needs.

    Parameters
    ----------
    below_tip_px : float
        Distance of the measuring point below each finger's tip; positive.
    direction : Direction or None
        Direction in which the tips point; None determines it in every frame.
    region : Region or None
        The part of the frame that is measured; None for the whole frame.
    response : CameraResponse
        Assumed camera response, which converts grey levels to light.
    other_response : CameraResponse or None
        Another possible camera response (one of the standards); None if the response is known.
    bits : int or None
        Bit depth of levels stored in 16 bits; None determines it from the picture.
    fingers_are_dark : bool or None
        Whether the fingers are darker than the background; None determines it in every frame.
    is_outline : bool
        Whether a thick part is measured at its whole outline, side walls included, rather than at its front face.
    camera : CameraModel
        What is known about the camera beside its response: point spread, noise, sharpening, lag, defect pixels.
    """

    below_tip_px: float
    direction: Direction | None = None
    region: Region | None = None
    response: CameraResponse = LINEAR
    other_response: CameraResponse | None = SRGB
    bits: int | None = None
    fingers_are_dark: bool | None = None
    is_outline: bool = False
    camera: CameraModel = ASSUMED_CAMERA
