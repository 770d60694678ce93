"""Compose a message to the browser page: changes since the last message, and the newest picture with measured edges."""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from time import monotonic
from typing import Any

import numpy as np
import simplejpeg

from fingervision.domain.direction import Direction
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.domain.status import Status
from fingervision.live.commands import section
from fingervision.live.frame_measurement import Seen
from fingervision.live.gauge_course import for_charts
from fingervision.live.page_words import page_json
from fingervision.live.playback.gauge_following import GAUGES, GaugesBeside
from fingervision.live.playback.playback import Playback
from fingervision.live.playback.saved_page import MOST_BYTES, saved_page, seen_at
from fingervision.live.view import View
from fingervision.storage.gaps_csv import GapRow
from fingervision.vision.overlay import in_eight_bits

JPEG_QUALITY = 85
# Time for which a composed state is used again; rows, messages and the picture's values are always the newest.
STATE_FOR_S = 0.2
# Features with which the rows are compared.
COMPARED = ("model", "second")
# Largest number of rows in one message.
ROWS_AT_ONCE = 3000


@dataclass(frozen=True, slots=True)
class Known:
    """What a browser page has received so far: identity of the view, and numbers of rows and messages.

    Parameters
    ----------
    identity : str
        Identity of the view to which the row numbers refer; empty for a page without data.
    rows, messages : int
        Number of rows and of messages that the page has.
    gauges : (int, int)
        What `GaugeCourse.after` returned of the readings that the page has.
    """

    identity: str = ""
    rows: int = 0
    messages: int = 0
    gauges: tuple[int, int] = (-1, 0)


@dataclass(frozen=True, slots=True)
class Next:
    """A message to a browser page, and a record of the data that the page has after receiving the message."""

    content: bytes
    known: Known


def message(view: View, known: Known, seen: Seen | None, about: Mapping[str, Any] | None = None) -> Next:
    """Compose the next message.

    Parameters
    ----------
    view : View
        The live measurement or recording that is shown.
    known : Known
        Data that the page has already.
    seen : Seen or None
        The picture to send; None for no picture.
    about : mapping, optional
        Data for this page only.

    Returns
    -------
    Next
        The message: length of the header (4 bytes, big-endian), the header in JSON, and the picture as JPEG, if any.
    """
    identity, count = view.identity, view.row_count
    is_same = known.identity == identity and known.rows <= count
    first = max(known.rows, view.oldest_row) if is_same else view.shown_from
    last = min(count, first + ROWS_AT_ONCE)
    rows = list(view.rows(first, last))
    said = [each for each in tuple(view.messages) if not is_same or each.number > known.messages]
    measured: dict[str, Any] = {"points": [], "now": None}
    with view.supervisor.watching("Describing the measurement"):
        measured = {"points": points(view, rows), "now": _now(view, seen or view.seen)}
    state = {**_STATES.of(view), **(about or {})}
    gauge_points = _gauge_points(view, *known.gauges, ROWS_AT_ONCE)
    if gauge_points is not None and "version" in (told := state["gauges"]):
        # The state may be of another picture than this one.
        state["gauges"] = {**told, **view.features[GAUGES].readings_in(seen or view.seen, told["version"])}
    head = {
        "view": identity,
        "first": first,
        "last": last,
        "count": count,
        **measured,
        "gauge_points": gauge_points,
        "state": state,
        "overlay": None if seen is None else _overlay(seen.outcome),
        "messages": [[each.number, each.name, each.words] for each in said],
    }
    words = page_json(head).encode()
    picture = b""
    if seen is not None:
        with view.supervisor.watching("Drawing the picture"):
            picture = _PICTURES.of(seen)
    content = struct.pack(">I", len(words)) + words + picture
    newest = max([known.messages if is_same else 0, *(each.number for each in said)])
    has = known.gauges if gauge_points is None else (gauge_points["begun"], gauge_points["known"])
    return Next(content, Known(identity, last, newest, has))


def _gauge_points(view: View, begun: int, known: int, most: int) -> dict[str, Any] | None:
    """Readings of the gauges that a page does not know yet; None without gauges."""
    beside = view.features.get(GAUGES)
    if not isinstance(beside, GaugesBeside):
        return None
    return for_charts(beside.following.course, beside.following.gauges, begun, known, most)


def points(view: View, rows: list[GapRow]) -> list[list[Any]]:
    """Rows for the chart: time, gap, u, frame, reason for no gap, u's random part if less, and what is compared.

    What is compared is the model's gap, or the gap of a second recording and the uncertainty of the difference.
    """
    model, second = (view.features.get(name) for name in COMPARED)
    compared: list[Sequence[float]] = [()] * len(rows)
    with view.supervisor.watching("Comparing the gap"):
        if model is not None:
            compared = [() if gap_mm is None else (gap_mm,) for gap_mm in model.predicted_mm(rows)]
        elif second is not None:
            compared = [each or () for each in second.differences(rows)]
    return [
        [
            row.time_s if row.time_s is not None else row.frame,
            row.gap_mm,
            _u_mm(row),
            row.frame,
            "" if row.status in (Status.OK, Status.NOT_ASKED) else row.status.value,
            None if row.u_gap_mm is None else row.u_random_mm,
            *beside,
        ]
        for row, beside in zip(rows, compared, strict=True)
    ]


