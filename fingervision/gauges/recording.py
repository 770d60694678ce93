"""All gauges of one recording: measure them frame by frame, convert them to rows, count and draw them."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
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


@dataclass(slots=True)
class Tally:
    """Summary of one gauge over the frames of a recording.

    Parameters
    ----------
    counts : Counter of str
        Number of frames with each status.
    words : dict of str to str
        Sentence of the first frame with each status, if it has one.
    least, most : dict of str to float
        Smallest and largest value of each quantity.
    """

    counts: Counter[str] = field(default_factory=Counter)
    first: dict[str, tuple[int, str]] = field(default_factory=dict)
    least: dict[str, Cell] = field(default_factory=dict)
    most: dict[str, Cell] = field(default_factory=dict)


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
                for number, (name, sort) in enumerate(gauge.quantities):
                    if number < len(reading.quantities):
                        cell = next(cells)
                        tally.least[name] = min(tally.least.get(name, cell), cell)
                        tally.most[name] = max(tally.most.get(name, cell), cell)
                        rows.append(GaugeRow(time_s, gauge.name, name, *cell, status))
                    else:
                        unit = length if sort == "length" else "mrad"
                        rows.append(GaugeRow(time_s, gauge.name, name, None, None, unit, status))
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
                    name: {
                        "least": self.tallies[gauge.name].least[name].value,
                        "greatest": self.tallies[gauge.name].most[name].value,
                        "unit": self.tallies[gauge.name].least[name].unit,
                    }
                    for name, _ in gauge.quantities
                    if name in self.tallies[gauge.name].least
                },
            }
            for gauge in self._gauges
        }


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


def gauge_sentence(name: str, gauge: Mapping[str, Any]) -> str:
    """Sentence about one gauge, from its entry in summary.json."""
    frames = sum(gauge["counts"].values())
    ranges = [
        f"{quantity} {found['least']:.4f} to {found['greatest']:.4f} {found['unit']}"
        for quantity, found in gauge["quantities"].items()
    ]
    why = [f"{gauge['counts'][status]} {status}" for status in gauge["why"]]
    words = "; ".join([*ranges, *why])
    return f"Gauge {name} ({gauge['kind']}): {gauge['counts'].get('ok', 0)} of {frames} frames; {words}."
