"""Sentences of a summary about shadows, walls, rough edges and fields: number of frames, and remedy."""

from dataclasses import replace

import pytest

from calib.calibration import BareScale
from fingervision.domain.direction import Direction
from fingervision.domain.gap import FingerEdge, GapMeasurement
from fingervision.measuring.rows import Result, RowMaker
from fingervision.measuring.series import GapSeries
from fingervision.measuring.summary import BESIDE, about_edges

EDGE = FingerEdge(100.0, 50.0, 40.0, 0.01, 0.01, 0.0, 1.0, 150.0)
PLAIN = GapMeasurement(EDGE, replace(EDGE, x_px=200.0), Direction.UP, 0.01, True)


def series_of(*outcomes: GapMeasurement) -> GapSeries:
    series, maker = GapSeries(), RowMaker(BareScale(34.0), (640, 480))
    results = [Result(k, 0.04 * k, outcome) for k, outcome in enumerate(outcomes)]
    series.add(results, maker.rows(results))
    return series


def test_plain_edges_need_no_words() -> None:
    assert about_edges(series_of(PLAIN, PLAIN)) == []


@pytest.mark.parametrize("beside", ["wall", "shadow", "glare", "motion", "trail", "sharpening"])
def test_each_kind_has_its_remedy(beside: str) -> None:
    (words,) = about_edges(series_of(replace(PLAIN, beside=beside), PLAIN))
    assert words == f"In 1 frame {BESIDE[beside]}"


def test_one_frame_may_have_several() -> None:
    both = replace(PLAIN, beside="shadow", roughness_px=0.2, fields_apart_px=1.0)
    series = series_of(both, both, replace(PLAIN, fields_apart_px=0.1))
    assert dict(series.beside) == {"shadow": 2, "roughness": 2, "interlaced": 2}
    assert all(words.startswith("In 2 frames ") for words in about_edges(series))
