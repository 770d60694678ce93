"""All gauges of one recording: measure them frame by frame, convert them to rows, count and draw them."""

from array import array
from collections import Counter
from collections.abc import MutableMapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice, zip_longest
from math import nan
from pathlib import Path
from types import TracebackType
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.camera import CameraModel
from fingervision.domain.frame import Frame, LostFrame, Pixels
from fingervision.gauges.gauge_file import Gauge, check_gauges
from fingervision.gauges.kinds import measured_together, unread
from fingervision.gauges.picture import picture_of
from fingervision.gauges.plane_scale import PlaneScale
from fingervision.gauges.quantities import Cell
from fingervision.gauges.reading import GaugeStatus, Mark, Reading
from fingervision.measuring.scale import Scale
from fingervision.storage.gauge_files import GaugeRow, GaugeRows, GaugesCsv
from fingervision.vision.overlay import in_eight_bits
from fingervision.vision.pipeline import Settings

# Draw gauges into a picture: searched zone, result, and name of each gauge.


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


# Number of frames whose rows are computed together, so that lens and plane are corrected for all points at once.
FRAMES_AT_ONCE = 64


def _numbers() -> "array[float]":
    return array("d")


@dataclass(slots=True)
class Course:
    """A quantity over time, in few bytes per frame; NaN, in memory only, where a frame has no time.

    Parameters
    ----------
    unit : str
        Unit of the values.
    frame, time_s, value, u : array of float
        Number and time of each frame with a value, the value, and its standard uncertainty.
    """

    unit: str
    frame: "array[float]" = field(default_factory=_numbers)
    time_s: "array[float]" = field(default_factory=_numbers)
    value: "array[float]" = field(default_factory=_numbers)
    u: "array[float]" = field(default_factory=_numbers)

    def add(self, frame: int, time_s: float | None, value: float = 0.0, u: float = 0.0) -> None:
        """Add the next frame."""
        for column, cell in zip((self.frame, self.time_s, self.value, self.u), (frame, time_s, value, u), strict=True):
            column.append(nan if cell is None else cell)


@dataclass(slots=True)
class Tally:
    """Course of one gauge over the frames of a recording.

    Parameters
    ----------
    counts : Counter of str
        Number of frames with each status.
    first : dict of str to (int, str)
        Number of the first frame with each status, and its sentence, if it has one.
    courses : dict of str to Course
        Each quantity over time.
    start : dict of str to Cell
        First value of each quantity.
    without : Course
        Frames without a value.
    """

    counts: Counter[str] = field(default_factory=Counter)
    first: dict[str, tuple[int, str]] = field(default_factory=dict)
    courses: dict[str, Course] = field(default_factory=dict)
    without: Course = field(default_factory=lambda: Course(""))
    start: dict[str, Cell] = field(default_factory=dict)


