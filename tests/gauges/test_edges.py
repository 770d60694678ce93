"""Edges, pairs and lines: true values, stated uncertainties, and never the value of another edge."""

from pathlib import Path

import numpy as np
import pytest

from fingervision.gauges.reading import GaugeStatus
from tests.gauges.drawn import bar, drawn, half_plane, seen
from tests.gauges.followed import followed, gauges_of, share_within

SHAPE = (110, 110)
# 95 % of n normal errors lie within 1.96 u to 2.6 standard deviations of a binomial share: 0.03 at 360.
SHARE_SLACK = 0.03


def _edge(direction_deg: float, **more: object) -> str:
    keys = {"x_px": 55, "y_px": 55, "direction_deg": direction_deg, "length_px": 40, **more}
    return 'kind = "edge"\n' + "\n".join(f"{key} = {value!r}".replace("'", '"') for key, value in keys.items())


@pytest.mark.slow
@pytest.mark.parametrize("blur_px", [0.5, 0.9, 2.5])
def test_edges_are_unbiased_and_as_sure_as_they_say(tmp_path: Path, blur_px: float) -> None:
    rng = np.random.default_rng(5)
    errors, u = [], []
    for turn in np.linspace(0, 2 * np.pi, 12, endpoint=False):
        lean, away = rng.uniform(-0.3, 0.3), rng.uniform(-3, 3)
        direction = np.array([np.cos(turn), np.sin(turn)])
        light = drawn(SHAPE, 60, [(half_plane(*(55 + away * direction), turn + lean), 160)], blur_px)
        gauges = gauges_of(tmp_path, _edge(float(np.degrees(turn))))
        truth = 55 * (direction[0] + direction[1]) + away
        for _ in range(30):
            ((reading,),) = followed(gauges, [seen(light, 2.0, rng)])
            assert reading.status is GaugeStatus.OK
            value, u_value, _unit = reading.quantities[0].in_pixels()
            errors.append(value - truth)
            u.append(u_value)
    assert abs(np.mean(errors)) < 0.002
    assert 0.95 - SHARE_SLACK <= share_within(errors, u) <= 0.95 + SHARE_SLACK


@pytest.mark.slow
@pytest.mark.parametrize("slope", [0.001, 0.004, -0.008])
def test_uneven_light_does_not_move_edges(tmp_path: Path, slope: float) -> None:
    """Light that grows by a share of itself in each pixel across the edge."""
    rng = np.random.default_rng(15)
    gauges = gauges_of(tmp_path, _edge(0))
    lit = 1.0 + slope * (np.arange(SHAPE[1]) - 55.0)
    errors, u = [], []
    for _ in range(20):
        x = 55 + rng.uniform(-3, 3)
        light = drawn(SHAPE, 60, [(half_plane(x, 55, rng.uniform(-0.2, 0.2)), 160)]) * lit
        for _ in range(10):
            ((reading,),) = followed(gauges, [seen(light, 2.0, rng)])
            assert reading.status is GaugeStatus.OK
            value, u_value, _unit = reading.quantities[0].in_pixels()
            errors.append(value - x)
            u.append(u_value)
    # 200 numbers of 20 pictures: 0.95 to three standard deviations.
    assert share_within(errors, u) >= 0.95 - 0.046
    assert float(np.sqrt(np.mean(np.square(errors)))) < 0.012


@pytest.mark.slow
def test_line_angles_reach_their_bound(tmp_path: Path) -> None:
    rng = np.random.default_rng(6)
    errors, u, length, blur = [], [], 60.0, 0.9
    for angle in np.linspace(-170, 170, 18):
        lean = rng.uniform(-0.1, 0.1)
        light = drawn(SHAPE, 60, [(half_plane(55, 55, np.radians(angle) - np.pi / 2 + lean), 160)], blur)
        gauges = gauges_of(tmp_path, f'kind="line"\nx_px=55\ny_px=55\nangle_deg={angle}\nlength_px={length}\n')
        for _ in range(20):
            ((reading,),) = followed(gauges, [seen(light, 2.0, rng)])
            value, u_value, unit = reading.quantities[1].in_pixels()
            assert unit == "mrad"
            errors.append(value - 1e3 * (np.radians(angle) + lean))
            u.append(u_value)
    # Of a step whose levels and blur are known; rounding adds a twelfth of a level squared.
    sigma_e = np.sqrt(blur**2 + 1 / 12)
    bound = 1e3 * np.sqrt((4 + 1 / 12) / 100**2 * 12 / length**3 * 2 * np.sqrt(np.pi) * sigma_e)
    rms = float(np.sqrt(np.mean(np.square(errors))))
    assert rms <= 1.2 * bound
    assert 0.95 - SHARE_SLACK <= share_within(errors, u) <= 0.95 + SHARE_SLACK


