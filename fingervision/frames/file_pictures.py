"""Pictures of an open video file, in order, with lost frames in place of broken or missing pictures."""

import re
import struct
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

import av
import numpy as np
from numpy.typing import NDArray

from fingervision.frames.damage import DamageTrail, Picture
from fingervision.frames.missing_references import OWN_RECORDING, is_shown, missing_references
from fingervision.frames.mp4_durations import NO_SCALE, states_another_duration
from fingervision.frames.open_container import Heard, listening, open_container
from fingervision.frames.sound_jpeg import SoundJpeg
from fingervision.frames.stream_losses import StreamLosses
from fingervision.frames.unchecked_codecs import BROKEN, UNCHECKED_CODECS, ClusterChecksums


def cut_off(
    container: av.container.InputContainer, stream: av.VideoStream, packets: int, last_end_s: float | None
) -> str | None:
    """Return a sentence if the file states more video than it contains.

    Parameters
    ----------
    container, stream : PyAV's
        PyAV's objects for file and video stream, after reading to the end.
    packets : int
        Number of packets read.
    last_end_s : float or None
        End time of the last packet.

    Returns
    -------
    str or None
        A sentence; None if the file is complete.
    """
    kind = container.format.name
    if "mp4" in kind and stream.frames > packets:
        return f"The recording is truncated here: the file states {stream.frames} frames but contains {packets}."
    stated_s = None
    if "matroska" in kind:
        stated_s = _clock_s(stream.metadata.get("DURATION")) or (
            container.duration / av.time_base if container.duration and len(container.streams) == 1 else None
        )
    elif "avi" in kind and stream.duration and stream.time_base:
        stated_s = float(stream.duration * stream.time_base)
    if stated_s is None or not stream.average_rate:
        return None
    # A difference of one and a half frames is permitted, because containers round, and state the start or the end of
    # the last frame.
    if stated_s - (last_end_s or 0.0) > 1.5 / float(stream.average_rate):
        return (
            f"The recording is truncated here: the file states {stated_s:.2f} s but contains {last_end_s or 0.0:.2f} s."
        )
    return None


def _clock_s(clock: str | None) -> float | None:
    """Convert Matroska's hours:minutes:seconds to seconds."""
    try:
        hours, minutes, seconds = (float(part) for part in (clock or "").split(":"))
    except ValueError:
        return None
    return 3600.0 * hours + 60.0 * minutes + seconds


# Frame number of an AVI packet from its position in the file, because AVI stores no times, only an order.
#
# If a reader loses a frame at a damaged place and continues to count, every later frame gets too low a number. The
# file's own index (idx1) states the position of each frame, so that a packet at a stated position is identified even if
# other packets were lost before. If bytes are missing, the following packets lie nearer to the start of the file than
# the index states. Packets at shifted positions are identified by a sequence of packet lengths that occurs only once in
# the rest of the index. If no byte is missing, a packet at a position that is not in the index was never written: its
# header is damaged. Without a valid index, frames are counted as long as the chunks follow each other without a gap.
#
# Source: Microsoft, AVI RIFF File Reference (chunks, LIST, idx1).


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
            begin = _list_of_pictures(file.read(HEAD_BYTES))
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


def _list_of_pictures(head: bytes) -> int:
    """Position of the word `movi`; -1 if the chunks before it do not lead there, because damage has moved the word."""
    at = 12  # behind `RIFF`, its length, and `AVI `
    while at + HEADER_BYTES < len(head):
        if head[at : at + 4] == b"LIST" and head[at + HEADER_BYTES : at + HEADER_BYTES + 4] == b"movi":
            return at + HEADER_BYTES
        length = int.from_bytes(head[at + 4 : at + HEADER_BYTES], "little")
        at += HEADER_BYTES + length + length % 2
    return -1


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


MISSING = "Bytes are damaged or missing in the file"
NO_COUNT = (
    f"{MISSING} here. AVI files contain no times, only a count of frames, so that the times of the following "
    "frames are not known."
)


OVERLAP = "the next picture begins within its bytes"
"""Bytes belong to one picture: a block that reaches into the next one stands where a damaged file has moved it."""


