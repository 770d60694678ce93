"""The live measurement in a terminal: one line that is overwritten, or one line of JSON per frame."""

import json
from dataclasses import asdict
from time import monotonic

from fingervision.live.messages import Message
from fingervision.live.outlet import Outlet
from fingervision.live.session import Session
from fingervision.storage.gaps_csv import GapRow

# Time between two lines: on a terminal, where the line is overwritten, and elsewhere.
EVERY_S, EVERY_S_ELSEWHERE = 0.1, 1.0
CLEARED = "\r\x1b[2K"
DRIVE_COLUMNS = ("run", "input_mm", "force_n")


class JsonLines:
    """Prints one line of JSON per frame, with the columns of gaps.csv; null represents an empty cell.

    Parameters
    ----------
    outlet : Outlet
        Standard output.
    """

    def __init__(self, outlet: Outlet) -> None:
        self._outlet = outlet

    def add(self, row: GapRow, arrived_s: float) -> None:
        """Print one row."""
        cells = {name: cell for name, cell in asdict(row).items() if name not in DRIVE_COLUMNS}
        self._outlet.put(json.dumps(cells) + "\n")


class StatusLine:
    """Prints gap, status and frame rate in a line that is overwritten.

    Parameters
    ----------
    session : Session
        The live measurement.
    outlet : Outlet
        Standard output.
    in_place : bool
        Whether the output is a terminal, so that the line can be overwritten.
    """

    def __init__(self, session: Session, outlet: Outlet, *, in_place: bool) -> None:
        self._session, self._outlet, self._in_place = session, outlet, in_place
        self._printed_at_s = float("-inf")

    def add(self, row: GapRow, arrived_s: float) -> None:
        """Print the row if the display interval has passed."""
        if monotonic() - self._printed_at_s < (EVERY_S if self._in_place else EVERY_S_ELSEWHERE):
            return
        self._printed_at_s = monotonic()
        line = self._line(row)
        self._outlet.put(f"{CLEARED}{line}" if self._in_place else f"{line}\n")

    def end(self) -> None:
        """End the line that is overwritten."""
        if self._in_place:
            self._outlet.put("\n")

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


def told(message: Message, outlet: Outlet, *, in_place: bool) -> None:
    """Print a message of the live measurement on the terminal."""
    # The message overwrites the status line, and the ^C that a terminal shows.
    outlet.put(f"{CLEARED if in_place else ''}fingervision: {message.words}\n")
