"""Settings of a measurement as far as image processing needs them."""

from dataclasses import dataclass

from calib.camera_response import CameraResponse, standard_response
from fingervision.domain.camera import ASSUMED_CAMERA, CameraModel, stated_camera
from fingervision.domain.direction import Direction
from fingervision.domain.frame import Region
from fingervision.vision.flanks import STEEPEST

# A camera that is known to be linear.
LINEAR_CAMERA = stated_camera(standard_response("linear"))


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
    bits : int or None
        Bit depth of levels stored in 16 bits; None determines it from the picture.
    fingers_are_dark : bool or None
        Whether the fingers are darker than the background; None determines it in every frame.
    has_fingers : bool
        Whether the gap between fingers is asked for; if not, nothing in a picture is taken for a finger.
    is_outline : bool
        Whether a thick part is measured at its whole outline, side walls included, rather than at its front face.
    steepest : float
        Largest inclination of a finger's flank against its axis, in pixels across per pixel along it.
    camera : CameraModel
        What is known about the camera: response, point spread, noise, sharpening, lag, defect pixels.
    """

    below_tip_px: float
    direction: Direction | None = None
    region: Region | None = None
    bits: int | None = None
    fingers_are_dark: bool | None = None
    has_fingers: bool = True
    is_outline: bool = False
    steepest: float = STEEPEST
    camera: CameraModel = ASSUMED_CAMERA

    @property
    def response(self) -> CameraResponse:
        """Camera response that converts grey levels to light."""
        return self.camera.response.curve
