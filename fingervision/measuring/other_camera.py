"""Check that the camera has the settings at which it was calibrated."""

from collections.abc import Mapping

from calib.errors import CalibrationError
from calib.measured_scale import Calibration
from fingervision.measuring.scale import Scale


def other_camera(scale: Scale | None, camera: Mapping[str, str]) -> str:
    """Sentence naming the settings that differ from the calibration's.

    Parameters
    ----------
    scale : Scale or None
        A bare scale knows no camera.
    camera : mapping of str to str
        Settings, as far as they are known.

    Returns
    -------
    str
        A sentence; empty where nothing that both state differs.
    """
    if isinstance(scale, Calibration):
        try:
            scale.check_camera(camera)
        except CalibrationError as error:
            return str(error)
    return ""
