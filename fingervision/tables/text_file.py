"""Reading of the lines of a text file, with a limit on the size of the file."""

from pathlib import Path

from fingervision.domain.errors import DataError, FingervisionError, InputFileError
from fingervision.tables.encoding import decode

MOST_BYTES = 1_000_000_000
"""Largest size of a file, because cells as text need about ten times the size of the file in memory."""
LONGEST_LINE = 1_000_000
"""Longest line in characters; only a file without line ends, not a table, has longer lines."""


def lines_of(path: Path, encoding: str | None) -> tuple[list[str], str]:
    """Read all lines of a text file.

    Returns
    -------
    list of str, str
        Lines, and the name of the encoding.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read, is too large, is not text, or has a line of more than `LONGEST_LINE` characters.
    """
    try:
        with path.open("rb") as file:
            # The first line is checked before the whole file is read, because a file of one line is often huge. UTF-32
            # has four bytes per character.
            head = file.read(4 * LONGEST_LINE)
            if len(head) == 4 * LONGEST_LINE and b"\n" not in head and b"\r" not in head:
                raise _too_long(path)
            size = path.stat().st_size
            if size > MOST_BYTES:
                raise DataError(
                    f"{path} must have at most {MOST_BYTES / 1e9:g} GB to be read as text, but has {size / 1e9:.1f} "
                    "GB: split it, or save it as Parquet."
                )
            content = head + file.read()
    except OSError as error:
        raise InputFileError(f"The table {path} could not be read ({error.strerror}).") from error
    text, name = decode(content, encoding)
    if "\x00" in text:
        # If a logger loses power, its file may end with zero bytes.
        text = text.rstrip("\x00")
        if "\x00" in text:
            raise DataError(
                f"{path} must be a text table, or a file of a supported format (.xlsx, .mat, .parquet, .tdms, .lvm), "
                f"but holds zero bytes (the first is character {text.index(chr(0))}): export it again."
            )
    lines = text.splitlines()
    if lines and max(map(len, lines)) > LONGEST_LINE:
        raise _too_long(path)
    return lines, name


def _too_long(path: Path) -> FingervisionError:
    return DataError(
        f"{path} must be a table with a row a line, but has a line of more than {LONGEST_LINE} characters: export it "
        "with line ends."
    )
