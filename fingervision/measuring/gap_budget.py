"""Uncertainty budget of each gap: contributions of the scale, and of each picture."""

from collections.abc import Sequence

import numpy as np

from calib.budget import Budget, BudgetLine, edge_noise_mm
from calib.measured_scale import Calibration
from fingervision.domain.gap import GapMeasurement
from fingervision.measuring.bias_share import bias_shares
from fingervision.measuring.response_budget import u_response_shift_mm
from fingervision.measuring.scale import Scale

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
