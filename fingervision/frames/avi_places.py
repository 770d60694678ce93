"""Frame number of an AVI packet from its position in the file, because AVI stores no times, only an order.

If a reader loses a frame at a damaged place and continues to count, every later frame gets too low a number. The file's
own index (idx1) states the position of each frame, so that a packet at a stated position is identified even if other
packets were lost before. If bytes are missing, the following packets lie nearer to the start of the file than the index
states. Packets at shifted positions are identified by a sequence of packet lengths that occurs only once in the rest of
the index. If no byte is missing, a packet at a position that is not in the index was never written: its header is
damaged. Without a valid index, frames are counted as long as the chunks follow each other without a gap.

Source: Microsoft, AVI RIFF File Reference (chunks, LIST, idx1).
"""

import re
import struct
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

# Bytes at the start of a file in which the list of frames is searched, and bytes at its end in which the index is
# searched.
HEAD_BYTES, TAIL_BYTES = 1 << 20, 1 << 25
# Largest number of other chunks (sound, indices) between two pictures.
CHUNKS_BETWEEN = 64
HEADER_BYTES = 8
ENTRY = np.dtype([("id", "S4"), ("flags", "<u4"), ("offset", "<u4"), ("size", "<u4")])
KINDS = (b"dc", b"db")
KNOWN_CHUNK = re.compile(rb"\d\d(dc|db|wb|tx|pc|iv)|ix\d\d|rec ")


class AviPlaces:
    """Assigns frame numbers to the packets of a video stream, which must be given in the order of the file.

    Parameters
    ----------
    path : Path
        Path of the file.
    stream : int
        Number of the video stream in the file.
    streams : int
        Number of streams in the file.
    """

    def __init__(self, path: Path, stream: int, streams: int) -> None:
        self._path, self._tag = path, b"%02d" % stream
        with path.open("rb") as file:
            begin = file.read(HEAD_BYTES).find(b"movi")
            self._offsets, self._sizes, self._most_missing = _index(file, self._tag, begin, streams)
        self.after_hole = False
        """Whether bytes are missing between the starts of the last two packets, so that the first of the two may be
        damaged.
        """
        self._by_offset = {int(offset): number for number, offset in enumerate(self._offsets)}
        self._end: int | None = begin + 4 if begin >= 0 else None
        self._missing = 0
        self._possible = np.zeros(0, np.int64)
        self._number = -1
        self.is_lost = False
        """Whether the previous packet could not be assigned a number."""
        self.missing: tuple[int, ...] = ()
        """Numbers of frames that the index lists, with a picture, between the last two packets with a number."""

    def number(self, position: int, size: int) -> int | None:
        """Frame number, from 0, of the packet whose bytes start at a given position; None if it cannot be determined.

        Parameters
        ----------
        position : int
            Start of the packet's bytes, after the header of its chunk.
        size : int
            Number of bytes.
        """
        begin, missing = position - HEADER_BYTES, self._missing
        found = self._by_offset.get(begin + self._missing)
        if found is None or self._sizes[found] != size or found <= self._number:
            found = self._by_length(begin, size)
        if found is None and not self.is_lost:
            found = self._counted(begin)
        self.is_lost = found is None
        self._end = position + size + size % 2
        self.missing = ()
        if found is not None:
            between = range(self._number + 1, min(found, len(self._sizes)))
            self.missing = tuple(number for number in between if self._sizes[number] > 0)
            self._number = found
        self.after_hole = self.is_lost or bool(self.missing) or self._missing != missing
        return found

    def _by_length(self, begin: int, size: int) -> int | None:
        """Frame number from the lengths of a packet and of the unidentified packets before, if only one number fits."""
        if self.is_lost:
            possible = self._possible + 1
            possible = possible[possible < len(self._sizes)]
        else:
            possible = np.arange(self._number + 1, len(self._sizes))
        # Missing bytes shift all later packets towards the file's start, at most by the number of bytes missing before
        # the index.
        nearer = self._offsets[possible] - begin
        alike = (self._sizes[possible] == size) & (nearer >= self._missing) & (nearer <= self._most_missing)
        self._possible = possible[alike]
        if len(self._possible) != 1:
            return None
        number = int(self._possible[0])
        self._missing = int(self._offsets[number]) - begin
        return number

    def _counted(self, begin: int) -> int | None:
        """Number of pictures up to a chunk, including pictures that the camera or the reader dropped."""
        if self._end is None:
            return None
        at, number = self._end, self._number + 1
        with self._path.open("rb") as file:
            for _ in range(CHUNKS_BETWEEN):
                if at == begin:
                    return number
                file.seek(at)
                header = file.read(HEADER_BYTES)
                if at > begin or len(header) < HEADER_BYTES or not header[:4].isalnum():
                    return None
                (length,) = struct.unpack("<I", header[4:])
                if header[:4] == b"LIST":
                    length = 4  # the kind of the list; its content follows
                elif header[:2] == self._tag and header[2:4] in KINDS:
                    number += 1
                at += HEADER_BYTES + length + length % 2
        return None


def _index(file: BinaryIO, tag: bytes, begin: int, streams: int) -> tuple[NDArray[np.int64], NDArray[np.int64], int]:
    """Read each frame's position and length from the index, and the number of bytes missing before the index."""
    end = file.seek(0, 2)
    start = max(0, end - TAIL_BYTES)
    file.seek(start)
    tail = file.read()
    at = tail.rfind(b"idx1")
    nothing = np.zeros(0, np.int64)
    if at < 0 or begin < 0:
        return nothing, nothing, 0
    stated = int.from_bytes(tail[at + 4 : at + 8], "little")
    count = min(stated, len(tail) - at - 8) // ENTRY.itemsize
    entries = np.frombuffer(tail, ENTRY, count, at + 8)
    if not all(map(KNOWN_CHUNK.fullmatch, entries["id"].tolist())) or np.any(
        np.diff(entries["offset"].astype(int)) <= 0
    ):
        return nothing, nothing, 0  # a damaged index would give wrong numbers
    is_chunk = np.array([name[:2].isdigit() for name in entries["id"].tolist()], dtype=bool)
    if streams == 1:
        chosen = entries[is_chunk]  # a chunk with a damaged name is a frame nevertheless
    elif all(int(name[:2]) < streams for name in entries["id"][is_chunk].tolist()):
        chosen = entries[np.isin(entries["id"], [tag + kind for kind in KINDS])]
    else:
        return nothing, nothing, 0
    offsets, sizes = chosen["offset"].astype(np.int64), chosen["size"].astype(np.int64)
    # Offsets are relative to the word `movi`; some programs state them relative to the beginning of the file.
    base = begin if len(offsets) and offsets[0] < begin else 0
    ends = entries["offset"].astype(np.int64) + base + HEADER_BYTES + entries["size"] + entries["size"] % 2
    most_missing = max(0, int(ends[-1]) - (start + at)) if len(ends) else 0
    return offsets + base, sizes, most_missing
