"""Boxes of an MP4 or QuickTime file, and the tables in them.

Source: ISO/IEC 14496-12, 4.2 (boxes), 8.2.2 and 8.4.2 (`mvhd`, `mdhd`), 8.6.6 (`elst`).
"""

import mmap
import struct
from collections.abc import Iterator

HEAD_BYTES, LONG_HEAD_BYTES = 8, 16
INNER = frozenset({b"moov", b"trak", b"mdia", b"minf", b"stbl", b"edts"})
"""Boxes that contain other boxes."""


def boxes(content: mmap.mmap, begin: int, end: int) -> Iterator[tuple[bytes, int, int]]:
    """List the boxes of an MP4 file with the positions of their contents; inner boxes follow the outer box."""
    while begin + HEAD_BYTES <= end:
        size, name = struct.unpack_from(">I4s", content, begin)
        inside = begin + HEAD_BYTES
        if size == 1 and begin + LONG_HEAD_BYTES <= end:
            (size,) = struct.unpack_from(">Q", content, begin + HEAD_BYTES)
            inside = begin + LONG_HEAD_BYTES
        last = end if size == 0 else begin + size
        if last < inside or last > end:
            return
        yield name, inside, last
        if name in INNER:
            yield from boxes(content, inside, last)
        begin = last


def numbers(content: mmap.mmap, begin: int, end: int) -> tuple[int, int]:
    """Ticks per second, and duration in ticks, as stated in a box `mvhd` or `mdhd`."""
    form = ">4x8xII" if content[begin] == 0 else ">4x16xIQ"
    scale, ticks = struct.unpack_from(form, content[begin:end])
    return scale, ticks


def rows(content: mmap.mmap, place: tuple[int, int], form: str) -> Iterator[tuple[int, int]]:
    """Rows of a table that begins with the number of its rows.

    Raises
    ------
    struct.error
        The table has fewer rows than stated.
    """
    begin, end = place
    (count,) = struct.unpack_from(">4xI", content[begin:end])
    size = struct.calcsize(form)
    if begin + 8 + count * size > end:
        raise struct.error("fewer rows than announced")
    for k in range(count):
        one, other = struct.unpack_from(form, content, begin + 8 + k * size)
        yield one, other


def edits(content: mmap.mmap, place: tuple[int, int]) -> Iterator[tuple[int, int]]:
    """Durations in an edit list, with the ticks at which they begin; -1 means that nothing is shown.

    Raises
    ------
    struct.error
        There are fewer than announced.
    """
    is_long = content[place[0]] == 1
    form, size = (">Qq", 20) if is_long else (">Ii", 12)
    (count,) = struct.unpack_from(">4xI", content[slice(*place)])
    if place[0] + 8 + count * size > place[1]:
        raise struct.error("fewer rows than announced")
    for k in range(count):
        duration, at = struct.unpack_from(form, content, place[0] + 8 + k * size)
        yield duration, at
