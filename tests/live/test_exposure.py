"""Warnings about the light: overexposed, dark, changing; no warning for a light background behind dark fingers."""

import numpy as np
import pytest

from fingervision.domain.frame import Frame
from fingervision.live.session import Exposure


def words(*levels: int) -> str:
    exposure = Exposure()
    for index, level in enumerate(levels):
        pixels = np.full((480, 640), level, np.uint8)
        pixels[200:, 100:200] = 20 if level > 20 else 0  # a finger
        exposure.add(Frame(pixels, index))
    return exposure.words


@pytest.mark.parametrize(
    ("levels", "beginning"),
    [
        ((200,) * 5, ""),
        ((255,) * 5, ""),
        ((30,) * 5, "The picture is too dark"),
        ((200, 190, 170), "The light is changing"),
    ],
)
def test_the_light_is_judged(levels: tuple[int, ...], beginning: str) -> None:
    said = words(*levels)
    assert said.startswith(beginning)
    assert bool(said) == bool(beginning)


def test_a_white_picture_is_saturated() -> None:
    exposure = Exposure()
    exposure.add(Frame(np.full((480, 640), 255, np.uint8), 0))
    assert exposure.words.startswith("The picture is saturated")
