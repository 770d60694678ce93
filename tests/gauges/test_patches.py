"""Patches: true shift and rotation, stated uncertainty, and no value if the patch is not in view."""

from pathlib import Path

import numpy as np
import pytest
import skimage.data
from scipy.ndimage import gaussian_filter

from fingervision.gauges.reading import GaugeStatus
from tests.benchmarks.drawn_surfaces import SURFACES
from tests.gauges.drawn import Texture, seen
from tests.gauges.followed import followed, gauges_of, share_within

SHAPE = (110, 110)
PATCH = 'kind = "patch"\nx_px = 55\ny_px = 55\nwidth_px = 31\nheight_px = 31\nreach_px = 8'


def _numbers(reading: object) -> np.ndarray:
    return np.array([quantity.in_pixels()[:2] for quantity in reading.quantities])


@pytest.mark.slow
def test_shift_and_rotation_are_true_and_as_sure_as_they_say(tmp_path: Path) -> None:
    rng = np.random.default_rng(21)
    errors, u = [], []
    gauges = gauges_of(tmp_path, PATCH)
    for number in range(40):
        texture = Texture(rng, 60, rng.uniform(3, 5), rng.uniform(1.0, 2.0))
        x, y, turn = 55 + rng.uniform(-3, 3), 55 + 0.1 * (number % 10), rng.uniform(-0.08, 0.08)
        still, moved = texture.light(SHAPE, 55, 55, 0.0), texture.light(SHAPE, x, y, turn)
        for noise in (1.0, 3.0, 6.0):
            first, second = followed(gauges, [seen(still, noise, rng), seen(moved, noise, rng)])
            assert np.all(_numbers(first[0]) == 0.0)
            assert second[0].status is GaugeStatus.OK, second
            value, stated = _numbers(second[0]).T
            errors += list(value - np.array([x - 55, y - 55, 1e3 * turn]))
            u += list(stated)
    # 360 numbers, three of a patch: a share of 0.95 is known to 0.03 (2.6 standard deviations).
    assert 0.92 <= share_within(errors, u) <= 0.98


def test_a_patch_is_followed_and_turned_far(tmp_path: Path) -> None:
    rng = np.random.default_rng(22)
    texture = Texture(rng, 60)
    steps = [(55 + 2.3 * k, 55 - 1.7 * k, 0.06 * k) for k in range(12)]
    pictures = [seen(texture.light(SHAPE, *step), 2.0, rng) for step in steps]
    for (reading,), (x, y, turn) in zip(followed(gauges_of(tmp_path, PATCH), pictures), steps, strict=True):
        assert reading.status is GaugeStatus.OK
        assert np.allclose(_numbers(reading)[:, 0], [x - 55, y - 55, 1e3 * turn], atol=[0.05, 0.05, 4])


def test_the_point_that_is_reported_is_the_one_that_was_drawn(tmp_path: Path) -> None:
    rng = np.random.default_rng(23)
    texture = Texture(rng, 60)
    turn, off = 0.12, np.array([0.4, -0.3])
    gauges = gauges_of(tmp_path, PATCH.replace("x_px = 55", "x_px = 55.4").replace("y_px = 55", "y_px = 54.7"))
    rows = followed(gauges, [seen(texture.light(SHAPE, 55, 55, a), 1.0, rng) for a in (0.0, turn)])
    turned = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    assert np.allclose(_numbers(rows[1][0])[:2, 0], turned @ off - off, atol=0.02)


@pytest.mark.parametrize("name", ["gravel", "grass"])
def test_photographed_textures_moved_by_tenths_of_a_pixel(tmp_path: Path, name: str) -> None:
    """Photographs of 512 px, moved by whole pixels and binned: shifts of an eighth of a pixel, known exactly."""
    scene, by = np.asarray(getattr(skimage.data, name)(), dtype=float), 8
    rng = np.random.default_rng(24)
    gauges = gauges_of(tmp_path, 'kind="patch"\nx_px=28\ny_px=28\nwidth_px=31\nheight_px=31\nreach_px=4')

    def camera(shift: int) -> np.ndarray:
        part = np.roll(scene, shift, axis=1)[:456, 16 : 16 + 456]
        return seen(part.reshape(57, by, 57, by).mean(axis=(1, 3)), 0.5, rng)

    for shift in range(1, by):
        rows = followed(gauges, [camera(0), camera(shift)])
        assert rows[1][0].status is GaugeStatus.OK
        assert abs(_numbers(rows[1][0])[0, 0] - shift / by) < 0.05


