"""Possible displacement of a whole edge by a codec, for a flank that is tilted at the measuring point."""

from dataclasses import replace

import numpy as np
import pytest

from fingervision.domain.direction import Direction
from fingervision.domain.gap import FingerEdge, GapMeasurement
from fingervision.vision.coded_picture import displaced_px, with_coding_error

STEP, CONTRAST = 8.0, 130.0
EDGE = FingerEdge(100.0, 120.0, 110.0, 0.0, 0.0, 0.0, 1.0, CONTRAST)


def u_gap_px(slope: float) -> float:
    edge = replace(EDGE, slope=slope)
    found = GapMeasurement(edge, replace(edge, x_px=200.0), Direction.UP, 0.0, True)
    return with_coding_error(found, STEP, (40.0, 40.0), np.arange(256.0), 255).u_gap_px


@pytest.mark.parametrize("slope", [0.0, -0.5, 1.2])
def test_flank_and_tip_are_displaced_along_their_normals(slope: float) -> None:
    """Monte Carlo simulation of a straight flank and a level tip, displaced independently along their normals."""
    rng = np.random.default_rng(4)
    flank, tip = displaced_px(STEP, CONTRAST, slope) * rng.standard_normal((2, 20_000))
    # The flank is the line across = slope * down; the measuring height goes with the tip.
    across = flank * np.hypot(1.0, slope) + slope * tip
    assert u_gap_px(slope) == pytest.approx(np.sqrt(2.0) * across.std(), rel=0.03)
