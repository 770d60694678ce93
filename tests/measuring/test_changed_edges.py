"""What stands beside the edges may change half-way through a recording, after its camera was learnt."""

from dataclasses import replace

import numpy as np
import pytest

from calib.calibration import BareScale
from fingervision.domain.direction import Direction
from fingervision.domain.gap import GapMeasurement
from fingervision.measuring.camera_learning import WANTED
from fingervision.measuring.in_memory import measure_in_memory
from fingervision.measuring.task import Task
from tests.benchmarks.camera_artefacts.classes import BELOW_PX
from tests.benchmarks.camera_artefacts.optics import Surface
from tests.benchmarks.unknown_cameras import CURVES, PX_PER_MM, drawn, lossless

TASK = Task(BareScale(PX_PER_MM), below_tip_mm=BELOW_PX / PX_PER_MM, direction=Direction.UP)
AFTER = {
    "wall": Surface(wall_px=4.0),
    "glare": Surface(glare=0.4),
    "shadow": Surface(shadow=0.4),
    "nothing": Surface(),
}


@pytest.mark.parametrize(("before", "after"), [("nothing", name) for name in AFTER] + [("wall", "nothing")])
def test_what_begins_beside_the_edges_is_learnt_when_it_begins(before: str, after: str) -> None:
    first, then = drawn(9401, WANTED + 1, AFTER[before]), drawn(9401, WANTED + 5, AFTER[after])
    both = replace(
        then, light=(*first.light, *then.light[WANTED + 1 :]), gap_px=(*first.gap_px, *then.gap_px[WANTED + 1 :])
    )
    found = measure_in_memory(lossless(both, CURVES["linear"]), TASK).results[WANTED + 1 :]
    for result, gap_px in zip(found, both.gap_px[WANTED + 1 :], strict=True):
        if isinstance(result.outcome, GapMeasurement):
            u_px = np.hypot(result.outcome.u_gap_px, result.outcome.u_picture_px)
            assert abs(result.outcome.gap_px - gap_px) < max(2.5 * u_px, 0.1)
    assert sum(isinstance(result.outcome, GapMeasurement) for result in found) >= 3
