"""Table of a recording that `fingervision measure` writes, read while it grows."""

import tempfile
from collections import Counter
from pathlib import Path

from fingervision.domain.status import Status
from fingervision.live.background import WAITED_FOR, BackgroundCommand
from fingervision.live.choices import Choices
from fingervision.storage.gaps_csv import GapRow, GapsReader

# Exit codes of `measure` after which the table is complete: done, no frame has a gap, some frames are damaged.
NO_GAP = 1
WHOLE = (0, NO_GAP, 3)
GAPS = "gaps.csv"


def arguments_of(recording: str, choices: Choices, more: tuple[str, ...]) -> tuple[str, ...]:
    """Arguments of `fingervision measure` for a recording and the chosen settings.

    Parameters
    ----------
    recording : str
        Name of the recording.
    choices : Choices
        Settings of the measurement, including a scale.
    more : tuple of str
        Options that belong to the recording, such as a frame rate or a drive log.
    """
    given: list[str] = []
    for name, value in choices.settings().items():
        if value is not None:
            words = ",".join(map(str, value)) if isinstance(value, list) else str(value)
            given += [f"--{name.replace('_', '-')}", words]
    return ("measure", recording, *given, *more)


class Track:
    """Measures a recording in a separate process.

    Parameters
    ----------
    arguments : tuple of str
        Arguments of the command, from `arguments_of`.
    """

    def __init__(self, arguments: tuple[str, ...]) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="fingervision_")
        self.table = Path(self._folder.name) / GAPS
        self.failure = ""
        self.is_whole = False
        self.counts: Counter[Status] = Counter()
        """Number of rows so far with each status."""
        self._reader = GapsReader(self.table)
        self._command: BackgroundCommand | None = BackgroundCommand(
            *arguments, "--out", self._folder.name, niceness=WAITED_FOR
        )

    @property
    def rows(self) -> list[GapRow]:
        """Rows of the table so far."""
        return self._reader.rows

    def refresh(self) -> bool:
        """Read new rows of the table; return True if it was written anew, such as with inputs, so that all are new."""
        if self._command is None:
            return False
        ended = self._command.exit_code
        counted = self.counts.total()
        is_other = self._reader.refresh()
        if is_other or counted > len(self.rows):
            counted, self.counts = 0, Counter()
        self.counts.update(row.status for row in self.rows[counted:])
        if ended is None:
            return is_other
        complaint = self._command.complaint
        self._command.stop()
        self._command = None
        self.is_whole = ended in WHOLE and bool(self.rows) and self.table.is_file()
        if not self.is_whole:
            self.failure = complaint or f"Measuring ended with exit code {ended}."
        elif ended == NO_GAP and not self.counts[Status.NOT_ASKED]:
            # The command's own sentence is for its user: it names the folder, which is hidden here.
            counts = ", ".join(f"{number} {status}" for status, number in self.counts.most_common())
            self.failure = f"Too few frames have a gap: {counts}."
        return is_other

    def close(self) -> None:
        """End the measurement, and delete the table."""
        if self._command is not None:
            self._command.stop()
            self._command = None
        self._folder.cleanup()
