"""Damage in files of codecs that decode any bytes: checksums of Matroska's clusters, and damage noticed anywhere.

The arithmetic decoders of VP8 and VP9 give a picture for any bytes: after a flipped bit there is no error message, and
a finger may be shown at its position in an earlier frame. They notice damage only if it makes them read past the end of
a packet.

The container may help: a cluster whose first element is a CRC-32 states the checksum of all following bytes (FFmpeg
writes it into `.mkv`, not into `.webm`). If the checksum is wrong, every picture of the cluster counts as damaged, and
so does every later picture that depends on a damaged picture. Codecs that detect damage themselves are not checked by
checksums, because a codec rejects a single picture whereas a wrong checksum rejects a whole cluster; for them a wrong
checksum only says that times may be damaged.

Without checksums, damage that a decoder notices in one packet is evidence of unnoticed damage in other packets. In
simulated files with 1 to 20 faults, two thirds of the wrong pictures that looked undamaged were in files with a noticed
fault (`tests/benchmarks/damaged_files.py`). None of the frames of such a file can be trusted. Missing whole pictures, a
missing end, and packets before the first key frame are not evidence of damaged bytes.

Source: RFC 9559 (Matroska), 5.1.3 (clusters); RFC 8794 (EBML), 4 (sizes), 11.3.1 (CRC-32: of ISO 3309, little-endian).
"""

from binascii import crc32
from bisect import bisect_right
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO

import av

from fingervision.frames.missing_references import OWN_RECORDING
from fingervision.frames.open_container import STRICT, listening, open_container

CLUSTER = b"\x1f\x43\xb6\x75"
"""Name of a cluster (its EBML identifier)."""
CHECKSUM = b"\xbf\x84"
"""Name and length of a CRC-32, before its four bytes."""
LONGEST_SIZE, CHECKSUM_BYTES = 8, 6
# Number of bytes that are searched at once. The pages of a memory map would stay in memory, as many as the file has.
BLOCK_BYTES = 1 << 20
UNCHECKED_CODECS = frozenset({"vp8", "vp9"})
"""Codecs, by FFmpeg's canonical names, that decode any bytes without an error."""
BROKEN = (
    "Bytes are damaged in the part of the file that contains the frame: the checksum of its Matroska cluster is wrong."
)
FILES_KEPT = 16
DAMAGE_SEEN = (
    "This recording is damaged ({what}), and {codec} has no checksums, so that further damage cannot be detected in "
    "any frame: copy the file again from its source, or cut out an undamaged part (`ffmpeg -ss 10 -to 20 -i IN -c "
    "copy OUT.mkv`); record with FFV1 or H.264."
)


class ClusterChecksums:
    """The clusters of a file, each with the result of its checksum.

    Parameters
    ----------
    path : Path
        The file.
    """

    def __init__(self, path: Path) -> None:
        self._sound: list[tuple[int, int]] = []
        self.are_stated = False
        """Whether any cluster of the file has a checksum."""
        self.cover_all = False
        """Whether every cluster has a checksum that agrees with its bytes."""
        try:
            with path.open("rb") as file:
                self._read(file)
        except (OSError, ValueError):
            return

    def is_broken(self, position: int | None) -> bool:
        """Whether the packet at a given position lies in a cluster whose checksum is wrong or missing."""
        if not self.are_stated or position is None:
            return False
        at = bisect_right(self._sound, (position + 1, 0)) - 1
        return at < 0 or position >= self._sound[at][1]

    @property
    def is_any_broken(self) -> bool:
        """Whether a cluster of a file with checksums has a wrong one, or none."""
        return self.are_stated and not self.cover_all

    def _read(self, file: BinaryIO) -> None:
        size, at, clusters = file.seek(0, 2), _find(file, 0), 0
        while at >= 0:
            clusters += 1
            file.seek(at + len(CLUSTER))
            head = file.read(LONGEST_SIZE + CHECKSUM_BYTES)
            # A number of 1 to 8 bytes, of which the first bit that is 1 tells how many (RFC 8794, 4).
            length = 9 - head[0].bit_length() if head else 0
            stated = int.from_bytes(head[:length], "big") & ((1 << 7 * length) - 1)
            begin, next_at = at + len(CLUSTER) + length, at + len(CLUSTER)
            if head[length : length + len(CHECKSUM)] == CHECKSUM:
                self.are_stated = True
                # A cluster of unknown length, as in live streams, extends to the file's end.
                end = size if stated == (1 << 7 * length) - 1 else min(begin + stated, size)
                file.seek(begin + CHECKSUM_BYTES)
                found = crc32(file.read(max(0, end - begin - CHECKSUM_BYTES)))
                if head[length : length + CHECKSUM_BYTES] == CHECKSUM + found.to_bytes(4, "little"):
                    self._sound.append((at, end))
                    next_at = end
            at = _find(file, next_at)
        self.cover_all = self.are_stated and clusters == len(self._sound)


def _find(file: BinaryIO, begin: int) -> int:
    """Position at which a cluster first begins from a position on; -1 if none does."""
    while True:
        file.seek(begin)
        block = file.read(BLOCK_BYTES)
        if (inside := block.find(CLUSTER)) >= 0:
            return begin + inside
        if len(block) < BLOCK_BYTES:
            return -1
        begin += BLOCK_BYTES - len(CLUSTER) + 1


def unseen_damage(path: Path, stream: av.VideoStream, comment: str | None) -> str:
    """Return the reason why no frame of a file can be trusted; empty if no damage was noticed.

    Parameters
    ----------
    path : Path
        The file.
    stream : av.VideoStream
        The video stream, opened elsewhere.
    comment : str or None
        The container's comment; a recording of this program was checked packet by packet when it was made.
    """
    codec = stream.codec.canonical_name
    if codec not in UNCHECKED_CODECS or comment == OWN_RECORDING:
        return ""
    try:
        state = path.stat()
    except OSError:
        return ""
    return _noticed(path, stream.index, codec, state.st_size, state.st_mtime_ns)


@lru_cache(maxsize=FILES_KEPT)
def _noticed(path: Path, index: int, codec: str, size: int, changed_ns: int) -> str:
    if ClusterChecksums(path).are_stated:
        return ""
    has_begun, last_said, said = False, "", ""
    with open_container(path) as container:
        stream = container.streams[index]
        assert isinstance(stream, av.VideoStream)  # noqa: S101 - as it was when the file was opened before
        context = stream.codec_context
        context.options = STRICT
        with listening(context.name) as heard:
            packets = container.demux(stream)
            number = 0
            while True:
                try:
                    packet = next(packets, None)
                except (av.FFmpegError, IndexError):
                    break  # the end of the file is missing or cannot be read
                # A message of the container reader with the last packet concerns the end of the file.
                if has_begun and last_said:
                    said = last_said
                if said or packet is None or not packet.size:
                    break
                last_said = heard.of_file()
                try:
                    has_begun = any(not picture.is_corrupt for picture in packet.decode()) or has_begun
                    words = heard.of_picture()
                except av.FFmpegError as error:
                    words = heard.of_picture() or str(error.strerror)
                if has_begun and (words or packet.is_corrupt):
                    said = f"in coded picture {number}: {words or 'its packet is incomplete'}"
                number += 1
    return DAMAGE_SEEN.format(what=said, codec=codec.upper()) if said else ""