def _u_mm(row: GapRow) -> float | None:
    return row.u_random_mm if row.u_gap_mm is None else row.u_gap_mm


def _now(view: View, seen: Seen | None) -> dict[str, Any] | None:
    """Measured values of the row that belongs to the displayed picture."""
    choices = view.choices
    if seen is None or seen.row is None:
        return None
    row = seen.row
    return {
        "frame": row.frame,
        "time_s": row.time_s,
        "status": row.status.value,
        "words": getattr(seen.outcome, "words", ""),
        "gap_mm": row.gap_mm,
        "u_mm": _u_mm(row),
        "u_random_mm": row.u_random_mm,
        "has_budget": row.u_gap_mm is not None,
        "zero_mm": choices.zero_mm,
        "verdict": choices.verdict(None if row.gap_mm is None else row.gap_mm - choices.zero_mm, _u_mm(row)),
    }


def _overlay(outcome: GapMeasurement | NoGap | None) -> dict[str, Any]:
    """Measured points of a picture: x, y, tip and slope of both edges, and the ends of a held part."""
    held = None if outcome is None else outcome.held
    ends = None if held is None else [held.left_x_px, held.left_y_px, held.right_x_px, held.right_y_px]
    if not isinstance(outcome, GapMeasurement):
        return {"edges": None, "held": ends}
    return {
        "edges": [[edge.x_px, edge.y_px, edge.tip_px, edge.slope] for edge in (outcome.left, outcome.right)],
        "vertical": outcome.direction.is_vertical,
        "root": 1 if outcome.direction in (Direction.UP, Direction.LEFT) else -1,
        "held": ends,
    }


def coded(seen: Seen) -> bytes:
    """The picture as JPEG; the page itself draws the measured points and shows frame number and value as text."""
    levels = in_eight_bits(seen.frame.pixels)
    if levels.ndim == 2:
        return bytes(simplejpeg.encode_jpeg(levels[:, :, np.newaxis], JPEG_QUALITY, "GRAY", fastdct=True))
    return bytes(simplejpeg.encode_jpeg(np.asarray(levels, np.uint8), JPEG_QUALITY, "RGB", "420", fastdct=True))


def page_file(view: Playback, frames: Sequence[int], folder: Path) -> str:
    """The page as one file, with all rows and the pictures of some frames, as far as there is room for them.

    Raises
    ------
    StateError
        The recording is moved by another page meanwhile, or its gauges are not measured in all frames yet.
    """
    beside = view.features.get(GAUGES)
    if isinstance(beside, GaugesBeside):
        beside.refuse_part()
    shown, pictures, room = view.frame, list[tuple[dict[str, Any], bytes]](), MOST_BYTES
    for frame in frames:
        seen = seen_at(view, frame)
        picture = coded(seen)
        room -= len(picture)
        if room < 0:
            break
        about = {"now": _now(view, seen), "overlay": _overlay(seen.outcome), "gauges": section(view)["gauges"]}
        pictures.append((about, picture))
    view.seek(shown)
    state = {**view.state(), **section(view), "viewer": True, "holds_pen": False, "is_saved": True}
    told = [[each.number, each.name, each.words] for each in view.messages]
    rows = list(view.rows(0, view.row_count))
    content: dict[str, Any] = {"state": state, "points": points(view, rows), "messages": told}
    content["gauge_points"] = _gauge_points(view, -1, 0, view.row_count)
    return saved_page(folder, content, pictures)


def state_has_changed() -> None:
    """After the execution of a command, ensure that the next messages contain a fresh state of the view."""
    _STATES.forget()


class _Pictures:
    """The newest picture, encoded only once for all browser pages."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._seen: Seen | None = None
        self._coded = b""

    def of(self, seen: Seen) -> bytes:
        with self._lock:
            if self._seen is not seen:
                self._seen, self._coded = seen, coded(seen)
            return self._coded


class _States:
    """State of a view, composed once for all browser pages that need it at about the same time."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._view: View | None = None
        self._until_s, self._state = 0.0, dict[str, Any]()

    def of(self, view: View) -> dict[str, Any]:
        with self._lock:
            if self._view is not view or monotonic() > self._until_s:
                with view.supervisor.watching("Describing the state"):
                    self._state = {**view.state(), **section(view)}
                self._view, self._until_s = view, monotonic() + STATE_FOR_S
            return {**self._state, "trouble": view.supervisor.trouble}

    def forget(self) -> None:
        with self._lock:
            self._view = None


_PICTURES, _STATES = _Pictures(), _States()
