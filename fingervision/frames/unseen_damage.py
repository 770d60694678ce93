"""Look for damage in a whole file before its first frame is returned, for codecs that notice only some damage.

The arithmetic decoders of VP8 and VP9 give a picture for any bytes, and notice damage only if it makes them read past
the end of a packet. Damage that a decoder notices in one packet is therefore evidence of unnoticed damage in other
packets. In simulated files with 1 to 20 faults, two thirds of the wrong pictures that looked undamaged were in files
with a noticed fault (`tests/benchmarks/damaged_files.py`). If a file with noticed damage has no checksums, none of its
frames can be trusted. Files with checksums are judged cluster by cluster instead (`matroska_checksums`).

Missing whole pictures, a missing end, and packets before the first key frame are not evidence of damaged bytes.
"""

from functools import lru_cache
from pathlib import Path

import av

from fingervision.frames.matroska_checksums import UNCHECKED_CODECS, ClusterChecksums
from fingervision.frames.missing_references import OWN_RECORDING
from fingervision.frames.open_container import STRICT, listening, open_container

FILES_KEPT = 16
DAMAGE_SEEN = (
    "This recording is damaged ({what}), and {codec} has no checksums, so that further damage cannot be detected in "
    "any frame: copy the file again from its source, or cut out an undamaged part (`ffmpeg -ss 10 -to 20 -i IN -c "
    "copy OUT.mkv`); record with FFV1 or H.264."
)


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