@pytest.mark.slow
@pytest.mark.parametrize(("width_px", "level"), [(30.0, 160.0), (9.0, 160.0), (5.0, 20.0)])
def test_pairs_near_and_far(tmp_path: Path, width_px: float, level: float) -> None:
    rng = np.random.default_rng(7)
    errors, u = [], []
    for turn in np.linspace(0, np.pi, 8, endpoint=False):
        width = width_px + rng.uniform(-0.5, 0.5)
        light = drawn(SHAPE, 90, [(bar(55 + rng.uniform(-1, 1), 55, turn, width), level)], 0.9)
        keys = f"x_px=55\ny_px=55\ndirection_deg={np.degrees(turn)}\nlength_px=30\nreach_px={0.4 * width_px}"
        gauges = gauges_of(tmp_path, f'kind="pair"\ndistance_px={width_px}\n{keys}')
        for _ in range(30):
            ((reading,),) = followed(gauges, [seen(light, 2.0, rng)])
            assert reading.status is GaugeStatus.OK, reading
            value, u_value, _unit = reading.quantities[0].in_pixels()
            errors.append(value - width)
            u.append(u_value)
    assert abs(np.mean(errors)) < 0.01
    assert 0.95 - 0.035 <= share_within(errors, u) <= 0.95 + 0.035


