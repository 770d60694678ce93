"""One frame inspected in detail: its noise, contrast and blur, and the effect of another noise or blur."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.inspection.noise_bound import edge_noise_px
from fingervision.vision.edge_filters import LEAST_RESOLVED_BLUR_PX, PIXEL_VARIANCE
from fingervision.vision.edges import EdgePoints
from fingervision.vision.fingers import CoarseFingers
from fingervision.vision.grey import GreyImage
from fingervision.vision.residuals import SHARED_POINTS
from fingervision.vision.side_wall import WIDER

Floats = NDArray[np.float64]

# Assumed noise of the camera if a codec has removed the noise (grey levels of 255).
CAMERA_NOISE = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """One frame inspected in detail.

    Parameters
    ----------
    frame : Frame
        The picture.
    upright : ndarray or None
        Grey levels of the picture, turned so that the tips point up; None if no fingers were found.
    outcome : GapMeasurement
        Result of the gap measurement.
    fingers : CoarseFingers
        The fingers to the nearest pixel.
    edges : EdgePoints
        Sub-pixel outlines of the fingers.
    top_level : int
        Full scale of the picture.
    """

    frame: Frame
    upright: GreyImage
    outcome: GapMeasurement
    fingers: CoarseFingers
    edges: EdgePoints
    top_level: int

    @property
    def contrast(self) -> float:
        """Smaller of the two fingers' contrasts with the background, in light on the scale of the levels."""
        return min(abs(self.outcome.left.contrast), abs(self.outcome.right.contrast))

    @property
    def focus_blur_px(self) -> float:
        """Blur of the optics including the pixel's width (px): that of flanks or tips, whichever is smaller."""
        return float(np.sqrt(self.edges.blur_px.min(axis=1).max() ** 2 + PIXEL_VARIANCE))

    @property
    def widened_px2(self) -> Floats:
        """Variance that motion has added to the blur of each finger's flanks, compared with the tips; shape (2,)."""
        resolved = np.maximum(self.edges.blur_px, LEAST_RESOLVED_BLUR_PX)
        flanks, tips = (resolved[:, part] ** 2 + PIXEL_VARIANCE for part in (0, 1))
        return np.asarray(np.where(flanks > (1.0 + WIDER) * tips, flanks - tips, 0.0))

    @property
    def flank_blur_px(self) -> float:
        """Blur of the flanks including the pixel's width (px)."""
        return float(np.sqrt(self.edges.blur_px[:, 0].max() ** 2 + PIXEL_VARIANCE))

    @property
    def u_camera_px(self) -> float:
        """Random uncertainty of the gap (px) from the camera's noise alone, without codec errors that rows share."""
        alone = max(self.outcome.u_gap_px**2 - self.outcome.u_coding_px**2, 0.0)
        shared = 1.0 if self.frame.quantiser is not None else SHARED_POINTS[self.frame.coding]
        return float(np.sqrt(alone / shared))

    @property
    def noise(self) -> float:
        """Ratio of noise to contrast, from the flat parts beside the edges if they are in view.

        A codec removes the noise from flat parts; for a coded picture the noise of a typical camera is assumed, unless
        the noise at the edges is lower.
        """
        flat = self.edges.noise_flat
        if self.frame.lossy or not flat:
            flat = min(self.edges.noise, max(flat, CAMERA_NOISE * self.top_level / 255.0))
        return flat / max(self.contrast, 1e-9)

    def u_with(self, noise: float | None = None, blur_px: float | None = None) -> float:
        """Random uncertainty of the gap (pixels) for another noise-to-contrast ratio, or another blur of the flanks.

        The uncertainty stated for this frame is multiplied by the ratio of the two Cramer-Rao bounds.
        """
        now = edge_noise_px(self.noise, self.flank_blur_px)
        then = edge_noise_px(self.noise if noise is None else noise, self.flank_blur_px if blur_px is None else blur_px)
        return self.u_camera_px * then / now if now > 0.0 else 0.0
