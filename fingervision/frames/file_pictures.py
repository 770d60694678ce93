"""Pictures of an open video file, in order, with lost frames in place of broken or missing pictures."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import av

from fingervision.frames.avi_places import AviPlaces
from fingervision.frames.coded_times import is_shown
from fingervision.frames.cut_off import cut_off
from fingervision.frames.damage import DamageTrail, Picture
from fingervision.frames.matroska_checksums import BROKEN, UNCHECKED_CODECS, ClusterChecksums
from fingervision.frames.matroska_times import ClusterTimes
from fingervision.frames.missing_references import OWN_RECORDING, missing_references
from fingervision.frames.mp4_durations import NO_SCALE, states_another_duration
from fingervision.frames.open_container import open_container
from fingervision.frames.sound_jpeg import SoundJpeg
from fingervision.frames.spoken_damage import Heard, listening
from fingervision.frames.stream_losses import StreamLosses

MISSING = "Bytes are damaged or missing in the file"
NO_COUNT = (
    f"{MISSING} here. AVI files contain no times, only a count of frames, so that the times of the following "
    "frames are not known."
)
NO_CLUSTER = (
    "The time that the file states for the next frames (a Matroska cluster) is damaged, because it contradicts the "
    "file's index or the neighbouring frames; the times of these frames are not known."
)


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
            yield from _decoded(packet, trail, heard, jpegs)
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
    clusters = ClusterTimes(path, stream.index) if "matroska" in container.format.name else None
    is_doubtful = False
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
        if clusters is not None and packet is not None and packet.size:
            was_doubtful, is_doubtful = is_doubtful, clusters.is_doubtful(packet.pos)
            loses_time = NO_CLUSTER if is_doubtful and not was_doubtful else ""
            if is_doubtful:
                packet.pts = packet.dts = None
        if is_timeless and packet is not None:
            packet.pts = packet.dts = None
        if before is not None:
            if hole or end:
                is_last = (packet is None or not packet.size) and not end
                before = replace(before, hole="" if is_last else hole, end=end, at_end=hole if is_last else "")
            yield before
        if packet is None:
            return
        if is_timeless and before is None:
            loses_time = NO_SCALE
        before = _Read(packet, missing, loses_time, places is not None)


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
    packet: "av.Packet[av.VideoStream]", trail: DamageTrail, heard: Heard, jpegs: SoundJpeg
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
    for picture in decoded:
        yield from trail.leaves(picture)