def test_an_edge_is_followed_where_it_goes_and_turns(tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    places = 40 + 4.7 * np.arange(7)
    turns = 0.06 * np.arange(7)
    lights = [drawn(SHAPE, 60, [(half_plane(x, 55, turn), 160)]) for x, turn in zip(places, turns, strict=True)]
    gauges = gauges_of(
        tmp_path,
        'kind="edge"\nx_px=40\ny_px=55\ndirection_deg=0\nlength_px=30\nreach_px=6',
        'kind="line"\nx_px=40\ny_px=55\nangle_deg=90\nlength_px=30\nreach_px=6',
    )
    rows = followed(gauges, [seen(light, 2.0, rng) for light in lights])
    for (edge, line), x, turn in zip(rows, places, turns, strict=True):
        assert abs(edge.quantities[0].in_pixels().value - x) < 0.06
        assert abs(line.quantities[0].in_pixels().value - x) < 0.06
        assert abs(line.quantities[1].in_pixels().value - 1e3 * (np.pi / 2 + turn)) < 6


def test_two_edges_within_reach_are_ambiguous_until_the_polarity_tells_them_apart(tmp_path: Path) -> None:
    rng = np.random.default_rng(9)
    picture = seen(drawn(SHAPE, 60, [(bar(55, 55, 0.0, 8.0), 160)]), 2.0, rng)
    readings = followed(
        gauges_of(tmp_path, _edge(0), _edge(0, polarity="rising"), _edge(0, x_px=59, reach_px=3.0)), [picture]
    )[0]
    assert [reading.status.value for reading in readings] == ["ambiguous", "ok", "ok"]
    assert abs(readings[1].quantities[0].in_pixels().value - 51) < 0.05
    assert abs(readings[2].quantities[0].in_pixels().value - 59) < 0.05


def test_the_neighbour_is_never_taken(tmp_path: Path) -> None:
    """A comb of bars that jumps by up to 1.5 times the stated motion: the value of the right edge, or none."""
    rng = np.random.default_rng(10)
    period = 20.0
    start = drawn(SHAPE, 60, [(bar(55 + k * period, 55, 0.0, 10.0), 160) for k in range(-3, 4)])
    for jump in np.arange(0.7, 13.6, 2.6):
        moved = drawn(SHAPE, 60, [(bar(55 + jump + k * period, 55, 0.0, 10.0), 160) for k in range(-6, 4)])
        gauges = gauges_of(tmp_path, _edge(0, x_px=60, reach_px=9.0, polarity="falling"))
        first, second = followed(gauges, [seen(start, 2.0, rng), seen(moved, 2.0, rng)])
        assert first[0].quantities
        if second[0].quantities:
            assert abs(second[0].quantities[0].in_pixels().value - 60 - jump) < 0.06


def test_the_neighbour_is_not_taken_after_a_frame_without_an_edge(tmp_path: Path) -> None:
    """A comb that moves by up to the stated motion in each frame, one of which shows nothing."""
    rng = np.random.default_rng(14)
    period, reach_px = 14.0, 7.0
    nothing = seen(np.full(SHAPE, 60.0), 2.0, rng)
    numbers = 0
    for moved_px in (0.3, 3.0, 12.0, 13.0, 13.8):
        start, end = (
            seen(drawn(SHAPE, 60, [(bar(55 + at + k * period, 55, 0.0, 7.0), 160) for k in range(-6, 7)]), 2.0, rng)
            for at in (0.0, moved_px)
        )
        gauges = gauges_of(tmp_path, _edge(0, x_px=58.5, reach_px=reach_px, polarity="falling"))
        rows = followed(gauges, [start, nothing, end, end])
        assert rows[0][0].quantities
        for (reading,) in rows[2:]:
            numbers += bool(reading.quantities)
            assert not reading.quantities or abs(reading.quantities[0].in_pixels().value - 58.5 - moved_px) < 0.06
    assert numbers == 0  # the edge may have moved by a period meanwhile


@pytest.mark.parametrize("what", ["wall", "noise", "speckle", "shade", "black", "white"])
def test_where_there_is_no_edge_there_is_no_number(tmp_path: Path, what: str) -> None:
    rng = np.random.default_rng(11)
    gauges = gauges_of(
        tmp_path, _edge(0), _edge(45, polarity="rising"),
        'kind="pair"\nx_px=55\ny_px=55\ndirection_deg=90\ndistance_px=20\nlength_px=30',
        'kind="line"\nx_px=55\ny_px=55\nangle_deg=30\nlength_px=50',
    )  # fmt: skip
    numbers = 0
    for _ in range(12):
        light = {
            "wall": np.full(SHAPE, 120.0),
            "noise": rng.normal(120, 40, SHAPE),
            "speckle": np.kron(rng.uniform(30, 220, (22, 22)), np.ones((5, 5))),
            "shade": 60 + np.add.outer(np.arange(110), np.arange(110)) * 0.7,
            "black": np.zeros(SHAPE),
            "white": np.full(SHAPE, 400.0),
        }[what]
        (readings,) = followed(gauges, [seen(light, 0.0 if what in ("black", "white") else 2.0, rng)])
        numbers += sum(bool(reading.quantities) for reading in readings)
    assert numbers == 0


def test_an_edge_that_leaves_the_picture_and_comes_back(tmp_path: Path) -> None:
    rng = np.random.default_rng(12)
    places = [20.0, 14.0, 8.0, 2.0, -4.0, -4.0, 2.0, 8.0, 14.0, 20.0]
    pictures = [seen(drawn(SHAPE, 60, [(half_plane(x, 55, 0.0), 160)]), 2.0, rng) for x in places]
    rows = followed(gauges_of(tmp_path, _edge(0, x_px=20, reach_px=8.0)), pictures)
    statuses = [row[0].status.value for row in rows]
    assert statuses[0] == statuses[1] == statuses[-1] == "ok"
    assert "ok" not in statuses[3:7]
    for (reading,), x in zip(rows, places, strict=True):
        assert not reading.quantities or abs(reading.quantities[0].in_pixels().value - x) < 0.06


def test_an_edge_beyond_the_scale_is_saturated(tmp_path: Path) -> None:
    rng = np.random.default_rng(13)
    picture = seen(drawn(SHAPE, 60, [(half_plane(55.3, 55, 0.0), 460)], 1.2), 2.0, rng)
    (reading,) = followed(gauges_of(tmp_path, _edge(0)), [picture])[0]
    assert reading.status is GaugeStatus.SATURATED
