"""The transformation of a picture to the fingers' axes and back is exact."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingervision.domain.direction import Direction
from fingervision.vision.orientation import Orientation
from fingervision.vision.outlines import in_axes


@given(direction=st.sampled_from(Direction), height=st.integers(1, 40), width=st.integers(1, 40), data=st.data())
def test_a_pixel_keeps_its_level_through_view_and_axes(
    direction: Direction, height: int, width: int, data: st.DataObject
) -> None:
    x, y = data.draw(st.integers(0, width - 1)), data.draw(st.integers(0, height - 1))
    image = np.arange(height * width, dtype=np.uint16).reshape(height, width)
    orientation = Orientation(direction, height, width)
    ((across, along),) = in_axes(np.array([[x, y]]), orientation)
    upright = orientation.view(image)
    assert upright.shape == (orientation.along_size, orientation.across_size)
    assert upright[along, across] == image[y, x]
    assert orientation.to_pixels(float(across), float(along)) == (x, y)
    assert orientation.along_to_pixels(float(along)) == (y if direction.is_vertical else x)


@pytest.mark.parametrize("direction", list(Direction))
def test_a_view_copies_nothing(direction: Direction) -> None:
    image = np.zeros((3, 5), dtype=np.uint8)
    assert np.shares_memory(Orientation(direction, 3, 5).view(image), image)


@pytest.mark.parametrize(
    ("direction", "x", "y"),
    [(Direction.UP, 2, 0), (Direction.DOWN, 2, 4), (Direction.LEFT, 0, 2), (Direction.RIGHT, 6, 2)],
)
def test_the_tips_side_of_the_picture_comes_first(direction: Direction, x: int, y: int) -> None:
    assert in_axes(np.array([[x, y]]), Orientation(direction, 5, 7))[0, 1] == 0
