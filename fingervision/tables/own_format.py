"""Recognition of tables in fingervision's own format, which are read literally."""

from pathlib import Path

from fingervision.tables.mapping import Entry

OWN = {"measured": ("input_mm", "gap_mm"), "drive": ("time_s", "input_mm"), "simulation": ("input_mm", "gap_mm")}
TARGET = "target_mm"
HEAD_BYTES = 100_000


def is_own(path: Path, kind: str, given: Entry) -> bool:
    """Whether a table is in fingervision's own format, judged by its header line; True for an unreadable file.

    A table with an entry in columns.toml is read as this entry states.
    """
    if not given.says_nothing:
        return False
    if not path.is_file():
        return True
    try:
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES).decode(
                "utf-8-sig", errors="strict" if path.stat().st_size < HEAD_BYTES else "replace"
            )
    except (OSError, UnicodeDecodeError):
        return False
    if "\x00" in head:
        return False
    header = next((line for line in head.splitlines() if line.strip() and not line.lstrip().startswith("#")), "")
    names = [cell.strip().strip('"').strip() for cell in header.split(",")]
    if kind == "measured" and TARGET in names and "input_mm" not in names:
        from fingervision.storage.iso230_table import MATRIX, QUANTITIES

        return any(name in QUANTITIES or MATRIX.fullmatch(name) for name in names)
    return all(name in names for name in OWN[kind])
