"""Thresholding: the two classes of grey levels, and their separation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingervision.vision.binarise import LARGE_PX, binarise, binarise_local
from fingervision.vision.grey import denoise, full_scale, to_grey


@given(dark=st.integers(0, 200), contrast=st.integers(20, 55), seed=st.integers(0, 1000))
def test_two_levels_are_told_apart_with_their_contrast(dark: int, contrast: int, seed: int) -> None:
    picture = np.full((60, 90), dark + contrast, dtype=np.uint8)
    picture[:, 30:60] = dark
    order = np.random.default_rng(seed).permutation(90)
    found = binarise(picture[:, order])
    assert np.array_equal(found.dark > 0, picture[:, order] == dark)
    assert found.contrast == contrast
    assert np.array_equal(found.light, 255 - found.dark)


def test_pure_noise_is_as_far_apart_as_the_halves_of_a_gaussian() -> None:
    noise = np.clip(np.random.default_rng(71).normal(128, 12, (480, 640)), 0, 255).astype(np.uint8)
    # 2 sqrt(2/pi) / sqrt(1 - 2/pi) = 2.65, the figure of the docstring.
    assert binarise(noise).separation == pytest.approx(2.647, abs=0.05)


@pytest.mark.parametrize("level", [0, 1, 127, 255])
def test_a_uniform_picture_has_no_contrast(level: int) -> None:
    assert binarise(np.full((30, 30), level, dtype=np.uint8)).contrast == 0.0


def test_a_large_picture_is_counted_to_the_last_pixel() -> None:
    large = np.random.default_rng(73).integers(0, 256, (1001, 2014), dtype=np.uint8)
    for part in (large[:, :1003], large[:, 5:], large[::-1]):  # rows that are no multiple of eight, views
        assert part.size > LARGE_PX
        dark = binarise(part)
        assert dark.full_scale_share == np.count_nonzero(part == 255) / part.size
        means = [part[dark.dark == side].mean() for side in (0, 255)]
        assert dark.contrast == pytest.approx(means[0] - means[1], rel=1e-12)


def test_sixteen_bits_split_like_eight() -> None:
    picture = np.random.default_rng(72).choice(np.array([40, 200], dtype=np.uint8), (64, 64))
    assert np.array_equal(binarise(picture).dark, binarise(picture.astype(np.uint16) * 257).dark)


def test_light_that_falls_to_a_fifth_hides_no_bar() -> None:
    light = np.linspace(220.0, 44.0, 400)
    picture = np.tile(light, (300, 1))
    bars = np.zeros((300, 400), dtype=bool)
    bars[:, 20:50] = bars[:, 350:380] = True
    picture[bars] *= 0.3
    dark = binarise_local(picture.astype(np.uint8)).dark > 0
    assert dark[bars].all()
    assert not dark[:, 120:300].any()


def test_denoising_takes_single_pixels_and_moves_no_edge() -> None:
    picture = np.full((40, 40), 200, dtype=np.uint8)
    picture[:, :20] = 30
    hurt = picture.copy()
    hurt[5, 5], hurt[20, 30] = 255, 0
    assert np.array_equal(denoise(hurt), picture)


@given(level=st.integers(0, 255))
def test_grey_stored_as_colour_gives_back_its_level(level: int) -> None:
    assert (to_grey(np.full((3, 3, 3), level, dtype=np.uint8)) == level).all()


def test_full_scale_is_that_of_the_depth() -> None:
    assert [full_scale(np.zeros((1, 1), t)) for t in (np.uint8, np.uint16)] == [255, 65535]
