"""Igor Pro text files (.itx): waves in blocks, each with its names above, and commands that state scales and units.

Source: WaveMetrics, "Igor Pro Manual", volume II, chapter Importing and Exporting Data, section Igor Text File Format.
"""

import re
from pathlib import Path

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.storage.csv_columns import Numbers
from fingervision.tables.dialect import to_numbers
from fingervision.tables.mapping import Entry
from fingervision.tables.raw_table import RawColumn, RawTable, check_columns
from fingervision.tables.text_file import lines_of

ORDER = 20
WAVES = re.compile(r"WAVES(?:/\S*)?\s+(?P<names>.+)", re.IGNORECASE)
NAME = re.compile(r"'([^']+)'|([^\s,']+)")
SCALE = re.compile(
    r"SetScale\s*(?P<points>/P|/I)?\s*(?P<axis>[xyd])\s+(?P<first>[^,]+),(?P<step>[^,]+),"
    r"\s*\"(?P<unit>[^\"]*)\"\s*,(?P<names>.+)",
    re.IGNORECASE,
)


def recognises(path: Path, head: bytes) -> bool:
    """Whether the file begins with the word that Igor's text files begin with."""
    return head.lstrip(b"\xef\xbb\xbf").splitlines()[:1] == [b"IGOR"]


def read(path: Path, given: Entry) -> RawTable:
    """Read all waves of equal length, with the units and the time axis that the file's commands state."""
    lines, encoding = lines_of(path, given.words.get("encoding"))
    waves: dict[str, Numbers] = {}
    unit: dict[str, str] = {}
    clock: tuple[float, float] | None = None
    names: list[str] | None = None
    rows: list[list[str]] | None = None
    unread = 0
    for at, line in enumerate(lines, start=1):
        text = line.strip()
        if (match := WAVES.fullmatch(text)) is not None:
            names = _names(match["names"])
        elif text.upper() == "BEGIN" and names is not None:
            rows = []
        elif text.upper() == "END" and names is not None and rows is not None:
            for k, name in enumerate(names):
                waves[name], odd = to_numbers([row[k] for row in rows], ".")
                unread += int(odd.size)
            names = rows = None
        elif rows is not None and names is not None and text:
            cells = text.split()
            if len(cells) != len(names):
                raise DataError(
                    f"{path} must have {len(names)} numbers in each row of a block, but line {at} has {len(cells)}: "
                    "save it again."
                )
            rows.append(cells)
        for command in text[1:].split(";") if text.startswith("X ") else ():
            if (scale := SCALE.fullmatch(command.strip())) is None:
                continue
            if scale["axis"].lower() in "yd":
                unit.update(dict.fromkeys(_names(scale["names"]), scale["unit"]))
            elif (scale["points"] or "").upper() == "/P" and scale["unit"] == "s":
                clock = float(scale["first"]), float(scale["step"])
    if rows is not None:
        raise DataError(f"{path} must end each block of numbers with END, but its last block has none: save it again.")
    lengths = {wave.value.size for wave in waves.values()}
    if len(lengths) != 1:
        raise DataError(
            f"{path} must have waves of one length, but has {len(waves)} waves of {sorted(lengths)} rows: save those "
            "that belong together in a file of their own."
        )
    columns = [RawColumn(name, wave, unit.get(name, "")) for name, wave in waves.items()]
    check_columns(path, len(columns))
    if clock is not None:
        count = lengths.pop()
        seconds = Numbers.whole(clock[0] + clock[1] * np.arange(count, dtype=np.float64))
        columns.insert(0, RawColumn("x scale time", seconds, "s"))
    left_out = (f"{unread} cells that could not be read",) if unread else ()
    return RawTable(path, f"Igor text, {encoding}", tuple(columns), (), left_out)


def _names(words: str) -> list[str]:
    return [quoted or plain for quoted, plain in NAME.findall(words)]
