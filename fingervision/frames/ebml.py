"""Elements of a Matroska or WebM file: names, lengths and positions.

Source: RFC 8794 (EBML), 4 and 5 (variable-size numbers).
"""

import os
from dataclasses import dataclass
from typing import BinaryIO, overload

# Number of bytes that are searched at once.
BLOCK_BYTES = 1 << 20


class FileBytes:
    """The bytes of a file, each read when it is asked for.

    The pages of a memory map would stay in memory after they have been read, as many as the file has.

    Parameters
    ----------
    file : BinaryIO
        The file, open for reading.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file, self._size = file, file.seek(0, os.SEEK_END)

    def __len__(self) -> int:
        """Size of the file in bytes."""
        return self._size

    @overload
    def __getitem__(self, place: int) -> int: ...
    @overload
    def __getitem__(self, place: "slice[int, int, None]") -> bytes: ...
    def __getitem__(self, place: "int | slice[int, int, None]") -> int | bytes:
        """One byte, or those from one position to another."""
        if isinstance(place, int):
            self._file.seek(place)
            return self._file.read(1)[0]
        self._file.seek(place.start)
        return self._file.read(max(0, place.stop - place.start))

    def find(self, name: bytes, begin: int = 0) -> int:
        """Position at which some bytes first occur behind `begin`; -1 if they do not."""
        step = BLOCK_BYTES - len(name) + 1
        for at in range(begin, self._size, step):
            if (inside := self[at : at + BLOCK_BYTES].find(name)) >= 0:
                return at + inside
        return -1

    def rfind(self, name: bytes) -> int:
        """Position at which some bytes last occur; -1 if they do not."""
        step = BLOCK_BYTES - len(name) + 1
        for at in range(self._size - BLOCK_BYTES, -BLOCK_BYTES, -step):
            if (inside := self[max(0, at) : at + BLOCK_BYTES].rfind(name)) >= 0:
                return max(0, at) + inside
        return -1


@dataclass(frozen=True, slots=True)
class Element:
    """An EBML element: its name, and the position of its content.

    Parameters
    ----------
    name : bytes
        Identifier of the element, including the bits that mark the identifier's length.
    begin, end : int
        Positions in the file at which the element's content begins and ends.
    """

    name: bytes
    begin: int
    end: int


def element(content: FileBytes, at: int) -> Element | None:
    """Read the element that begins at a given position; None if no element begins there.

    An element of unknown length, as in live streams, extends to the file's end.
    """
    name, begin = number(content, at, keep_marker=True)
    if begin == at or begin - at > 4:
        return None
    size, inside = number(content, begin, keep_marker=False)
    if inside == begin:
        return None
    unknown = size == (1 << (7 * (inside - begin))) - 1
    end = len(content) if unknown else min(inside + size, len(content))
    return Element(name.to_bytes(begin - at, "big"), inside, end)


def children(content: FileBytes, parent: Element) -> list[Element]:
    """List the elements inside another element, up to the first that is incomplete."""
    found, at = [], parent.begin
    while at < parent.end and (child := element(content, at)) is not None and child.end <= parent.end:
        found.append(child)
        at = child.end
    return found


def child(content: FileBytes, parent: Element, name: bytes) -> Element | None:
    """Find the first element with a given name inside another element."""
    return next((each for each in children(content, parent) if each.name == name), None)


def number(content: FileBytes, at: int, *, keep_marker: bool) -> tuple[int, int]:
    """Read a number of 1 to 8 bytes, and return the number and its end position (if no number: start position)."""
    if at >= len(content) or content[at] == 0:
        return 0, at
    length = 9 - content[at].bit_length()
    if at + length > len(content):
        return 0, at
    value = int.from_bytes(content[at : at + length], "big")
    return value if keep_marker else value & ((1 << (7 * length)) - 1), at + length
