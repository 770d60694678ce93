"""Dead and hot columns and pixels are learnt from a recording, and displace no edge; sharp optics are no defects."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ndtr

from calib.calibration import BareScale
from fingervision.domain.direction import Direction
from fingervision.domain.frame import Coding
from fingervision.domain.gap import GapMeasurement
from fingervision.measuring.in_memory import measure_in_memory
from fingervision.measuring.task import Task
from fingervision.vision.defect_pixels import defect_pixels, without_defects
from tests.benchmarks.camera_artefacts.classes import BELOW_PX
from tests.benchmarks.unknown_cameras import CURVES, PX_PER_MM, Film, drawn, lossless

TASK = Task(BareScale(PX_PER_MM), below_tip_mm=BELOW_PX / PX_PER_MM, direction=Direction.UP)
RECORDING = drawn(9401, 5)


def inner_edge_px() -> int:
    """Column of the left finger's inner edge."""
    outcome = measure_in_memory(lossless(RECORDING, CURVES["linear"]), TASK).results[0].outcome
    assert isinstance(outcome, GapMeasurement)
    return round(outcome.left.x_px)


@pytest.mark.parametrize("level", [0, 255], ids=["dead", "hot"])
@pytest.mark.parametrize("away_px", [-1, 0, 2])
def test_a_column_across_an_edge_displaces_nothing(level: int, away_px: int) -> None:
    film, column = lossless(RECORDING, CURVES["linear"]), inner_edge_px() + away_px
    for picture in film.pictures:
        picture[:, column] = level
    measured = measure_in_memory(film, TASK)
    assert [(defect["x_px"], defect["y_px"]) for defect in measured.summary["camera"]["defects"]["value"]] == [
        (column, None)
    ]
    for result, gap_px in zip(measured.results, RECORDING.gap_px, strict=True):
        assert isinstance(result.outcome, GapMeasurement)
        assert abs(result.outcome.gap_px - gap_px) < 0.1


def test_a_hot_pixel_is_found_by_its_place() -> None:
    film = lossless(RECORDING, CURVES["linear"])
    for picture in film.pictures:
        picture[20, 30] = 255
    (found,) = measure_in_memory(film, TASK).summary["camera"]["defects"]["value"]
    assert (found["x_px"], found["y_px"]) == (30, 20)
    assert found["excess"] > 0.1


def test_a_thin_line_through_sharp_optics_is_no_defect() -> None:
    """A scratch or wire of 0.5 px standard deviation, and one with the fingers at rest."""
    sides = np.arange(RECORDING.light[0].shape[1] + 1) - 30.5
    across = np.diff(ndtr(sides / 0.5))
    light = tuple(one * (1.0 - 0.8 * across) for one in RECORDING.light)
    for each in (light, (light[0],) * 5):
        measured = measure_in_memory(lossless(replace(RECORDING, light=each), CURVES["linear"]), TASK)
        assert measured.summary["camera"]["defects"] == {"value": [], "u": None, "origin": "learnt"}


def test_colours_are_repaired_like_grey_levels() -> None:
    film, column = lossless(RECORDING, CURVES["linear"]), inner_edge_px()
    for picture in film.pictures:
        picture[:, column] = 0
    grey = measure_in_memory(film, TASK)
    colour = measure_in_memory(Film(tuple(np.dstack([each] * 3) for each in film.pictures), Coding.LOSSLESS), TASK)
    assert [each.outcome for each in colour.results] == [each.outcome for each in grey.results]


@pytest.mark.parametrize(("kind", "top"), [(np.uint8, 255), (np.uint16, 4095)])
def test_a_row_a_column_and_a_pixel_are_told_apart(kind: type[np.generic], top: int) -> None:
    rng = np.random.default_rng(9402)
    pictures = [(top * (0.5 + 0.01 * rng.standard_normal((100, 120)))).astype(kind) for _ in range(5)]
    for picture in pictures:
        picture[:, 50], picture[20], picture[70, 90] = 0, top, top
    found = defect_pixels(pictures, top)
    assert [(defect.x_px, defect.y_px) for defect in found] == [(50, None), (None, 20), (90, 70)]
    assert not defect_pixels([without_defects(picture, found) for picture in pictures], top)