def pictures(container: av.container.InputContainer, stream: av.VideoStream, path: Path) -> Iterator[Picture]:
    """Decode an open file.

    Parameters
    ----------
    container, stream : PyAV's
        PyAV's objects for file and video stream, at the start of the file; the decoder is set to strict mode.
    path : Path
        The file.

    Yields
    ------
    (int or None, VideoFrame or str)
        Tick and picture in order of presentation, or the reason why there is no picture.
    """
    trail = DamageTrail()
    packets, last_end_s, at_end = 0, None, ""
    losses = StreamLosses(container.format.name, stream)
    codec, tick_s = stream.codec_context.name, stream.time_base
    is_judged = container.metadata.get("comment") == OWN_RECORDING
    unfollowed = {} if is_judged else missing_references(path, stream, container.format.name)
    is_unchecked = stream.codec.canonical_name in UNCHECKED_CODECS and "matroska" in container.format.name
    checksums = ClusterChecksums(path) if is_unchecked else None
    with listening(codec) as heard:
        jpegs = SoundJpeg(codec)
        jpegs.learn(_first_packets(path, stream))
        for read in _read(container, stream, path, heard):
            packet = read.packet
            yield from _before(read, trail)
            if packet.size:
                if packets in unfollowed:
                    trail.missing(unfollowed[packets])
                packets += 1
                if leap := losses.before(packet, trail):
                    yield None, leap
                trail.enters(packet, is_shown=is_shown(packet, codec))
                if checksums is not None and checksums.is_broken(packet.pos):
                    trail.breaks(BROKEN)
                losses.behind(packet, trail)
                if packet.pts is not None and tick_s is not None:
                    end_tick = packet.pts + (packet.duration or 0)
                    last_end_s = max(last_end_s or 0.0, end_tick * tick_s.numerator / tick_s.denominator)
            at_end = at_end or read.at_end
            if read.hole:
                trail.breaks(f"{MISSING} after this frame ({read.hole}).")
            yield from _decoded(packet, trail, heard, jpegs, losses)
            if read.hole and not read.is_placed:
                trail.hole(f"{MISSING} before this frame ({read.hole}).")
                yield None, f"{MISSING} ({read.hole}); frames may be missing here."
            if read.end:
                yield from trail.rest()
                yield None, read.end
                return
    yield from trail.rest()
    missing = cut_off(container, stream, packets, last_end_s)
    if missing or at_end:
        yield None, missing or f"{MISSING} at the end of the file ({at_end})."


def picture_times_s(path: Path) -> list[float]:
    """Times of all pictures of a file, in order of presentation, read from its packets without decoding.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    list of float
        Times (s); empty unless every packet is one picture with a time of its own and nothing is missing between them,
        so that the number of a picture in `pictures` is its place in this list.
    """
    ticks: list[int] = []
    with open_container(path) as container:
        stream = container.streams.video[0]
        codec, tick_s = stream.codec_context.name, stream.time_base
        with listening(codec) as heard:
            for read in _read(container, stream, path, heard):
                packet = read.packet
                if read.missing or read.loses_time or read.hole or read.end or read.at_end:
                    return []
                if not packet.size:
                    continue
                if packet.pts is None or packet.is_discard or packet.is_corrupt or not is_shown(packet, codec):
                    return []
                ticks.append(packet.pts)
        if StreamLosses(container.format.name, stream).is_even or tick_s is None or len(set(ticks)) < len(ticks):
            return []
    return [tick * tick_s.numerator / tick_s.denominator for tick in sorted(ticks)]


@dataclass(frozen=True, slots=True, eq=False)
class _Read:
    """A packet, with the information on its position that only the next packet gives.

    Parameters
    ----------
    packet : av.Packet
        The packet, with the time of its own frame.
    missing : tuple of int
        Ticks of frames that are missing before the packet.
    loses_time : str
        Reason why times of frames are not known from here on; empty if they are, or the reason was given before.
    is_placed : bool
        Whether missing frames can be detected from positions in the file.
    hole : str
        Damage between this packet and the next one; empty if there is none.
    end : str
        Reason why there is no next packet, if that is damage.
    at_end : str
        Message of the container reader at the end of the file, mostly that the file is truncated.
    """

    packet: "av.Packet[av.VideoStream]"
    missing: tuple[int, ...]
    loses_time: str
    is_placed: bool
    hole: str = ""
    end: str = ""
    at_end: str = ""


