"""The live measurement in a terminal: one line in place, or one line of JSON a frame."""

import json
from dataclasses import asdict
from time import monotonic
from typing import TextIO

from fingervision.live.session import Message, Session
from fingervision.storage.gaps_csv import GapRow

# In place on a terminal, line by line elsewhere.
EVERY_S, EVERY_S_ELSEWHERE = 0.1, 1.0
CLEARED = "\r\x1b[2K"
DRIVE_COLUMNS = ("run", "input_mm", "force_n")


class JsonLines:
    """Writes one line a frame, with the columns of gaps.csv; null is an empty cell.

    Parameters
    ----------
    stream : text stream
        Standard output.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self.broken = False

    def add(self, row: GapRow, arrived_s: float) -> None:
        """Write one row."""
        cells = {name: cell for name, cell in asdict(row).items() if name not in DRIVE_COLUMNS}
        try:
            self._stream.write(json.dumps(cells) + "\n")
            self._stream.flush()
        except (BrokenPipeError, ValueError):
            self.broken = True


class StatusLine:
    """Prints gap, status and rate in place.

    Parameters
    ----------
    session : Session
        The live measurement.
    stream : text stream
        Standard output.
    """

    def __init__(self, session: Session, stream: TextIO) -> None:
        self._session, self._stream = session, stream
        self._in_place = stream.isatty()
        self._printed_at_s = float("-inf")

    def add(self, row: GapRow, arrived_s: float) -> None:
        """Print the row if it is time."""
        if monotonic() - self._printed_at_s < (EVERY_S if self._in_place else EVERY_S_ELSEWHERE):
            return
        self._printed_at_s = monotonic()
        line = self._line(row)
        self._stream.write(f"{CLEARED}{line}" if self._in_place else f"{line}\n")
        self._stream.flush()

    def end(self) -> None:
        """Leave the line that is in place."""
        if self._in_place:
            self._stream.write("\n")

    def _line(self, row: GapRow) -> str:
        rate_hz = self._session.cadence.rate_hz
        rate = "" if rate_hz is None else f"  {rate_hz:.2f} Hz"
        dropped = self._session.cadence.missing + self._session.capture.overflowed
        exposure = self._session.exposure.words
        if row.gap_mm is None or row.u_random_mm is None:
            gap = "no gap"
        else:
            u_mm = row.u_random_mm if row.u_gap_mm is None else row.u_gap_mm
            gap = f"gap {row.gap_mm:.4f} mm, U {2e3 * u_mm:.2f} µm"
        return f"{gap}  {row.status.value}{rate}  {dropped} dropped{'  ' + exposure if exposure else ''}"


def told(message: Message, stream: TextIO) -> None:
    """Print a message of the session."""
    # What stands in place, and the ^C of whoever ends it, gives way.
    stream.write(f"{CLEARED if stream.isatty() else ''}fingervision: {message.words}\n")
    stream.flush()
