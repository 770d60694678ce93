"""One message to the page: what is new since the last, and the newest picture with what was measured drawn in."""

import json
import struct
from dataclasses import dataclass
from typing import Any

import cv2

from calib.measured_scale import Calibration
from fingervision.domain.gap import NoGap
from fingervision.domain.status import Status
from fingervision.live.frame_measurement import Seen
from fingervision.live.session import Session
from fingervision.storage.gaps_csv import GapRow
from fingervision.vision.overlay import draw_overlay

JPEG_QUALITY = 85
# A page that was away gets so many rows at once.
ROWS_AT_ONCE = 3000
_NOTHING = NoGap(Status.NO_FINGERS, "The scale is not known: nothing is measured yet.")


@dataclass(frozen=True, slots=True)
class Next:
    """A message, and how many rows and messages the page then has."""

    content: bytes
    rows: int
    messages: int


def message(session: Session, after_row: int, after_message: int, seen: Seen | None) -> Next:
    """Put together the next message.

    Parameters
    ----------
    session : Session
        The live measurement.
    after_row, after_message : int
        How many rows and messages the page has.
    seen : Seen or None
        The picture to send; None sends none.

    Returns
    -------
    Next
        Its content: length of the head (4 bytes, big end first), the head in JSON, the picture as JPEG or nothing.
    """
    count = session.history.count
    rows = list(session.history.rows(max(after_row, count - ROWS_AT_ONCE)))
    said = [each for each in tuple(session.messages) if each.number > after_message]
    head = {
        "points": [
            [row.time_s if row.time_s is not None else row.frame, row.gap_mm, _u_mm(row), row.frame] for row in rows
        ],
        "now": _now(session),
        "state": _state(session),
        "messages": [[each.number, each.name, each.words] for each in said],
    }
    words = json.dumps(head, ensure_ascii=False).encode()
    picture = b"" if seen is None else _picture(seen, session.choices.zero_mm)
    content = struct.pack(">I", len(words)) + words + picture
    return Next(content, count, max([after_message, *(each.number for each in said)]))


def _u_mm(row: GapRow) -> float | None:
    return row.u_random_mm if row.u_gap_mm is None else row.u_gap_mm


def _now(session: Session) -> dict[str, Any] | None:
    """The newest row in figures."""
    seen, choices = session.seen, session.choices
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
        "has_budget": row.u_gap_mm is not None,
        "zero_mm": choices.zero_mm,
        "verdict": choices.verdict(None if row.gap_mm is None else row.gap_mm - choices.zero_mm, _u_mm(row)),
    }


def _state(session: Session) -> dict[str, Any]:
    choices, cadence, recorder = session.choices, session.cadence, session.recording
    region, description = choices.region, session.description
    scale = choices.scale
    return {
        "source": description.name,
        "kind": description.kind,
        "width_px": description.width_px,
        "height_px": description.height_px,
        "rate_hz": cadence.rate_hz,
        "camera": ", ".join(f"{name} {value}" for name, value in session.capture.source.description.camera.items()),
        "jitter_ms": None if cadence.jitter_s is None else 1e3 * cadence.jitter_s,
        "dropped": cadence.missing + session.capture.overflowed,
        "duplicates": session.counts[Status.DUPLICATE],
        "damaged": session.counts[Status.DAMAGED],
        "exposure": session.exposure.words,
        "silent_s": session.silent_s,
        "ended": session.ended.is_set(),
        "trouble": session.trouble,
        "zero_mm": choices.zero_mm,
        "px_per_mm": None if scale is None else scale.px_per_mm,
        "u_px_per_mm": scale.u_px_per_mm if isinstance(scale, Calibration) else None,
        "region": None if region is None else [region.x_px, region.y_px, region.width_px, region.height_px],
        "tips": "auto" if choices.direction is None else choices.direction.value,
        "below_tip_mm": choices.below_tip_mm,
        "least_mm": choices.least_mm,
        "greatest_mm": choices.greatest_mm,
        "recording": None if recorder is None else {"path": str(recorder.run.path), "frames": recorder.run.frames},
    }


def _picture(seen: Seen, zero_mm: float) -> bytes:
    if seen.outcome is None:
        drawn = draw_overlay(seen.frame, _NOTHING, _NOTHING.words)
    else:
        row = seen.row
        words = f"{seen.frame.index}"
        if row is not None:
            less = f" less zero {zero_mm:.4f}" if zero_mm else ""
            words += f"  {row.status.value}" if row.gap_mm is None else f"  gap {row.gap_mm - zero_mm:.4f} mm{less}"
        drawn = draw_overlay(seen.frame, seen.outcome, words)
    return cv2.imencode(".jpg", drawn[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1].tobytes()
