"""Circles: errors of centre and diameter within the stated uncertainties, and no value for other shapes."""

from pathlib import Path

import numpy as np
import pytest

from fingervision.gauges.reading import GaugeStatus
from tests.gauges.drawn import Texture, bar, disc, drawn, half_plane, seen
from tests.gauges.followed import followed, gauges_of, share_within

SHAPE = (110, 110)
CIRCLE = 'kind = "circle"\nx_px = 55\ny_px = 55\ndiameter_px = 40\nreach_px = 10'


def _numbers(reading: object) -> np.ndarray:
    return np.array([quantity.in_pixels()[:2] for quantity in reading.quantities])


@pytest.mark.slow
@pytest.mark.parametrize(("radius", "level", "blur"), [(20.0, 160, 0.9), (19.0, 20, 0.5), (21.0, 160, 2.0)])
def test_centre_and_diameter(tmp_path: Path, radius: float, level: float, blur: float) -> None:
    rng = np.random.default_rng(31)
    errors, u = [], []
    gauges = gauges_of(tmp_path, CIRCLE)
    for _ in range(10):
        x, y, r = 55 + rng.uniform(-4, 4), 55 + rng.uniform(-4, 4), radius + rng.uniform(-0.5, 0.5)
        light = drawn(SHAPE, 90, [(disc(x, y, r), level)], blur)
        for _ in range(25):
            ((reading,),) = followed(gauges, [seen(light, 2.0, rng)])
            assert reading.status is GaugeStatus.OK, reading
            value, stated = _numbers(reading).T
            errors.append(value - np.array([x, y, 2 * r]))
            u.append(stated)
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    assert np.all(rms[:2] <= 0.01 * max(1.0, 70 / abs(level - 90)) * max(1.0, blur))
    assert abs(np.mean(errors, axis=0)[2]) < 0.01
    # 750 numbers of 250 pictures: 0.95 to 0.025 (three standard deviations).
    assert 0.925 <= share_within(np.ravel(errors), np.ravel(u)) <= 0.975


def test_a_disc_is_followed_and_another_within_reach_is_ambiguous(tmp_path: Path) -> None:
    rng = np.random.default_rng(32)
    places = [30.0, 38, 46, 54, 62]
    pictures = [seen(drawn(SHAPE, 90, [(disc(x, 50, 12), 160)]), 2.0, rng) for x in places]
    gauges = gauges_of(tmp_path, 'kind="circle"\nx_px=31\ny_px=50\ndiameter_px=24\nreach_px=10')
    for (reading,), x in zip(followed(gauges, pictures), places, strict=True):
        assert abs(_numbers(reading)[0, 0] - x) < 0.05
    twins = seen(drawn(SHAPE, 90, [(disc(40, 50, 6), 160), (disc(55, 50, 6), 160)]), 2.0, rng)
    gauges = gauges_of(tmp_path, 'kind="circle"\nx_px=40\ny_px=50\ndiameter_px=12\nreach_px=12')
    assert followed(gauges, [twins])[0][0].status is GaugeStatus.AMBIGUOUS


@pytest.mark.parametrize("what", ["wall", "noise", "texture", "edge", "bar", "half", "square", "cut"])
def test_no_circle_no_number(tmp_path: Path, what: str) -> None:
    rng = np.random.default_rng(33)
    gauges = gauges_of(tmp_path, CIRCLE)
    for _ in range(4):
        light = {
            "wall": lambda: np.full(SHAPE, 120.0),
            "noise": lambda: rng.normal(120, 40, SHAPE),
            "texture": lambda: Texture(rng, 75, 8, 4).light(SHAPE, 55, 55, 0.0),
            "edge": lambda: drawn(SHAPE, 60, [(half_plane(55, 55, 0.4), 160)]),
            "bar": lambda: drawn(SHAPE, 60, [(bar(55, 55, 0.4, 40), 160)]),
            "half": lambda: drawn(SHAPE, 60, [(disc(55, 55, 20), 160), (half_plane(55, 55, 0.0), 60)]),
            "square": lambda: drawn(SHAPE, 60, [(lambda x, y: 18 - np.maximum(abs(x - 55), abs(y - 55)), 160)]),
            "cut": lambda: np.roll(drawn(SHAPE, 60, [(disc(55, 55, 20), 160)]), 45, 1)[:, :100],
        }[what]()
        (reading,) = followed(gauges, [seen(light, 2.0, rng)])[0]
        assert not reading.quantities
