"""A text file that grows line by line, and contains only complete lines whenever the program is stopped."""

import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from time import monotonic

from fingervision.domain.errors import OutputError
from fingervision.storage.durable import FLUSH_EVERY_S, flush, flush_open


class LineFile:
    """Appends lines to a text file.

    Complete lines are on the disk within a second. If the disk is full, the file is truncated after its
    last complete line.

    Parameters
    ----------
    path : Path
        The file.
    header : str
        First line of a new file.
    go_on : bool
        Whether lines are appended to an existing file; otherwise an existing file is replaced.

    Raises
    ------
    FingervisionError
        The file cannot be written; also from `add` and `close`.
    """

    def __init__(self, path: Path, header: str, *, go_on: bool = False) -> None:
        self._path = path
        self._pending: list[str] = []
        try:
            self._file = path.open("ab" if go_on else "wb", buffering=0)
            self._whole_bytes = path.stat().st_size
        except OSError as error:
            raise OutputError(
                f"{path} could not be written ({error.strerror}): name another folder with --out."
            ) from error
        if not go_on:
            self._pending.append(header)
        self._write()
        with suppress(OSError):  # /dev has no entries to flush
            flush(path.parent)

    def add(self, lines: Sequence[str]) -> None:
        """Add lines, in order."""
        self._pending += lines
        if self._pending and monotonic() - self._written_at >= FLUSH_EVERY_S:
            self._write()

    def close(self) -> None:
        """Write pending lines and close the file; closing twice is allowed."""
        if self._file.closed:
            return
        try:
            self._write()
        finally:
            self._file.close()

    def _write(self) -> None:
        self._written_at = monotonic()
        if not self._pending:
            return
        block = ("\n".join(self._pending) + "\n").encode()
        self._pending.clear()
        written = 0
        try:
            while written < len(block):
                written += os.write(self._file.fileno(), block[written:])
            flush_open(self._file.fileno())
        except OSError as error:
            # An incomplete line is removed.
            self._whole_bytes += block[:written].rfind(b"\n") + 1
            with suppress(OSError):  # a pipe cannot be cut back
                os.ftruncate(self._file.fileno(), self._whole_bytes)
            self._file.close()
            raise OutputError(
                f"{self._path} could not be written any further ({error.strerror}); it holds the rows written before: "
                f"free disk space and measure again."
            ) from error
        self._whole_bytes += len(block)


def cell(value: float | None, places: int) -> str:
    """Format a number without trailing zeros; None gives an empty string."""
    return "" if value is None else f"{value:.{places}f}".rstrip("0").rstrip(".")


def quoted(text: str) -> str:
    """Quote text for CSV (RFC 4180)."""
    return '"' + text.replace('"', '""') + '"' if any(mark in text for mark in ',"\n\r') else text
