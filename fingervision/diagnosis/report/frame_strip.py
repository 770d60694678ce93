"""Video frames at the reversals of a recording, with the measured edges drawn in."""

import base64
import csv
import hashlib
from dataclasses import dataclass
from html import escape
from pathlib import Path

import cv2
import numpy as np

from fingervision.domain.errors import FingervisionError
from fingervision.domain.frame import Frame
from fingervision.frames.source_kinds import open_source
from fingervision.motion.encoder_path import reversals
from fingervision.storage.plain_file import json_of
from fingervision.storage.summary_json import SUMMARY

MOST_FRAMES = 6
"""Number of frames in the strip: at the start, and at the first reversals."""
LOOKED_AT = 2000
"""Most frames of a recording that are decoded for the strip, within a second or two."""
TURN = 0.02
"""Least return motion of a reversal as a share of the input's range: an encoder's jitter is smaller."""
WIDTH_PX, JPEG_QUALITY = 480, 80
"""Width and JPEG quality of a picture in the page: three pictures fit side by side on a desktop screen."""
MARK = (64, 255, 96)
"""Colour of a measured edge is bright green, which neither metal nor polymer has."""


@dataclass(frozen=True, slots=True)
class Turn:
    """A measured row at which the input reversed, with its video frame.

    Parameters
    ----------
    frame : int
        Number of the frame.
    time_s, input_mm, gap_mm : float
        Values in the table; the time may be missing.
    points_px : tuple of (float, float)
        Left and right measuring point.
    jpeg : bytes
        The frame with the measured distance drawn in; empty until it is decoded.
    """

    frame: int
    time_s: float | None
    input_mm: float
    gap_mm: float
    points_px: tuple[tuple[float, float], tuple[float, float]]
    jpeg: bytes = b""


def strip_html(table: Path) -> str:
    """HTML of the frames at the reversals in the recording of a gaps.csv, or the reason why there is none."""
    recording = _recording_of(table)
    if recording is None:
        return (
            "<p>No video frames are shown. They need a gaps.csv with its summary.json as the measured table. The "
            "recording must be at the path that summary.json states, or in the folder of gaps.csv, the folder above, "
            "or the current folder.</p>"
        )
    turns = _decoded(recording, turning_rows(table))
    shown = "".join(
        f'<figure><img alt="Frame {turn.frame}, gap {turn.gap_mm:.3f} mm" '
        f'src="data:image/jpeg;base64,{base64.b64encode(turn.jpeg).decode()}">'
        f"<figcaption>frame {turn.frame}{'' if turn.time_s is None else f', {turn.time_s:.2f} s'}: input "
        f"{turn.input_mm:.3f} mm, gap {turn.gap_mm:.3f} mm</figcaption></figure>"
        for turn in turns
    )
    return f'<div class="strip">{shown}</div><p class="hint">From {escape(recording.name)}.</p>'


def turning_rows(table: Path) -> tuple[Turn, ...]:
    """Find the first and last row of a gaps.csv and the rows at which the input reversed; none without its columns."""
    with table.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    found: list[Turn] = []
    for row in rows[:LOOKED_AT]:
        try:
            left = (float(row["left_x_px"]), float(row["left_y_px"]))
            right = (float(row["right_x_px"]), float(row["right_y_px"]))
            time_s = float(row["time_s"]) if row["time_s"] else None
            found.append(Turn(int(row["frame"]), time_s, float(row["input_mm"]), float(row["gap_mm"]), (left, right)))
        except (KeyError, TypeError, ValueError):
            continue  # a row without a gap or an input
    if not found:
        return ()
    inputs = np.array([turn.input_mm for turn in found])
    turns = [0, *reversals(inputs, TURN * float(np.ptp(inputs))), inputs.size - 1]
    return tuple(found[k] for k in dict.fromkeys(turns))[:MOST_FRAMES]


def _recording_of(table: Path) -> Path | None:
    """Path of the recording from which a gaps.csv was measured, identified by its hash; None if not found nearby."""
    try:
        recording = json_of(table.parent / SUMMARY)["recording"]
        name, sha256 = recording["name"], recording["sha256"]
    except (OSError, ValueError, LookupError, TypeError):
        return None
    if not isinstance(name, str) or not isinstance(sha256, str):
        return None
    beside = [folder / Path(name).name for folder in (table.parent, table.parent.parent, Path())]
    # Also search at the path that the summary states, relative to the present folder or to the folder of the summary;
    # only a file with the stated hash is used.
    for path in (Path(name), table.parent / name, *beside):
        if path.is_file():
            with path.open("rb") as file:
                if hashlib.file_digest(file, "sha256").hexdigest() == sha256:
                    return path
    return None


def _decoded(recording: Path, turns: tuple[Turn, ...]) -> tuple[Turn, ...]:
    """Decode the video frames at the reversals, and draw the measured edges into them."""
    wanted = {turn.frame: turn for turn in turns}
    last = max(wanted, default=-1)
    found: list[Turn] = []
    try:
        for frame in open_source(str(recording)):
            if isinstance(frame, Frame) and frame.index in wanted:
                turn = wanted[frame.index]
                found.append(
                    Turn(turn.frame, turn.time_s, turn.input_mm, turn.gap_mm, turn.points_px, _drawn(frame, turn))
                )
            if frame.index >= last:
                break
    except FingervisionError:
        # The measured values are in the table: if the recording cannot be read again, only its pictures are missing.
        return tuple(found)
    return tuple(found)


def _drawn(frame: Frame, turn: Turn) -> bytes:
    grey = np.asarray(frame.pixels, dtype=np.float64)
    top = float(grey.max()) or 1.0
    levels = np.asarray(255.0 * grey / top, dtype=np.uint8)
    canvas = cv2.cvtColor(levels, cv2.COLOR_GRAY2BGR if levels.ndim == 2 else cv2.COLOR_RGB2BGR)
    scale = min(1.0, WIDTH_PX / canvas.shape[1])
    canvas = cv2.resize(canvas, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    left, right = ((round(x * scale), round(y * scale)) for x, y in turn.points_px)
    cv2.line(canvas, left, right, MARK, 2, cv2.LINE_AA)
    for x, y in (left, right):
        cv2.drawMarker(canvas, (x, y), MARK, cv2.MARKER_CROSS, 14, 2, cv2.LINE_AA)
    return bytes(cv2.imencode(".jpg", canvas, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1])
