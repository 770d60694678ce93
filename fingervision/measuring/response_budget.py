"""The camera response of a recording, and the uncertainty if it is assumed instead of measured."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from calib.camera_response import CameraResponse
from calib.measured_scale import Calibration
from fingervision.domain.camera import Origin, ResponseEstimate, assumed_response
from fingervision.domain.gap import GapMeasurement
from fingervision.frames.transfer_tag import transfer_tag
from fingervision.measuring.bias_share import bias_shares
from fingervision.measuring.scale import Scale


def u_response_shift_mm(measured: Sequence[GapMeasurement], scale: Scale) -> NDArray[np.float64]:
    """Standard uncertainty of each gap due to an assumed camera response, shape (n,) (mm).

    An error of the response also displaced the edges in the calibration's pictures. The calibration's edge bias, or its
    budget, contains the displacement in the calibration's pictures; only the difference from the displacement in the
    recording remains. If a calibration does not state its response, the response of the recording is assumed.
    """
    if not isinstance(scale, Calibration) or scale.response_shift_px is None:
        return np.zeros(len(measured))
    u_px = np.array([m.u_response_px for m in measured])
    polarity = np.where([m.light_gap for m in measured], 1.0, -1.0) * bias_shares(measured).mean(axis=1)
    left_px = np.where(u_px == 0.0, 0.0, u_px - polarity * scale.response_shift_px / np.sqrt(3.0))
    return np.asarray(np.abs(left_px) / scale.px_per_mm)


def choose_response(
    stated: CameraResponse | None, scale: Scale, files: tuple[Path, ...]
) -> tuple[ResponseEstimate, str]:
    """Choose the response of a recording before its frames are read, and a warning if needed.

    The response stated by the user has priority, then the response stated by the calibration, then the recording's own
    tag; otherwise the response is assumed to be linear.
    """
    calibrated = scale.camera_response if isinstance(scale, Calibration) else None
    known = isinstance(scale, Calibration) and scale.response_known
    tag = transfer_tag(files)
    if stated is not None:
        response = ResponseEstimate(stated, (), Origin.STATED)
    elif known and calibrated is not None:
        response = ResponseEstimate(calibrated, (), Origin.CALIBRATED)
    else:
        response = assumed_response(tag or "linear")
    if calibrated is not None and calibrated.name != response.curve.name:
        shift_px = scale.response_shift_px if isinstance(scale, Calibration) else None
        size = (
            ""
            if not shift_px
            else f", which changes a gap by about {abs(shift_px):.2f} px at the edges of the calibration"
        )
        return (
            response,
            f"The calibration was made with the camera response {calibrated.name}, but this recording is measured "
            f"with the response {response.curve.name}{size}: calibrate with this camera, or state the same --response "
            "for both.",
        )
    if stated is None and known and tag is not None and calibrated is not None and tag != calibrated.name:
        return (
            response,
            f"A tag in the recording states the camera response {tag}, but that of the calibration, "
            f"{calibrated.name}, is used: "
            "state --response if another camera made this recording.",
        )
    return response, ""
