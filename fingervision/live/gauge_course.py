"""Readings of the gauges over time, for the page's charts and for gauges.csv."""

import json
import zlib
from bisect import bisect_left
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from threading import Lock
from typing import Any

from fingervision.gauges.gauge_file import Gauge
from fingervision.gauges.plane_scale import PlaneScale
from fingervision.gauges.quantities import Cell
from fingervision.gauges.reading import MEANING, Mark, Reading
from fingervision.gauges.recording import cells_of, gauge_rows
from fingervision.storage.gauge_files import GaugeRow

UNITS = {"length": "mm", "angle": "mrad"}
"""Unit of each sort of quantity in the page, which has no readings without a scale."""


@dataclass(frozen=True, slots=True)
class Entry:
    """Readings in one frame, compressed, because a recording has many frames.

    Parameters
    ----------
    frame : int
        Number of the frame.
    time_s : float or None
        Presentation time.
    version : int
        Version of the gauges.
    packed : bytes
        The readings.
    """

    frame: int
    time_s: float | None
    version: int
    packed: bytes

    @property
    def readings(self) -> list[dict[str, Any]]:
        """The readings as `told` gave them."""
        found: list[dict[str, Any]] = json.loads(zlib.decompress(self.packed))
        return found


class GaugeCourse:
    """Readings frame by frame, added by one thread and read by others.

    Parameters
    ----------
    most : int or None
        Number of frames that are kept; None keeps all.
    """

    def __init__(self, most: int | None = None) -> None:
        self._lock, self._most = Lock(), most
        self._entries: list[Entry] = []
        self._gone = self._begun = 0

    def begin(self) -> None:
        """Forget all readings."""
        with self._lock:
            self._entries, self._gone, self._begun = [], 0, self._begun + 1

    def add(self, frame: int, time_s: float | None, version: int, readings: Sequence[Mapping[str, Any]]) -> None:
        """Add the next frame."""
        entry = Entry(frame, time_s, version, zlib.compress(json.dumps(readings).encode()))
        with self._lock:
            self._entries.append(entry)
            if self._most is not None and len(self._entries) > 1.25 * self._most:
                self._gone += len(self._entries) - self._most
                self._entries = self._entries[-self._most :]

    @property
    def frames(self) -> int:
        """Number of frames so far."""
        return self._gone + len(self._entries)

    def find(self, frame: int) -> Entry | None:
        """Readings in a frame; None if there are none."""
        with self._lock:
            place = bisect_left(self._entries, frame, key=lambda entry: entry.frame)
            found = self._entries[place : place + 1]
        return found[0] if found and found[0].frame == frame else None

    def after(self, begun: int, known: int, most: int) -> tuple[int, int, list[Entry]]:
        """What somebody who knows some frames does not know yet.

        Parameters
        ----------
        begun, known : int
            Number of times that the readings had begun, and number of frames that are known of these.
        most : int
            Largest number of frames to return.

        Returns
        -------
        begun : int
            Number of times that the readings have begun; if it is another than before, all earlier ones are void.
        first : int
            Number of frames before those returned.
        entries : list of Entry
            The frames.
        """
        with self._lock:
            first = max(0, known - self._gone) if begun == self._begun else 0
            found = self._entries[first : first + most]
            return self._begun, self._gone + first, found

    def rows(self, gauges: Mapping[int, Gauge]) -> list[GaugeRow]:
        """Rows of gauges.csv, of the gauges with these numbers."""
        _, _, entries = self.after(-1, 0, self.frames)
        start: dict[int, dict[str, Cell]] = defaultdict(dict)
        rows: list[GaugeRow] = []
        for entry in entries:
            for each in entry.readings:
                number, cells = each["id"], [Cell(*cell[1:]) for cell in each["cells"]]
                if (gauge := gauges.get(number)) is not None:
                    rows += gauge_rows(gauge, entry.time_s, each["status"], cells, UNITS["length"], start[number])
        return rows


def told(gauges: Mapping[int, Gauge], readings: Sequence[Reading], plane: PlaneScale) -> list[dict[str, Any]]:
    """Convert the readings in one frame, of gauges by their numbers, to the form that the browser page displays."""
    found: list[dict[str, Any]] = []
    for (number, gauge), reading in zip(gauges.items(), readings, strict=True):
        cells = cells_of(reading.quantities, plane)
        found.append(
            {
                "id": number,
                "name": gauge.name,
                "status": reading.status.value,
                "words": reading.words or MEANING.get(reading.status, ""),
                "cells": [[name, *cell] for (name, _), cell in zip(gauge.quantities, cells, strict=False)],
                "zone": _points(reading.zone),
                "marks": [_points(mark) for mark in reading.marks],
            }
        )
    return found


def _points(mark: Mark | None) -> list[tuple[float, float]]:
    return [] if mark is None else [(round(float(x), 2), round(float(y), 2)) for x, y in mark.points_px]


def for_charts(course: GaugeCourse, gauges: Mapping[int, Gauge], begun: int, known: int, most: int) -> dict[str, Any]:
    """Frames that a page does not know yet, for its charts.

    Returns
    -------
    dict
        `begun` and `first` as `GaugeCourse.after` returns them; `known`: number of frames with those here; `gauges`:
        number, name, and quantities with units; `rows`: time (or frame number), frame number, and of each gauge its
        number, status ("" for ok), and value, uncertainty and its random part of each quantity.
    """
    begun, first, entries = course.after(begun, known, most)
    return {
        "begun": begun,
        "first": first,
        "known": first + len(entries),
        "gauges": [
            [number, gauge.name, [[name, UNITS[sort]] for name, sort in gauge.quantities]]
            for number, gauge in gauges.items()
        ],
        "rows": [
            [
                entry.frame if entry.time_s is None else entry.time_s,
                entry.frame,
                [
                    [
                        each["id"],
                        "" if each["status"] == "ok" else each["status"],
                        *(number for _, value, u, _, u_random, *_ in each["cells"] for number in (value, u, u_random)),
                    ]
                    for each in entry.readings
                ],
            ]
            for entry in entries
        ],
    }