@pytest.mark.parametrize(
    ("surface", "blur", "most_px"), [("letters", 0.7, 0.004), ("confetti", 0.0, 0.02), ("masonry", 0.4, 0.03)]
)
def test_sharp_surfaces_are_as_sure_as_they_say_at_every_phase(
    tmp_path: Path, surface: str, blur: float, most_px: float
) -> None:
    """Surfaces drawn ten times finer than the pixels, moved by tenths of a pixel, with optics and without any.

    Interpolation biases the first by the phase, aliasing the others, and joints along the pixels all by one phase.
    """
    rng = np.random.default_rng([25, len(surface)])
    gauges = gauges_of(tmp_path, 'kind="patch"\nx_px=24\ny_px=24\nwidth_px=31\nheight_px=31\nreach_px=3')
    errors, u = [], []
    for _ in range(4):
        scene = gaussian_filter(SURFACES[surface](rng), 10 * blur, mode="wrap")
        scene = 128 + (scene - scene.mean()) * 40 / scene.std()

        def camera(x: int, y: int, scene: np.ndarray = scene) -> np.ndarray:
            part = np.roll(scene, (y, x), axis=(0, 1))[:490, :490]
            return seen(part.reshape(49, 10, 49, 10).mean(axis=(1, 3)), 0.3, rng)

        places = [(0, 0), *((x, int(rng.integers(-9, 10))) for x in (2, 3, 7, 8))]
        for (x, y), (reading,) in zip(places[1:], followed(gauges, [camera(*at) for at in places])[1:], strict=True):
            if reading.quantities:
                value, stated = _numbers(reading)[:2].T
                errors += list(value - (0.1 * x, 0.1 * y))
                u += list(stated)
    assert len(errors) > 16
    assert np.sqrt(np.mean(np.square(errors))) < most_px
    assert share_within(errors, u) > 0.9


def test_texture_finer_than_the_pixels_is_refused(tmp_path: Path) -> None:
    """Joints of 0.4 px without optics stay in their pixels until they jump: no shift follows from them."""
    rng = np.random.default_rng(28)
    gauges = gauges_of(tmp_path, 'kind="patch"\nx_px=24\ny_px=24\nwidth_px=31\nheight_px=31\nreach_px=3')
    scene = SURFACES["masonry"](rng)
    scene = 128 + (scene - scene.mean()) * 40 / scene.std()
    parts = [np.roll(scene, (x, 3 * x), axis=(0, 1))[:490, :490] for x in range(6)]
    pictures = [seen(part.reshape(49, 10, 49, 10).mean(axis=(1, 3)), 0.3, rng) for part in parts]
    for (reading,) in followed(gauges, pictures)[1:]:
        assert reading.status is GaugeStatus.LOW_CONTRAST
        assert "finer than the pixels" in reading.words


@pytest.mark.parametrize("what", ["wall", "noise", "shade", "edge", "lattice", "black"])
def test_what_cannot_be_registered_gives_a_status(tmp_path: Path, what: str) -> None:
    rng = np.random.default_rng(25)
    y, x = np.mgrid[:110, :110]
    light = {
        "wall": np.full(SHAPE, 120.0),
        "noise": np.full(SHAPE, 120.0),
        "shade": 60 + 0.7 * (x + y) + 1e-3 * (x - 55) ** 2,
        "edge": np.where(x + 0.2 * y > 66, 160.0, 60.0),
        "lattice": 120 + 60 * np.sin(2 * np.pi * x / 9) * np.sin(2 * np.pi * y / 9),
        "black": np.zeros(SHAPE),
    }[what]
    noise = {"noise": 30.0, "black": 0.0}.get(what, 2.0)
    rows = followed(gauges_of(tmp_path, PATCH), [seen(light, noise, rng) for _ in range(10)])
    assert not any(reading.quantities for (reading,) in rows)


@pytest.mark.parametrize("what", ["gone", "other", "mirrored", "far", "noise"])
def test_a_patch_that_is_not_there_has_no_number(tmp_path: Path, what: str) -> None:
    rng = np.random.default_rng(26)
    texture = Texture(rng, 75)
    first = texture.light(SHAPE, 55, 55, 0.0)
    numbers = 0
    gauges = gauges_of(tmp_path, PATCH)
    for _ in range(6):
        light = {
            "gone": lambda: np.full(SHAPE, 128.0),
            "other": lambda: Texture(rng, 75).light(SHAPE, 55, 55, 0.0),
            "mirrored": lambda: first[:, ::-1],
            "far": lambda: texture.light(SHAPE, 55 + 21, 55, 0.0),
            "noise": lambda: rng.normal(128, 40, SHAPE),
        }[what]()
        rows = followed(gauges, [seen(first, 2.0, rng), seen(light, 2.0, rng)])
        assert rows[0][0].status is GaugeStatus.OK
        numbers += bool(rows[1][0].quantities)
    assert numbers == 0


def test_a_patch_that_leaves_the_picture_says_so(tmp_path: Path) -> None:
    rng = np.random.default_rng(27)
    texture = Texture(rng, 75)
    places = [55.0, 49, 43, 37, 31, 25, 19, 13, 7, 1, 7, 13, 19, 25]
    rows = followed(gauges_of(tmp_path, PATCH), [seen(texture.light(SHAPE, x, 55, 0.0), 2.0, rng) for x in places])
    for (reading,), x in zip(rows, places, strict=True):
        assert not reading.quantities or abs(_numbers(reading)[0, 0] - (x - 55)) < 0.05
    assert rows[4][0].quantities
    assert rows[8][0].status is GaugeStatus.OUT_OF_VIEW
    assert rows[-1][0].quantities