def _read(container: av.container.InputContainer, stream: av.VideoStream, path: Path, heard: Heard) -> Iterator[_Read]:
    """Read packets one ahead, because a gap in the stream is only visible in the packet after it."""
    demuxed = container.demux(stream)
    places = AviPlaces(path, stream.index, len(container.streams)) if container.format.name == "avi" else None
    is_timeless = "mp4" in container.format.name and states_another_duration(path)
    before: _Read | None = None
    while True:
        end, packet = "", None
        try:
            packet = next(demuxed, None)
        except av.FFmpegError as error:
            end = f"The rest of the file cannot be read ({error.strerror})."
        except IndexError:
            # PyAV raises IndexError if a damaged file seems to begin a further stream.
            end = "The rest of the file cannot be read (a further stream seems to begin in its middle)."
        hole = heard.of_file()
        missing: tuple[int, ...] = ()
        loses_time = ""
        if places is not None and packet is not None and packet.size and packet.dts is not None and packet.pos:
            was_lost = places.is_lost
            number = places.number(packet.pos, packet.size)
            missing, loses_time = places.missing, NO_COUNT if places.is_lost and not was_lost else ""
            hole = "a different chunk was expected here" if places.after_hole and not was_lost else ""
            if number is None:
                packet.pts = packet.dts = None
            else:
                packet.pts, packet.dts = None if packet.pts is None else packet.pts + number - packet.dts, number
        if is_timeless and packet is not None:
            packet.pts = packet.dts = None
        if before is not None:
            if not hole and packet is not None and "matroska" in container.format.name:
                hole = OVERLAP if _overlaps(before.packet, packet) else ""
            if hole or end:
                is_last = (packet is None or not packet.size) and not end
                before = replace(before, hole="" if is_last else hole, end=end, at_end=hole if is_last else "")
            yield before
        if packet is None:
            return
        if is_timeless and before is None:
            loses_time = NO_SCALE
        before = _Read(packet, missing, loses_time, places is not None)


def _overlaps(before: "av.Packet[av.VideoStream]", packet: "av.Packet[av.VideoStream]") -> bool:
    """Whether a packet begins within the bytes of the one before; packets of one block have one position."""
    first, second = before.pos, packet.pos
    return first is not None and second is not None and first < second < first + before.size


def _before(read: _Read, trail: DamageTrail) -> Iterator[Picture]:
    """Record the frames that are missing before a packet."""
    if read.loses_time:
        if read.is_placed:
            trail.hole(f"{MISSING} before this frame.")
        yield None, read.loses_time
    for tick in read.missing:
        trail.lost(tick, f"{MISSING}, including this frame.")


def _first_packets(path: Path, stream: av.VideoStream) -> Iterator[bytes]:
    with suppress(av.FFmpegError, IndexError, OSError), open_container(path) as container:
        for packet in container.demux(container.streams[stream.index]):
            if packet.size:
                yield bytes(packet)


def _decoded(
    packet: "av.Packet[av.VideoStream]", trail: DamageTrail, heard: Heard, jpegs: SoundJpeg, losses: StreamLosses
) -> Iterator[Picture]:
    fault = jpegs.fault(bytes(packet)) if packet.size else ""
    if fault:
        trail.breaks(f"The frame is damaged in the file ({fault}).")
    try:
        decoded = packet.decode()
    except av.FFmpegError as error:
        trail.breaks(f"The frame could not be decoded ({error.strerror}).")
        return
    finally:
        said = heard.of_picture()
    if said:
        trail.breaks(f"The frame is damaged in the file ({said}).")
    if packet.size:
        losses.decoded(packet, heard, trail)
    for picture in decoded:
        yield from trail.leaves(picture)
