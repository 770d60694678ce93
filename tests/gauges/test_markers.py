"""Marks: errors of the centres of dots, crosses and chessboard corners within the stated uncertainties; other shapes
are refused.
"""

from pathlib import Path

import numpy as np
import pytest

from fingervision.gauges.reading import GaugeStatus
from tests.gauges.drawn import Texture, bar, checker, cross, disc, drawn, half_plane, seen
from tests.gauges.followed import followed, gauges_of, share_within

SHAPE = (90, 90)


def _mark(shape: str, size: int = 25, reach: float = 8.0) -> str:
    return f'kind = "marker"\nx_px = 45\ny_px = 45\nsize_px = {size}\nshape = "{shape}"\nreach_px = {reach}'


def _thing(shape: str, x: float, y: float, turn: float) -> object:
    if shape == "dot":
        return disc(x, y, 6.3)
    return cross(x, y, turn, 4.0, 9.0) if shape == "cross" else checker(x, y, turn)


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["dot", "cross", "corner"])
def test_the_middle_is_true_and_as_sure_as_it_says(tmp_path: Path, shape: str) -> None:
    rng = np.random.default_rng(41)
    errors, u = [], []
    gauges = gauges_of(tmp_path, _mark(shape))
    for _ in range(12):
        x, y = 45 + rng.uniform(-3, 3, 2)
        light = drawn(SHAPE, 60, [(_thing(shape, x, y, rng.uniform(-0.5, 0.5)), 160)])
        for _ in range(15):
            ((reading,),) = followed(gauges, [seen(light, 2.0, rng)])
            assert reading.status is GaugeStatus.OK, reading
            for quantity, truth in zip(reading.quantities, (x, y), strict=True):
                value, stated, _ = quantity.in_pixels()
                errors.append(value - truth)
                u.append(stated)
    assert abs(np.mean(errors)) < 0.003
    # 360 numbers: 0.95 to 0.03.
    assert 0.92 <= share_within(errors, u) <= 0.98


def test_a_mark_is_followed(tmp_path: Path) -> None:
    rng = np.random.default_rng(42)
    places = [(45 + 3.3 * k, 45 - 2.1 * k, 0.03 * k) for k in range(5)]
    for shape in ("dot", "cross", "corner"):
        pictures = [seen(drawn(SHAPE, 60, [(_thing(shape, *place), 160)]), 2.0, rng) for place in places]
        for (reading,), (x, y, _) in zip(
            followed(gauges_of(tmp_path, _mark(shape, 21)), pictures), places, strict=True
        ):
            assert reading.status is GaugeStatus.OK
            assert abs(reading.quantities[0].in_pixels().value - x) < 0.05
            assert abs(reading.quantities[1].in_pixels().value - y) < 0.05


def test_another_like_it_within_reach_is_ambiguous(tmp_path: Path) -> None:
    rng = np.random.default_rng(43)
    picture = seen(drawn(SHAPE, 60, [(disc(45, 45, 3), 160), (disc(56, 45, 3), 160)]), 2.0, rng)
    readings = followed(gauges_of(tmp_path, _mark("dot", 11, 10), _mark("dot", 11, 5)), [picture])[0]
    assert [reading.status.value for reading in readings] == ["ambiguous", "ok"]


def test_a_mark_that_is_covered_in_part_is_not_displaced(tmp_path: Path) -> None:
    """The covering object has the level of the background, so that the visible rest looks like a mark, too."""
    rng = np.random.default_rng(45)
    lights = [
        drawn(SHAPE, 60, [(disc(45, 45, 6.3), 160), (half_plane(edge, 45, np.pi), 60)]) for edge in (30, 30, 40, 42, 44)
    ]
    rows = followed(gauges_of(tmp_path, _mark("dot", 25, 8)), [seen(light, 2.0, rng) for light in lights])
    assert [bool(reading.quantities) for (reading,) in rows] == [True, True, False, False, False]


@pytest.mark.parametrize("what", ["wall", "noise", "texture", "edge", "bar", "shade", "others"])
def test_what_is_no_mark_has_no_number(tmp_path: Path, what: str) -> None:
    rng = np.random.default_rng(44)
    gauges = gauges_of(tmp_path, *(_mark(shape) for shape in ("dot", "cross", "corner")))
    numbers = 0
    for _ in range(2):
        light = {
            "wall": lambda: np.full(SHAPE, 120.0),
            "noise": lambda: rng.normal(120, 40, SHAPE),
            "texture": lambda: Texture(rng, 75, 6, 3).light(SHAPE, 45, 45, 0.0),
            "edge": lambda: drawn(SHAPE, 60, [(half_plane(45, 45, 0.4), 160)]),
            "bar": lambda: drawn(SHAPE, 60, [(bar(45, 45, 0.4, 8), 160)]),
            "shade": lambda: 60 + np.add.outer(np.arange(90), np.arange(90)) * 0.8,
            "others": lambda: drawn(SHAPE, 60, [(lambda x, y: 8 - np.maximum(abs(x - 45), abs(y - 45) * 2), 160)]),
        }[what]()
        (readings,) = followed(gauges, [seen(light, 2.0, rng)])
        numbers += sum(bool(reading.quantities) for reading in readings)
    assert numbers == 0
