"""Recognition of tables in fingervision's own format, which are read literally."""

from pathlib import Path

from fingervision.storage.csv_columns import header_of
from fingervision.tables.mapping import Entry

OWN = {"measured": ("input_mm", "gap_mm"), "drive": ("time_s", "input_mm"), "simulation": ("input_mm", "gap_mm")}


def is_own(path: Path, kind: str, given: Entry) -> bool:
    """Whether a table is in fingervision's own format, judged by its header line; True for an unreadable file.

    A table with an entry in columns.toml is read as this entry states.
    """
    if not given.says_nothing:
        return False
    if not path.is_file():
        return True
    names = header_of(path)
    return all(name in names for name in OWN[kind])
