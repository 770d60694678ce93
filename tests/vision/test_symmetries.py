"""A picture that is mirrored, shifted, rotated, coloured, inverted or cropped gives the same gap."""

from collections.abc import Callable

import numpy as np
import pytest

from fingervision.domain.direction import Direction
from fingervision.domain.frame import Frame, Pixels, Region
from fingervision.domain.gap import GapMeasurement
from fingervision.rendering import Camera, render, two_fingers
from fingervision.vision.pipeline import Settings, measure_frame

# The issue's own figure.
SAME_PX = 0.001
SHAPES: dict[str, dict] = {
    "sharp": {},
    "rounded": {"radius_px": 30.3},
    "tilted": {"radius_px": 20.0, "tilt_deg": (5.0, -3.0)},
    "stepped": {"radius_px": 30.0, "tip_step_px": 11.3},
    "near": {"radius_px": 25.0, "gap_px": 9.4},
}
CHANGES: dict[str, tuple[Callable[[Pixels], Pixels], Direction]] = {
    "mirrored": (lambda a: a[:, ::-1], Direction.UP),
    "upside_down": (lambda a: a[::-1], Direction.DOWN),
    "turned_left": (lambda a: np.rot90(a), Direction.LEFT),
    "turned_right": (lambda a: np.rot90(a, -1), Direction.RIGHT),
    "half_turned": (lambda a: a[::-1, ::-1], Direction.DOWN),
    "shifted_across": (lambda a: np.pad(a, ((0, 0), (7, 0)), mode="edge")[:, :640], Direction.UP),
    "shifted_along": (lambda a: np.pad(a, ((5, 0), (0, 0)), mode="edge")[:480], Direction.UP),
    "coloured": (lambda a: np.dstack([a] * 3), Direction.UP),
    "inverted": (lambda a: 255 - a, Direction.UP),
    "sixteen_bits": (lambda a: a.astype(np.uint16) * 257, Direction.UP),
}


def _picture(shape: str) -> Pixels:
    options = {"gap_px": 141.3, "tip_at_px": 120.4, "centre_px": 1.7, **SHAPES[shape]}
    return render(two_fingers(**options), Camera(blur_px=0.9, noise_grey=2.0), np.random.default_rng(91))


def _gap(pixels: Pixels, settings: Settings) -> GapMeasurement:
    found = measure_frame(Frame(np.ascontiguousarray(pixels), 0), settings)
    assert isinstance(found, GapMeasurement), found
    return found


@pytest.mark.parametrize("is_given", [True, False], ids=["given", "auto"])
@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("shape", SHAPES)
def test_the_same_gap_from_a_changed_picture(shape: str, change: str, is_given: bool) -> None:
    pixels = _picture(shape)
    changed, direction = CHANGES[change]
    before = _gap(pixels, Settings(10.2, Direction.UP if is_given else None))
    after = _gap(changed(pixels), Settings(10.2, direction if is_given else None))
    assert after.direction is direction
    assert after.gap_px == pytest.approx(before.gap_px, abs=SAME_PX)
    assert after.light_gap is (change != "inverted")


@pytest.mark.parametrize("shape", SHAPES)
def test_a_region_gives_the_points_of_the_full_frame(shape: str) -> None:
    pixels = _picture(shape)
    whole = _gap(pixels, Settings(10.2, Direction.UP))
    part = _gap(pixels, Settings(10.2, Direction.UP, Region(60, 40, 520, 400)))
    assert part.gap_px == pytest.approx(whole.gap_px, abs=SAME_PX)
    assert (part.left.x_px, part.left.y_px) == pytest.approx((whole.left.x_px, whole.left.y_px), abs=SAME_PX)
    assert part.right.tip_px == pytest.approx(whole.right.tip_px, abs=SAME_PX)
