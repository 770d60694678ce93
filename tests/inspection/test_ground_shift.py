"""Registration of the background: drawn shifts are found, and a background without texture is not tracked."""

import cv2
import numpy as np

from fingervision.domain.direction import Direction
from fingervision.domain.frame import Frame
from fingervision.domain.gap import FingerEdge, GapMeasurement
from fingervision.inspection.ground_shift import GroundShift, GroundTracker

TIP = FingerEdge(100.0, 130.0, 120.0, 0.01, 0.01, 0.0, 1.0, 100.0)
MEASURED = GapMeasurement(TIP, TIP, Direction.UP, 0.01, light_gap=True)


def followed(texture: float, shifts: np.ndarray) -> GroundShift:
    rng = np.random.default_rng(1)
    pattern = cv2.GaussianBlur(rng.standard_normal((300, 400)), (0, 0), 2.0)
    pattern *= texture / pattern.std()
    tracker = GroundTracker()
    for k, (x, y) in enumerate(shifts):
        moved = cv2.warpAffine(
            pattern,
            np.array([[1.0, 0.0, x], [0.0, 1.0, y]]),
            (400, 300),
            flags=cv2.INTER_CUBIC,
            borderMode=cv2.BORDER_REFLECT,
        )
        levels = np.clip(np.rint(180.0 + moved + 2.0 * rng.standard_normal(moved.shape)), 0, 255).astype(np.uint8)
        tracker.add(Frame(levels, k), MEASURED)
    return tracker.shift()


def test_drawn_shifts_are_found() -> None:
    shifts = np.array([[0.0, 0.0], [1.3, -0.4], [-0.6, 0.25], [3.1, 1.9]])
    found = followed(8.0, shifts)
    assert found.u_px is not None
    assert found.u_px < 0.05
    assert np.abs(found.across_px - shifts[:, 0]).max() < 0.1
    assert np.abs(found.along_px - shifts[:, 1]).max() < 0.1


def test_plain_ground_is_not_followed() -> None:
    assert followed(0.0, np.zeros((6, 2))).u_px is None
