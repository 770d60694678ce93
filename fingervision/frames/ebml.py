"""Elements of a Matroska or WebM file: names, lengths and positions.

Source: RFC 8794 (EBML), 4 and 5 (variable-size numbers).
"""

import mmap
from dataclasses import dataclass


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


def element(content: mmap.mmap, at: int) -> Element | None:
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


def children(content: mmap.mmap, parent: Element) -> list[Element]:
    """List the elements inside another element, up to the first that is incomplete."""
    found, at = [], parent.begin
    while at < parent.end and (child := element(content, at)) is not None and child.end <= parent.end:
        found.append(child)
        at = child.end
    return found


def child(content: mmap.mmap, parent: Element, name: bytes) -> Element | None:
    """Find the first element with a given name inside another element."""
    return next((each for each in children(content, parent) if each.name == name), None)


def number(content: mmap.mmap, at: int, *, keep_marker: bool) -> tuple[int, int]:
    """Read a number of 1 to 8 bytes, and return the number and its end position (if no number: start position)."""
    if at >= len(content) or content[at] == 0:
        return 0, at
    length = 9 - content[at].bit_length()
    if at + length > len(content):
        return 0, at
    value = int.from_bytes(content[at : at + length], "big")
    return value if keep_marker else value & ((1 << (7 * length)) - 1), at + length
