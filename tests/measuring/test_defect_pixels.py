"""Dead and hot columns and pixels are learnt from a recording, and displace no edge; sharp optics are no defects."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import ndtr

from calib.calibration import BareScale
from fingervision.domain.camera import DefectPixels
from fingervision.domain.direction import Direction
from fingervision.domain.frame import Coding, Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.measuring.in_memory import measure_in_memory
from fingervision.measuring.task import Task
from fingervision.vision.defect_pixels import defect_pixels, without_defects
from fingervision.vision.pipeline import LINEAR_CAMERA, Settings, measure_frame
from tests.benchmarks.camera_artefacts.classes import BELOW_PX
from tests.benchmarks.unknown_cameras import CURVES, PX_PER_MM, Film, drawn, lossless

TASK = Task(
    BareScale(PX_PER_MM),
    below_tip_mm=BELOW_PX / PX_PER_MM,
    direction=Direction.UP,
)
RECORDING = drawn(9401, 5)


def gap_of(picture: NDArray[np.uint8], defects: Sequence[DefectPixels] = ()) -> GapMeasurement:
    camera = replace(LINEAR_CAMERA, defects=tuple(defects))
    outcome = measure_frame(Frame(picture, 0), Settings(BELOW_PX, Direction.UP, camera=camera))
    assert isinstance(outcome, GapMeasurement)
    return outcome


def spoilt(level: int, away_px: int = 0) -> tuple[Film, int]:
    """A film with a column of this level so far from the left finger's inner edge, and the column's number."""
    film = lossless(RECORDING, CURVES["linear"])
    column = round(gap_of(film.pictures[0]).left.x_px) + away_px
    for picture in film.pictures:
        picture[:, column] = level
    return film, column


@pytest.mark.parametrize("level", [0, 255], ids=["dead", "hot"])
@pytest.mark.parametrize("away_px", [-1, 0, 2])
def test_a_column_across_an_edge_displaces_nothing(level: int, away_px: int) -> None:
    film, column = spoilt(level, away_px)
    found = defect_pixels(film.pictures, 255)
    assert [(defect.x_px, defect.y_px) for defect in found] == [(column, None)]
    for picture, gap_px in zip(film.pictures, RECORDING.gap_px, strict=True):
        repaired = gap_of(picture, found)
        assert abs(repaired.gap_px - gap_px) < 0.1
        assert gap_of(np.dstack([picture] * 3), found) == repaired


def test_a_column_and_a_pixel_are_learnt_with_the_camera() -> None:
    film, column = spoilt(0)
    # Without the outer flanks nothing beside the edges can be told, and learning is quick.
    first, last = (round(edge.x_px) for edge in (gap_of(film.pictures[0]).left, gap_of(film.pictures[0]).right))
    pictures = [np.dstack([picture[:, first - 70 : last + 70]] * 3) for picture in film.pictures]
    for picture in pictures:
        picture[20, 60] = 255
    found = measure_in_memory(Film(tuple(pictures), Coding.LOSSLESS), TASK)
    line, pixel = found.summary["camera"]["defects"]["value"]
    assert [(line["x_px"], line["y_px"]), (pixel["x_px"], pixel["y_px"])] == [(column - first + 70, None), (60, 20)]
    assert pixel["excess"] > 0.1
    for result, gap_px in zip(found.results, RECORDING.gap_px, strict=True):
        assert isinstance(result.outcome, GapMeasurement)
        assert abs(result.outcome.gap_px - gap_px) < 0.1


def test_a_thin_line_through_sharp_optics_is_no_defect() -> None:
    """A scratch or wire of 0.5 px standard deviation, and one with the fingers at rest."""
    sides = np.arange(RECORDING.light[0].shape[1] + 1) - 30.5
    across = np.diff(ndtr(sides / 0.5))
    light = tuple(one * (1.0 - 0.8 * across) for one in RECORDING.light)
    for each in (light, (light[0],) * 5):
        assert not defect_pixels(lossless(replace(RECORDING, light=each), CURVES["linear"]).pictures, 255)


@pytest.mark.parametrize(("kind", "top"), [(np.uint8, 255), (np.uint16, 4095)])
def test_a_row_a_column_and_a_pixel_are_told_apart(kind: type[np.generic], top: int) -> None:
    rng = np.random.default_rng(9402)
    pictures = [(top * (0.5 + 0.01 * rng.standard_normal((100, 120)))).astype(kind) for _ in range(5)]
    for picture in pictures:
        picture[:, 50], picture[20], picture[70, 90] = 0, top, top
    found = defect_pixels(pictures, top)
    assert [(defect.x_px, defect.y_px) for defect in found] == [(50, None), (None, 20), (90, 70)]
    assert not defect_pixels([without_defects(picture, found) for picture in pictures], top)
