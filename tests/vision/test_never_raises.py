"""For any pixel values, a frame gives a gap with its uncertainty, or the reason why there is none."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fingervision.domain.direction import Direction
from fingervision.domain.frame import Coding, Frame, Pixels, Region
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.domain.status import Status
from fingervision.vision.pipeline import Settings, measure_frame

directions = st.none() | st.sampled_from(Direction)
heights = st.floats(0.5, 60.0)


def _is_sound(pixels: Pixels, settings_: Settings, coding: Coding = Coding.LOSSLESS) -> None:
    before = pixels.copy()
    found = measure_frame(Frame(pixels, 0, coding=coding), settings_)
    assert np.array_equal(before, pixels)
    if isinstance(found, GapMeasurement):
        numbers = (found.gap_px, found.u_gap_px, found.left.x_px, found.left.y_px, found.right.x_px, found.right.y_px)
        assert np.isfinite(numbers).all()
        assert found.u_gap_px > 0
    else:
        assert isinstance(found, NoGap)
        assert found.status is not Status.OK


@given(
    pixels=st.sampled_from([np.uint8, np.uint16]).flatmap(
        lambda t: arrays(t, st.tuples(st.integers(1, 30), st.integers(1, 30)))
    ),
    direction=directions,
    below=heights,
)
def test_small_arbitrary_pictures(pixels: Pixels, direction: Direction | None, below: float) -> None:
    _is_sound(pixels, Settings(below, direction))


@settings(max_examples=60)
@given(
    seed=st.integers(0, 10**6),
    size=st.tuples(st.integers(40, 220), st.integers(40, 220)),
    bars=st.integers(0, 9),
    spread=st.sampled_from([0.0, 0.3, 3.0, 20.0]),
    depth=st.sampled_from([np.uint8, np.uint16]),
    colour=st.booleans(),
    direction=directions,
    below=heights,
    coding=st.sampled_from(Coding),
)
def test_structured_junk(
    seed: int, size: tuple[int, int], bars: int, spread: float, depth: type, colour: bool,
    direction: Direction | None, below: float, coding: Coding,
) -> None:  # fmt: skip
    rng = np.random.default_rng(seed)
    picture = np.full(size, rng.uniform(0, 1))
    for _ in range(bars):
        y, x = rng.integers(-20, size[0]), rng.integers(-20, size[1])
        high, wide = rng.integers(1, size[0] + 20), rng.integers(1, 60)
        picture[max(y, 0) : max(y + high, 0), max(x, 0) : max(x + wide, 0)] = rng.choice([0.0, 1.0, rng.random()])
    picture = picture + rng.normal(0, spread / 255, size)
    top = np.iinfo(depth).max
    pixels = (np.clip(picture, 0, 1) * top).astype(depth)
    _is_sound(np.dstack([pixels] * 3) if colour else pixels, Settings(below, direction), coding)


@given(seed=st.integers(0, 10**6), x=st.integers(0, 90), y=st.integers(0, 90))
def test_any_region_inside_the_frame(seed: int, x: int, y: int) -> None:
    rng = np.random.default_rng(seed)
    pixels = np.where(rng.random((100, 100)) < 0.5, 40, 200).astype(np.uint8)
    pixels[30:, 10:35] = pixels[30:, 60:85] = 20
    width, height = int(rng.integers(1, 101 - x)), int(rng.integers(1, 101 - y))
    _is_sound(pixels, Settings(5.0, None, Region(x, y, width, height)))
