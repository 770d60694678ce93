"""A similar object nearby: no gauge jumps to it while its own object is covered, and every gauge finds its own object
again.
"""

from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.status import Status
from fingervision.gauges.kinds import measured_together, unread
from fingervision.gauges.picture import picture_of
from fingervision.vision.pipeline import Settings
from tests.gauges.drawn import Texture, bar, cross, disc, drawn, half_plane, seen
from tests.gauges.followed import followed, gauges_of

SHAPE, APART = (64, 110), 26.0
GAUGES = {
    "marker": 'kind="marker"\nsize_px=17\nshape="dot"',
    "cross": 'kind="marker"\nsize_px=17\nshape="cross"',
    "circle": 'kind="circle"\ndiameter_px=16',
    "edge": 'kind="edge"\ndirection_deg=0\nlength_px=30\npolarity="rising"',
    "line": 'kind="line"\nangle_deg=90\nlength_px=30\npolarity="rising"',
    "pair": 'kind="pair"\ndirection_deg=0\nlength_px=30\ndistance_px=10',
    "patch": 'kind="patch"\nwidth_px=21\nheight_px=21',
}


def _light(kind: str, xs: list[float], texture: Texture) -> np.ndarray:
    if kind == "patch":
        return sum((texture.light(SHAPE, x, 32, 0.0, 0.0) for x in xs), np.full(SHAPE, 128.0))
    thing = {
        "marker": lambda x: disc(x, 32, 4.3),
        "cross": lambda x: cross(x, 32, 0.1, 3, 7),
        "circle": lambda x: disc(x, 32, 8),
        "pair": lambda x: bar(x, 32, 0.0, 10),
    }.get(kind, lambda x: bar(x + 2.5, 32, 0.0, 5))
    return drawn(SHAPE, 60, [(thing(x), 160) for x in xs])


@pytest.mark.parametrize("kind", GAUGES)
def test_no_gauge_jumps_to_a_neighbour_while_its_own_thing_is_covered(tmp_path: Path, kind: str) -> None:
    rng = np.random.default_rng(31)
    texture = Texture(rng, 13, 3.5, 1.3)
    both, other = _light(kind, [40, 40 + APART], texture), _light(kind, [40 + APART], texture)
    gauges = gauges_of(tmp_path, f"{GAUGES[kind]}\nx_px=40\ny_px=32\nreach_px=10")
    rows = followed(gauges, [seen(light, 2.0, rng) for light in (both, both, *[other] * 5, both)])
    value = [row[0].quantities[0].in_pixels()[0] if row[0].quantities else None for row in rows]
    assert value[2:7] == [None] * 5
    assert value[1] is not None
    assert value[7] == pytest.approx(value[1], abs=0.3)


def _row(kind: str, at: float, count: int, texture: Texture) -> np.ndarray:
    return _light(kind, [at + APART * k for k in range(count)], texture)


@pytest.mark.parametrize("kind", [kind for kind in GAUGES if kind != "patch"])
def test_a_row_is_not_begun_at_a_neighbour_after_frames_without_a_value(tmp_path: Path, kind: str) -> None:
    """The first two frames show nothing; a row meanwhile moved by nearly its period, a single object by a pixel."""
    rng = np.random.default_rng(36)
    texture = Texture(rng, 13, 3.5, 1.3)
    gauges = gauges_of(tmp_path, f"{GAUGES[kind]}\nx_px=40\ny_px=32\nreach_px=10")
    nothing = _light(kind, [], texture)
    for light, is_read in ((_row(kind, 40 - 0.9 * APART, 4, texture), False), (_row(kind, 41, 1, texture), True)):
        rows = followed(gauges, [seen(picture, 2.0, rng) for picture in (nothing, nothing, light)])
        # A pair that may be of either polarity is two edges, of which each may be the other one.
        assert bool(rows[2][0].quantities) == (is_read and kind != "pair")


@pytest.mark.parametrize("kind", GAUGES)
def test_frames_that_were_not_read_count_as_motion(tmp_path: Path, kind: str) -> None:
    """A row moves by nearly its period while frames are lost: in doubt if it continues beyond the picture."""
    rng = np.random.default_rng(37)
    texture = Texture(rng, 13, 3.5, 1.3)
    gauges = gauges_of(tmp_path, f"{GAUGES[kind]}\nx_px=40\ny_px=32\nreach_px=10")
    for count, first in ((6, -1), (2, 0)):
        pictures = [seen(_row(kind, 40 + APART * first + moved, count, texture), 2.0, rng) for moved in (0.0, 24.0)]
        settings, follower = Settings(10.0), gauges[0].spec.follower()
        before, after = (picture_of(Frame(picture, 3 * k), settings) for k, picture in enumerate(pictures))
        (start,) = measured_together([follower], before)
        assert start.quantities
        for index in (1, 2):
            unread(LostFrame(index, None, Status.DAMAGED, ""), Status.DAMAGED, [follower])
        (reading,) = measured_together([follower], after)
        if reading.quantities:
            assert count == 2
            moved = reading.quantities[0].in_pixels()[0] - start.quantities[0].in_pixels()[0]
            assert moved == pytest.approx(0.0 if kind == "pair" else 24.0, abs=0.1)


def test_the_flank_of_an_edge_that_leans_is_no_neighbour(tmp_path: Path) -> None:
    """The inner faces of two fingers that turn against each other, 14.5 px apart in a picture that is turned too."""
    rng = np.random.default_rng(35)
    gauge = 'kind="pair"\nx_px=32\ny_px=32\ndirection_deg=-178.8\nlength_px=24\ndistance_px=14.5\npolarity="dark"'
    for shift in np.linspace(0.0, 0.9, 10):
        faces = [half_plane(32 + shift + side * 7.25, 32, normal) for side, normal in ((1, 0.035), (-1, np.pi + 0.007))]
        light = drawn((64, 64), 50, [(face, 190) for face in faces])
        (row,) = followed(gauges_of(tmp_path, gauge), [seen(light, 1.5, rng)])
        assert row[0].quantities, row[0].words
        assert row[0].quantities[0].in_pixels()[0] == pytest.approx(14.5, abs=0.05)
