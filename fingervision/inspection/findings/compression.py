"""Compression: changes of the picture by a codec, or by processing in the camera."""

import numpy as np

from fingervision.inspection.blocks import BLOCK_PX, BLOCKY, HEAVY
from fingervision.inspection.finding import Finding, weighed, without
from fingervision.inspection.look import CAMERA_NOISE, Look
from fingervision.inspection.sample import Sample

REMEDY = "Record losslessly (raw or FFV1; PNG or TIFF for pictures), or at several times the bit rate."
FORMULA = (
    "sqrt(u^2 - u'^2 + s^2); u is the random uncertainty, u' the random uncertainty without the codec's errors at the "
    "edges; s is u_shift_px if the blocks are clearly visible, else 0"
)


def find(sample: Sample) -> Finding | None:
    """Look for a codec's block pattern, and compare the stated uncertainty with that from the camera's noise alone."""
    if not sample.looks:
        return None
    blocks = sample.blockiness
    lossy = sample.description.lossy
    is_coded = lossy or blocks > BLOCKY
    cost_px = sample.median(_cost_px(look, sample.top_level) for look in sample.looks) if is_coded else 0.0
    if blocks > HEAVY:
        cost_px = float(np.hypot(cost_px, sample.u_shift_px))
    how = f"stored with loss ({sample.description.codec})" if lossy else "stored without loss"
    seen = f"steps between blocks of {BLOCK_PX} px are {100 * max(blocks, 0.0):.0f} % larger than steps within blocks"
    before = "" if lossy or blocks <= BLOCKY else ", so that they were compressed before"
    return weighed(sample, "compression", cost_px, f"The pictures are {how}; {seen}{before}.", REMEDY, FORMULA)


def _cost_px(look: Look, top: int) -> float:
    """Cost of the codec (px): the part of the edge fits' residuals that exceeds the camera's noise."""
    camera = min(look.edges.noise, max(look.edges.noise_flat, CAMERA_NOISE * top / 255.0))
    return without(look.outcome.u_gap_px, look.u_camera_px * camera / max(look.edges.noise, 1e-9))
