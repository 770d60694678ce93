"""Check that the camera has the same settings as at its calibration."""

from collections.abc import Mapping

from calib.errors import CalibrationError
from calib.measured_scale import Calibration
from fingervision.measuring.scale import Scale


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
