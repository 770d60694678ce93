"""Draw gauges into a picture: searched zone, result, and name of each gauge."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.gauges.gauge_file import Gauge
from fingervision.gauges.reading import Mark, Reading
from fingervision.gauges.status import GaugeStatus

# Colours (red, green, blue) of the searched zone, of a result, of a zone without a result, and behind text.
ZONE, FOUND, FAILED, BACKING = (150, 150, 150), (64, 255, 160), (255, 96, 96), (0, 0, 0)
# OpenCV draws sub-pixel positions as multiples of 1/16 px.
FRACTION = 16
USUAL_HEIGHT_PX, CROSS_PX, LETTER = 480.0, 5.0, 0.4

Canvas = NDArray[np.uint8]


def draw_gauges(canvas: Canvas, gauges: Sequence[Gauge], readings: Sequence[Reading]) -> None:
    """Draw every gauge into a colour picture, in place.

    Parameters
    ----------
    canvas : ndarray of uint8, shape (height, width, 3)
        Red, green and blue.
    gauges, readings : sequences of Gauge and Reading
        Gauges and their readings, one reading per gauge.
    """
    size = max(0.6, min(canvas.shape[:2]) / USUAL_HEIGHT_PX)
    for gauge, reading in zip(gauges, readings, strict=True):
        colour = FOUND if reading.status is GaugeStatus.OK else FAILED
        if reading.zone is not None:
            _polyline(canvas, reading.zone, ZONE if reading.status is GaugeStatus.OK else FAILED, 1)
        for mark in reading.marks:
            if len(mark.points_px) == 1:
                _cross(canvas, mark.points_px[0], colour, size)
            else:
                _polyline(canvas, mark, colour, max(1, round(size)))
        _name(canvas, gauge, reading, colour, size)


def _polyline(canvas: Canvas, mark: Mark, colour: tuple[int, int, int], width: int) -> None:
    points = np.rint(np.clip(np.array(mark.points_px) * FRACTION, -1e6, 1e6)).astype(np.int32)
    cv2.polylines(canvas, [points], False, colour, width, cv2.LINE_AA, 4)


def _cross(canvas: Canvas, point: tuple[float, float], colour: tuple[int, int, int], size: float) -> None:
    (x, y), half = point, CROSS_PX * size
    _polyline(canvas, Mark(((x - half, y), (x + half, y))), colour, max(1, round(size)))
    _polyline(canvas, Mark(((x, y - half), (x, y + half))), colour, max(1, round(size)))


def _name(canvas: Canvas, gauge: Gauge, reading: Reading, colour: tuple[int, int, int], size: float) -> None:
    """Draw the name of a gauge beside it, and the status if there is no value; legible on any background."""
    places = reading.zone.points_px if reading.zone is not None else (gauge.spec.middle_px,)
    words = gauge.name if reading.status is GaugeStatus.OK else f"{gauge.name}: {reading.status.value}"
    words = words.encode("ascii", "replace").decode()
    letter = LETTER * size
    (width, height), below = cv2.getTextSize(words, cv2.FONT_HERSHEY_SIMPLEX, letter, 1)
    x = round(min(max(max(p[0] for p in places) + 3, 0), canvas.shape[1] - width - 2))
    y = round(min(max(min(p[1] for p in places), height + 2), canvas.shape[0] - below - 2))
    cv2.rectangle(canvas, (x - 2, y - height - 2), (x + width + 2, y + below), BACKING, -1)
    cv2.putText(canvas, words, (x, y), cv2.FONT_HERSHEY_SIMPLEX, letter, colour, 1, cv2.LINE_AA)
