"""A camera that mixes earlier pictures into each picture is known by its noise, and its lag is part of u."""

from dataclasses import replace

import numpy as np
import pytest

from calib.calibration import BareScale
from fingervision.domain.camera import CameraQuantity, Origin
from fingervision.domain.direction import Direction
from fingervision.domain.frame import Frame
from fingervision.domain.gap import FingerEdge, GapMeasurement, NoGap
from fingervision.domain.status import Status
from fingervision.measuring.camera_learning import camera_of
from fingervision.measuring.in_memory import measure_in_memory
from fingervision.measuring.task import Task
from fingervision.measuring.temporal_filter import with_lag
from fingervision.vision.pipeline import Settings
from tests.benchmarks.camera_artefacts.classes import BELOW_PX
from tests.benchmarks.unknown_cameras import CURVES, PX_PER_MM, Recording, drawn, noise_reduced

EDGE = FingerEdge(100.0, 50.0, 40.0, 0.01, 0.01, 0.0, 1.0, 150.0)
PLAIN = GapMeasurement(EDGE, replace(EDGE, x_px=200.0), Direction.UP, 0.01, True)


@pytest.fixture(scope="module")
def recording() -> Recording:
    return drawn(7001, 10)  # the gap changes by 0.22 px from picture to picture


@pytest.mark.parametrize("share", [0.0, 0.5, 0.8])
def test_the_lag_is_told_by_the_noise_of_the_ground(recording: Recording, share: float) -> None:
    film = noise_reduced(recording, CURVES["linear"], share)
    lag = camera_of(list(film), Settings(BELOW_PX, Direction.UP), BareScale(PX_PER_MM)).lag
    assert lag.origin is Origin.LEARNT
    assert lag.value == pytest.approx(share / (1.0 - share), abs=4.0 * lag.u + 0.02)
    assert lag.u < 0.05 + 0.3 * lag.value


def test_moving_fingers_that_are_seen_late_are_within_u(recording: Recording) -> None:
    task = Task(BareScale(PX_PER_MM), below_tip_mm=BELOW_PX / PX_PER_MM, direction=Direction.UP)
    found = measure_in_memory(noise_reduced(recording, CURVES["linear"], 0.8), task)
    gaps = [result.outcome for result in found.results]
    wrong = np.abs([gap.gap_px - truth for gap, truth in zip(gaps, recording.gap_px, strict=True)])
    u_px = np.array([np.hypot(gap.u_gap_px, gap.u_picture_px) for gap in gaps])
    assert wrong.max() > 0.5
    assert np.count_nonzero(wrong < 2.0 * u_px) >= wrong.size - 1
    assert found.summary["beside_edges"]["trail"] >= wrong.size // 2


def gap_at(place: float) -> GapMeasurement:
    return replace(PLAIN, right=replace(EDGE, x_px=100.0 + place))


def test_the_uncertainty_is_that_of_the_way_during_the_lag() -> None:
    frames = [Frame(np.zeros((2, 2), np.uint8), k) for k in range(5)]
    outcomes = [gap_at(90.0), gap_at(90.0), NoGap(Status.TOUCHING, ""), gap_at(92.0), gap_at(92.0)]
    items = list(zip(frames, outcomes, strict=True))
    found = [outcome for _, outcome in with_lag(items, CameraQuantity(3.0, 0.1, Origin.LEARNT))]
    # From frame 1 to frame 3 the gap grows by 1 px a frame, and 3 frames of lag are 3 px (rectangular distribution).
    assert [getattr(each, "u_shift_px", None) for each in found] == pytest.approx([0.0, 0.0, None, 3.0**0.5, 0.0])
    assert [getattr(each, "beside", None) for each in found] == ["", "", None, "trail", ""]
    assert [outcome for _, outcome in with_lag(items, CameraQuantity(0.0))] == outcomes
