"""What stands beside the edges may change half-way through a recording, after its camera was learnt."""

from dataclasses import replace

import numpy as np
import pytest

from calib.calibration import BareScale
from calib.camera_response import standard_response
from fingervision.domain.camera import BesideEdges
from fingervision.domain.direction import Direction
from fingervision.domain.gap import GapMeasurement
from fingervision.measuring.camera_learning import WANTED
from fingervision.measuring.changed_edges import ChangingEdges
from fingervision.measuring.in_memory import measure_in_memory
from fingervision.measuring.task import Task
from fingervision.vision.pipeline import LINEAR_CAMERA, Settings, measure_frame
from tests.benchmarks.camera_artefacts.classes import BELOW_PX
from tests.benchmarks.camera_artefacts.optics import Surface
from tests.benchmarks.unknown_cameras import CURVES, PX_PER_MM, drawn, lossless

TASK = Task(BareScale(PX_PER_MM), below_tip_mm=BELOW_PX / PX_PER_MM, direction=Direction.UP)
SURFACES = {
    "wall": Surface(wall_px=4.0),
    "glare": Surface(glare=0.4),
    "shadow": Surface(shadow=0.4),
    "nothing": Surface(),
}


def is_learnt_when_it_begins(before: str, after: str, task: Task) -> None:
    """The fingers are at rest, and the noise is another in each picture."""
    first, then = (drawn(9401, 1, SURFACES[name]) for name in (before, after))
    both = replace(then, light=first.light * (WANTED + 1) + then.light * 4)
    found = measure_in_memory(lossless(both, CURVES["linear"]), task).results[WANTED + 1 :]
    for result, gap_px in zip(found, then.gap_px * 4, strict=True):
        if isinstance(result.outcome, GapMeasurement):
            u_px = np.hypot(result.outcome.u_gap_px, result.outcome.u_picture_px)
            assert abs(result.outcome.gap_px - gap_px) < max(2.5 * u_px, 0.1)
    assert sum(isinstance(result.outcome, GapMeasurement) for result in found) >= 3


@pytest.mark.parametrize("after", ["nothing", "shadow"])
def test_what_begins_beside_the_edges_is_learnt_when_it_begins(after: str) -> None:
    is_learnt_when_it_begins("nothing", after, replace(TASK, response=standard_response("linear")))


@pytest.mark.slow
@pytest.mark.parametrize(("before", "after"), [*(("nothing", name) for name in SURFACES), ("wall", "nothing")])
def test_it_is_learnt_with_an_unknown_camera(before: str, after: str) -> None:
    is_learnt_when_it_begins(before, after, TASK)


def test_what_stands_beside_the_edges_no_more_is_taken_off_no_more() -> None:
    recording = drawn(9401, 1)
    (frame,) = lossless(recording, CURVES["linear"])
    wall = BesideEdges("wall", 1.0, (2.0, 2.0), (0.0, 0.0), (4.0, 4.0), (0.0, 0.0), 0.1, 0.1)
    camera = replace(LINEAR_CAMERA, beside=wall, usual=((9.0, 0.1), (9.0, 0.1)))
    settings = Settings(BELOW_PX, Direction.UP, camera=camera)
    as_before, learnt_again = measure_frame(frame, settings), ChangingEdges().measure(frame, settings)
    assert isinstance(as_before, GapMeasurement)
    assert isinstance(learnt_again, GapMeasurement)
    assert abs(as_before.gap_px - recording.gap_px[0]) > 1.0
    assert abs(learnt_again.gap_px - recording.gap_px[0]) < 0.1
