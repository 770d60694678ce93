"""Reading of the lines of a text file, with a limit on the size of the file."""

from pathlib import Path

from fingervision.domain.errors import DataError, FingervisionError, InputFileError
from fingervision.tables.encoding import decode

MOST_BYTES = 1_000_000_000
"""Largest size of a file, because cells as text need about ten times the size of the file in memory."""
HEAD_LINES, MOST_IN_CELL = 40, 12
"""Number of lines in which a header with line ends in its cells is looked for, and the most lines of such a header."""
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
    lines = with_whole_cells(text.splitlines())
    if lines and max(map(len, lines)) > LONGEST_LINE:
        raise _too_long(path)
    return lines, name


def with_whole_cells(lines: list[str]) -> list[str]:
    """Join the lines of a header cell in quotes that contains line ends, as spreadsheets write it.

    The lines that were joined become blank, so that all others keep their numbers.

    Examples
    --------
    >>> with_whole_cells(['"Time', '[s]","Gap', '[mm]"', "0,1"])
    ['"Time [s]","Gap [mm]"', '', '', '0,1']
    """
    for at in range(min(len(lines), HEAD_LINES)):
        line = lines[at]
        if '"' not in line or line.count('"') % 2 == 0:
            continue
        for end in range(at + 1, min(len(lines), at + 1 + MOST_IN_CELL)):
            line = f"{line} {lines[end].strip()}"
            if line.count('"') % 2 == 0 and '"' in lines[end]:
                return [*lines[:at], line, *[""] * (end - at), *with_whole_cells(lines[end + 1 :])]
    return lines


def _too_long(path: Path) -> FingervisionError:
    return DataError(
        f"{path} must be a table with a row a line, but has a line of more than {LONGEST_LINE} characters: export it "
        "with line ends."
    )
