"""The flanks of a finger are straight over a sufficient length; the flanks of round objects are not."""

import cv2
import numpy as np
import pytest

from fingervision.domain.direction import Direction
from fingervision.domain.frame import Pixels
from fingervision.vision.flanks import has_straight_flanks
from fingervision.vision.orientation import Orientation
from fingervision.vision.outlines import find_outlines
from fingervision.vision.tops import Top, find_tops

BELOW_TIP_PX = 10.2
HEIGHT, WIDTH = 300, 240


def _top(mask: Pixels) -> Top:
    """The only local maximum of a mask whose tips point up."""
    (top,) = find_tops(
        mask.astype(np.uint8), find_outlines(mask.astype(np.uint8)), Orientation(Direction.UP, *mask.shape)
    )
    return top


def _bar(lean: float, width_px: float, top_px: float, round_px: float = 0.0) -> Pixels:
    """A bar with a round end, tilted to the right by `lean` pixels per row."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    across = np.abs(x - 120.0 + lean * (y - 150.0)) - 0.5 * width_px + round_px
    above = top_px + round_px - y
    inside = np.where(
        (across > 0) & (above > 0), np.hypot(across, above) <= round_px, np.maximum(across, above) <= round_px
    )
    return 255 * inside.astype(np.uint8)


def _disc(radius_px: float, top_px: float) -> Pixels:
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    return 255 * (np.hypot(x - 120.3, y - top_px - radius_px) <= radius_px).astype(np.uint8)


@pytest.mark.parametrize("lean", [-0.2, -0.1, 0.0, 0.03, 0.19])
@pytest.mark.parametrize(("width_px", "round_px"), [(30.0, 0.0), (80.0, 20.0), (80.0, 40.0)])
def test_bars_have_straight_flanks_at_any_tilt(lean: float, width_px: float, round_px: float) -> None:
    assert has_straight_flanks(_top(_bar(lean, width_px, 60.0, round_px)), BELOW_TIP_PX)


@pytest.mark.parametrize("radius_px", [20.0, 45.0, 70.0, 100.0])
@pytest.mark.parametrize("top_px", [120.0, 180.0])
def test_discs_have_none(radius_px: float, top_px: float) -> None:
    assert not has_straight_flanks(_top(_disc(radius_px, top_px)), BELOW_TIP_PX)


def test_specks_of_dust_bend_no_flank() -> None:
    mask, rng = _bar(0.05, 60.0, 40.0, 10.0), np.random.default_rng(121)
    for _ in range(8):
        y = int(rng.integers(60, 290))
        cv2.circle(mask, (round(120 - 0.05 * (y - 150) + 30 * rng.choice([-1, 1])), y), 3, 255, -1)
    tops = find_tops(mask, find_outlines(mask), Orientation(Direction.UP, HEIGHT, WIDTH))
    assert has_straight_flanks(tops[0], BELOW_TIP_PX)


def test_a_thing_on_a_straight_stem_counts_as_a_finger() -> None:
    mask = np.maximum(_disc(50.0, 60.0), _bar(0.0, 40.0, 100.0))
    assert has_straight_flanks(_top(mask), BELOW_TIP_PX)
