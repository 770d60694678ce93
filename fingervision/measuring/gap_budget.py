"""Uncertainty budget of each gap: contributions of the scale, and of each picture."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from calib.budget import Budget, BudgetLine, edge_noise_mm
from calib.camera_response import CameraResponse
from calib.measured_scale import Calibration
from fingervision.domain.camera import Origin, ResponseEstimate, assumed_response
from fingervision.domain.gap import GapMeasurement
from fingervision.frames.transfer_tag import transfer_tag
from fingervision.measuring.scale import Scale

# The camera response of a recording, and the uncertainty if it is assumed instead of measured.


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


# Share of the calibration's edge bias at each measured edge: all of it at a straight edge, less below a round tip.


def bias_shares(measured: Sequence[GapMeasurement]) -> NDArray[np.float64]:
    """Share of the edge bias at the left and the right edge of each gap, shape (n, 2).

    Parameters
    ----------
    measured : sequence of GapMeasurement
        Measurements with the slopes of both edges.
    """
    # Slopes refer to the picture's axis across the fingers; the gap is to the right of the left finger, and to the left
    # of the right finger.
    slopes = np.array([(m.left.slope, -m.right.slope) for m in measured], dtype=float).reshape(-1, 2)
    return np.asarray(np.hypot(1.0, slopes) - slopes)


PICTURE = "seen beside or at the edges"
RESPONSE = "assumed camera response"


def gap_budget(measured: Sequence[GapMeasurement], scale: Scale) -> Budget:
    """List every contribution to the standard uncertainty of each gap; `u_mm` of the result is `u_gap_mm` of gaps.csv.

    The squares of independent contributions add (JCGM 100:2008, equation 10). A bare scale (pixels per millimetre
    without calibration) has no stated uncertainty; then only the contributions of the pictures are listed, and their
    sum is not the uncertainty of the gap in mm.

    Parameters
    ----------
    measured : sequence of GapMeasurement
        At least one measurement; n is their number.
    scale : Scale
        Conversion from pixels to millimetres.

    Returns
    -------
    Budget
        Budget with parts of shape (n,), in millimetres; parts that change from frame to frame are not `shared`.
    """
    u_random_px = np.array([m.u_gap_px for m in measured], dtype=float)
    u_shift_mm = np.array([m.u_shift_px for m in measured], dtype=float) / scale.px_per_mm
    seen = BudgetLine(PICTURE, u_shift_mm, "the picture: rims, walls, shadows, glare, sharpening, clipped light")
    if not isinstance(scale, Calibration):
        noise = BudgetLine(
            "edge noise", edge_noise_mm(u_random_px, scale.px_per_mm), "the fit of each frame's edges", shared=False
        )
        return Budget((noise, seen))
    points = np.array([((m.left.x_px, m.left.y_px), (m.right.x_px, m.right.y_px)) for m in measured], dtype=float)
    light_gap = np.array([m.light_gap for m in measured], dtype=bool)
    of_scale = scale.budget(points, u_random_px, light_gap, bias_shares(measured))
    return Budget(
        (
            *of_scale.lines,
            seen,
            BudgetLine(
                RESPONSE, u_response_shift_mm(measured, scale), "the change of the gap under the other usual response"
            ),
        )
    )