class GaugeRecording:
    """Measures a file's gauges in the frames of one recording, in order, and writes gauges.csv.

    Parameters
    ----------
    gauges : tuple of Gauge
        Gauges read from the file.
    scale : Scale or None
        Conversion from pixels to millimetres; without a scale, all values are in pixels.
    frame_size_px : (int, int)
        Width and height of the frames.
    settings : Settings
        Settings of the measurement.
    path : Path or GaugeRows
        Path of gauges.csv, or a list in memory that receives its rows.

    Raises
    ------
    FingervisionError
        If a gauge lies outside the frames, or the table cannot be written.
    """

    def __init__(
        self, gauges: tuple[Gauge, ...], scale: Scale | None, frame_size_px: tuple[int, int], settings: Settings,
        path: Path | GaugeRows,
    ) -> None:  # fmt: skip
        check_gauges(gauges, *frame_size_px)
        self._gauges, self._settings = gauges, settings
        self._plane = None if scale is None else PlaneScale(scale, frame_size_px)
        self._followers = [gauge.spec.follower() for gauge in gauges]
        self._pending: list[tuple[float | None, int, Sequence[Reading]]] = []
        self._newest: Sequence[Reading] = ()
        self._table = path if isinstance(path, GaugeRows) else GaugesCsv(path)
        self.tallies = {gauge.name: Tally() for gauge in gauges}

    def __enter__(self) -> "GaugeRecording":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._hand_over()
        self._table.close()

    @property
    def has_numbers(self) -> bool:
        """Whether any gauge has given a value in any frame so far."""
        pending = any(reading.quantities for _, _, readings in self._pending for reading in readings)
        return pending or any(tally.counts[GaugeStatus.OK.value] for tally in self.tallies.values())

    def add(
        self, frame: Frame | LostFrame, outcome: object = None, camera: CameraModel | None = None
    ) -> Sequence[Reading]:
        """Measure the next frame.

        Parameters
        ----------
        frame : Frame or LostFrame
            The next frame.
        outcome : object
            Result of the gap measurement in this frame; if it is a `LostFrame`, the gauges reject the picture too.
        camera : CameraModel or None
            The camera as learnt from the recording; None for that of the settings.

        Returns
        -------
        sequence of Reading
            Readings in the order of the gauges.
        """
        settings = self._settings if camera is None else replace(self._settings, camera=camera)
        lost = outcome if isinstance(outcome, LostFrame) else frame
        readings: Sequence[Reading]
        if isinstance(lost, LostFrame):
            readings = unread(lost, lost.status, self._followers)
        else:
            readings = measured_together(self._followers, picture_of(lost, settings))
        self._newest = readings
        self._pending.append((frame.time_s, frame.index, readings))
        if len(self._pending) >= FRAMES_AT_ONCE:
            self._hand_over()
        return readings

    def draw(self, canvas: NDArray[np.uint8]) -> None:
        """Draw the gauges' readings of the newest frame into its picture (red, green and blue), in place."""
        draw_gauges(canvas, self._gauges, self._newest)

    def steps(self, frame: Frame) -> list[tuple[str, Pixels]]:
        """The newest frame with its gauges, as the picture of this processing step."""
        grey = in_eight_bits(frame.pixels)
        canvas = np.array(grey if grey.ndim == 3 else np.dstack([grey] * 3), dtype=np.uint8)
        self.draw(canvas)
        return [("gauges", canvas)]

    def _hand_over(self) -> None:
        pending, self._pending = self._pending, []
        quantities = [q for _, _, readings in pending for reading in readings for q in reading.quantities]
        cells = iter(cells_of(quantities, self._plane))
        rows: list[GaugeRow] = []
        length = "px" if self._plane is None else "mm"
        for time_s, index, readings in pending:
            for gauge, reading in zip(self._gauges, readings, strict=True):
                tally, status = self.tallies[gauge.name], reading.status.value
                tally.counts[status] += 1
                tally.first.setdefault(status, (index, reading.words))
                if not reading.quantities:
                    tally.without.add(index, time_s)
                found = list(islice(cells, len(reading.quantities)))
                own = gauge_rows(gauge, time_s, status, found, length, tally.start)
                rows += own
                for row in own:
                    if row.value is not None and row.u is not None:
                        course = tally.courses.setdefault(row.quantity, Course(row.unit))
                        course.add(index, time_s, row.value, row.u)
        self._table.add(rows)

    def in_words(self) -> dict[str, Any]:
        """Summary of every gauge, for summary.json."""
        return {
            gauge.name: {
                "kind": gauge.kind_name,
                "counts": dict(self.tallies[gauge.name].counts),
                "why": {
                    status: {"first_frame": index, "words": words}
                    for status, (index, words) in self.tallies[gauge.name].first.items()
                    if status != GaugeStatus.OK.value
                },
                "quantities": {
                    name: {"least": min(course.value), "greatest": max(course.value), "unit": course.unit}
                    for name, course in self.tallies[gauge.name].courses.items()
                },
            }
            for gauge in self._gauges
        }


def gauge_rows(
    gauge: Gauge,
    time_s: float | None,
    status: str,
    cells: Sequence[Cell],
    length_unit: str,
    start: MutableMapping[str, Cell],
) -> list[GaugeRow]:
    """Rows of one gauge in one frame: one for each quantity, without values where there are no cells.

    `start` are the gauge's first values, to which those of quantities that are not yet there are added.
    """
    rows = []
    for (name, sort), cell in zip_longest(gauge.quantities, cells):
        if cell is None:
            unit = length_unit if sort == "length" else "mrad"
            rows.append(GaugeRow(time_s, gauge.name, name, None, None, unit, status))
            continue
        u_motion = cell.u_motion(start.setdefault(name, cell))
        rows.append(GaugeRow(time_s, gauge.name, name, cell.value, cell.u, cell.unit, status, cell.u_random, u_motion))
    return rows


def cells_of(quantities: Sequence[Any], plane: PlaneScale | None) -> list[Cell]:
    """Values of the quantities in millimetres, or in pixels without a scale."""
    if plane is None:
        return [quantity.in_pixels() for quantity in quantities]
    points = [quantity.points_px for quantity in quantities]
    every = [point for some in points for point in some]
    flat = plane.flatten(np.array(every, dtype=np.float64).reshape(-1, 2)).tolist() if every else []
    found, first = [], 0
    for quantity, some in zip(quantities, points, strict=True):
        own = tuple((x, y) for x, y in flat[first : first + len(some)])
        found.append(quantity.on_plane(own, plane))
        first += len(some)
    return found
