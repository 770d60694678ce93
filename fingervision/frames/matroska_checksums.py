"""Verify the checksums of a Matroska file's clusters, for codecs that cannot detect damage themselves.

The arithmetic decoders of VP8 and VP9 give a picture for any bytes: after a flipped bit there is no error message, and
a finger may be shown at its position in an earlier frame. The container may help: a cluster whose first element is a
CRC-32 states the checksum of all following bytes (FFmpeg writes it into `.mkv`, not into `.webm`). If the checksum is
wrong, every picture of the cluster counts as damaged, and so does every later picture that depends on a damaged
picture. Codecs that detect damage themselves are not checked by checksums, because a codec rejects a single picture
whereas a wrong checksum rejects a whole cluster; for them a wrong checksum only says that times may be damaged.

Source: RFC 9559 (Matroska), 5.1.3 (clusters); RFC 8794 (EBML), 11.3.1 (CRC-32: of ISO 3309, little-endian).
"""

from binascii import crc32
from bisect import bisect_right
from pathlib import Path

from fingervision.frames.ebml import FileBytes, element
from fingervision.frames.matroska_times import CLUSTER

CHECKSUM = b"\xbf"
CHECKSUM_BYTES, ELEMENT_BYTES = 4, 6
UNCHECKED_CODECS = frozenset({"vp8", "vp9"})
"""Codecs, by FFmpeg's canonical names, that decode any bytes without an error."""
BROKEN = (
    "Bytes are damaged in the part of the file that contains the frame: the checksum of its Matroska cluster is wrong."
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
                self._read(FileBytes(file))
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

    def _read(self, content: FileBytes) -> None:
        at, clusters = content.find(CLUSTER), 0
        while at >= 0:
            clusters += 1
            cluster, end = element(content, at), at + len(CLUSTER)
            if cluster is not None:
                stated = _stated(content, cluster.begin)
                self.are_stated = self.are_stated or stated is not None
                if stated is not None and crc32(content[cluster.begin + ELEMENT_BYTES : cluster.end]) == stated:
                    self._sound.append((at, cluster.end))
                    end = cluster.end
            at = content.find(CLUSTER, end)
        self.cover_all = self.are_stated and clusters == len(self._sound)


def _stated(content: FileBytes, at: int) -> int | None:
    """Checksum at the beginning of a cluster; None if the cluster has no checksum."""
    first = element(content, at)
    if first is None or first.name != CHECKSUM or first.end - first.begin != CHECKSUM_BYTES:
        return None
    return int.from_bytes(content[first.begin : first.end], "little")
