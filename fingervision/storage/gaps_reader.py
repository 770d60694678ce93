"""Reader of gaps.csv, also while the file is still being written."""

from dataclasses import fields
from pathlib import Path

from fingervision.domain.status import Status
from fingervision.storage.gaps_csv import GapRow

_NUMBERS = frozenset(each.name for each in fields(GapRow)) - {"frame", "status", "fingers", "run"}


class GapsReader:
    """Reads the complete lines of a gaps.csv that is still growing.

    Parameters
    ----------
    path : Path
        The file gaps.csv, which need not exist yet.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._place = 0
        self._columns: tuple[str, ...] = ()

    def fresh(self) -> list[GapRow]:
        """Return the rows that were added to the file since the last call.

        Raises
        ------
        OSError
            The table exists but cannot be read.
        """
        try:
            with self.path.open("rb") as file:
                file.seek(self._place)
                text = file.read()
        except FileNotFoundError:
            return []
        whole = text[: text.rfind(b"\n") + 1]
        self._place += len(whole)
        lines = whole.decode("utf-8").splitlines()
        if lines and not self._columns:
            self._columns = tuple(lines.pop(0).split(","))
        return [self._row(line) for line in lines]

    def _row(self, line: str) -> GapRow:
        cells = dict(zip(self._columns, line.split(","), strict=False))
        numbers = {name: float(cell) for name, cell in cells.items() if name in _NUMBERS and cell}
        return GapRow(
            frame=int(cells["frame"]),
            status=Status(cells["status"]),
            fingers=cells.get("fingers", ""),
            run=cells.get("run", "").strip('"'),
            **{"time_s": None, **numbers},
        )
