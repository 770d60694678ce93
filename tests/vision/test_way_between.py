"""The path between the two fingers contains only background and dust, in both directions."""

import numpy as np
import pytest

from fingervision.vision.way_between import inner_crossing, is_free

ENDS = [((20.0, 30.0), (120.0, 30.0)), ((20.0, 30.0), (120.0, 75.0)), ((40.0, 10.0), (40.0, 90.0))]


@pytest.mark.parametrize(("start", "end"), ENDS)
@pytest.mark.parametrize(("share", "free"), [(0.0, True), (0.15, True), (0.5, False), (1.0, False)])
def test_so_much_of_the_way_may_be_dust(
    start: tuple[float, float], end: tuple[float, float], share: float, free: bool
) -> None:
    mask = np.zeros((100, 140), dtype=np.uint8)
    for place in np.linspace(0.5 - share / 2, 0.5 + share / 2, 400 if share else 0):
        x, y = np.rint(np.add(start, place * np.subtract(end, start))).astype(int)
        mask[y - 1 : y + 2, x - 1 : x + 2] = 255
    assert is_free(mask, start, end) is free
    assert is_free(mask, end, start) is free


def test_fingers_that_nearly_touch_have_nothing_between() -> None:
    assert is_free(np.full((20, 20), 255, dtype=np.uint8), (8.0, 10.0), (12.0, 10.0))


def test_the_inner_side_passes_a_height_where_it_comes_up_to_it() -> None:
    outline = np.array([(9, 30), (8, 20), (8, 12), (7, 11), (4, 10), (1, 12), (0, 30)], dtype=np.int32)
    assert inner_crossing(outline, 12.5) == (8.0, 12.0)
