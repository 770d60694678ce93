"""Find pictures of a file that depend on a missing picture, for codecs that do not number all pictures.

H.264 numbers its pictures (see `stream_losses`), HEVC names the reference pictures, MPEG-2 has a constant rate. With
other codecs, a missing packet causes no decoding error: the differences of the next picture are added to an older
picture, and a moving finger is shown in an old position. Two criteria are used, both from times that are read before
decoding:

* In a file with equidistant times (coded at a constant rate), a gap in the times of a whole number of steps means that
  pictures are missing. If times are irregular, or gaps are frequent, the camera or the encoder skipped pictures, and a
  gap proves nothing: a missing picture is then not detected. If every n-th picture is a key frame and n packets lie
  between two key frames, no picture is missing: the camera paused.
* A B picture (decoded when it is shown, in a file that decodes others earlier) lies between two other pictures in time.
  A B picture that is presented after all pictures received so far depends on a missing picture.

AVI is not judged by times, because AVI counts frames and marks an omitted frame by an empty chunk.
"""

from bisect import bisect_right
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from statistics import fmean, median
from typing import Any

import av

from fingervision.frames.open_container import listening, open_container

COUNTED_CODECS = frozenset({"h264", "hevc", "vvc", "mpeg1video", "mpeg2video"})
"""Codecs, by FFmpeg's names, whose missing references are detected elsewhere."""
ADAPTING_CODECS = frozenset({"ffv1"})
"""Codecs of whole pictures whose non-key frames are decoded with statistics of the frames before."""
INTRA_PROPERTY = 1  # FFmpeg's AV_CODEC_PROP_INTRA_ONLY
TIMED_CONTAINERS = ("mov", "matroska", "flv", "asf", "ogg")
# Times are equidistant if at least this number of steps equal the usual step, and this share of all steps are whole
# multiples of it. Times from a camera's clock scatter by more than a tick in more than 2 % of the steps; a few wrong
# times are damage of the file.
EVEN_STEPS, EVEN_SHARE = 8, 0.98
# Permitted deviation of a step (ticks): containers round both times of a step to a tick.
TICKS = 1.01
# With a larger share of holes, the encoder left out pictures deliberately, for instance unchanged pictures; so many
# losses in a network or on a disk would be noticed.
MOST_HOLES = 0.2
# Number of steps on each side with which a longer step is compared: a camera in weak light may continue at half the
# rate, which is no hole.
BESIDE = 4
# Key frames are regarded as regular if at least three distances between them are known, and nine in ten are equal.
FEWEST_LENGTHS, KEYS_SHARE = 3, 0.9

OWN_RECORDING = "Recorded by fingervision, with a list of the lost frames in the same folder."
"""Comment in a container whose packets were checked during the recording, and whose list of lost frames is stored with
it."""

SHOWN_TOO_LATE = (
    "A picture on which the frame depends is missing: the frame must be shown between two pictures, but "
    "the second is not there."
)
TIME_LEFT_OUT = (
    "A picture on which the frame depends is missing: {count} of the recording's otherwise equidistant times are "
    "missing before the frame. If the camera itself skipped these pictures, convert the file with `ffmpeg -i IN -c:v "
    "ffv1 -g 1 OUT.mkv`, and measure the converted file."
)


@dataclass(frozen=True, slots=True)
class CodedTime:
    """A packet of a video, in decoding order.

    Parameters
    ----------
    tick : int or None
        Presentation time of the picture.
    is_key : bool
        Whether decoding can start with this packet.
    is_shown : bool
        Whether the packet gives a picture; VP8 has packets that only serve as references.
    is_needed : bool
        Whether other pictures may depend on this one (it is no B picture).
    """

    tick: int | None
    is_key: bool
    is_shown: bool = True
    is_needed: bool = True


def is_shown(packet: "av.Packet[Any]", codec: str) -> bool:
    """Whether a packet presents a picture, which VP8 states in a bit of the first byte (RFC 6386, 9.1)."""
    return codec != "vp8" or bool(bytes(packet)[0] & 0x10)


def coded_times(path: Path, stream: av.VideoStream) -> list[CodedTime]:
    """Read the packets of a file, without decoding, as far as the file can be read.

    Parameters
    ----------
    path : Path
        The file.
    stream : av.VideoStream
        The video stream, opened elsewhere.
    """
    read: list[tuple[int | None, int | None, bool, bool]] = []
    codec = stream.codec.canonical_name
    with listening(codec), suppress(av.FFmpegError, IndexError, OSError), open_container(path) as container:
        packets = (packet for packet in container.demux(container.streams[stream.index]) if packet.size)
        read.extend((packet.pts, packet.dts, packet.is_keyframe, is_shown(packet, codec)) for packet in packets)
    is_reordered = any(pts is not None and dts is not None and pts > dts for pts, dts, _, _ in read)
    return [
        CodedTime(dts if pts is None else pts, key, shown, not is_reordered or key or pts != dts)
        for pts, dts, key, shown in read
    ]


def missing_references(path: Path, stream: av.VideoStream, container_format: str) -> dict[int, str]:
    """Read the packets of a file without decoding; return the packets before which a picture is missing.

    Parameters
    ----------
    path : Path
        The file.
    stream : av.VideoStream
        The video stream, opened elsewhere.
    container_format : str
        FFmpeg's name of the container format.

    Returns
    -------
    dict of int to str
        Reason why the pictures from a packet to the next key frame are damaged, by the packet's number in decoding
        order, from 0.
    """
    codec = stream.codec
    is_whole = codec.properties & INTRA_PROPERTY and codec.canonical_name not in ADAPTING_CODECS
    if is_whole or codec.canonical_name in COUNTED_CODECS:
        return {}
    if not any(name in container_format for name in TIMED_CONTAINERS):
        return {}
    return judged(coded_times(path, stream))


def judged(packets: list[CodedTime]) -> dict[int, str]:
    """Find the packets that depend on a missing picture before them.

    Parameters
    ----------
    packets : list of CodedTime
        All packets of a video, in decoding order.
    """
    found = dict.fromkeys(_shown_too_late(packets), SHOWN_TOO_LATE)
    return found | _by_time(packets)


def _shown_too_late(packets: list[CodedTime]) -> list[int]:
    latest: int | None = None
    found = []
    for number, packet in enumerate(packets):
        if packet.tick is None:
            continue
        if packet.is_needed:
            latest = packet.tick if latest is None else max(latest, packet.tick)
        elif latest is not None and packet.tick > latest:
            found.append(number)
    return found


def _by_time(packets: list[CodedTime]) -> dict[int, str]:
    """Find holes in equidistant times, and the packets that may depend on the missing pictures."""
    shown = sorted({packet.tick for packet in packets if packet.is_shown and packet.tick is not None})
    steps = [after - before for before, after in pairwise(shown)]
    usual = _usual(steps)
    if usual is None:
        return {}
    holes = [(shown[k], step) for k, step in enumerate(steps) if step > usual + TICKS and _sticks_out(steps, k)]
    if len(holes) > MOST_HOLES * len(steps):
        return {}
    needed = sorted((each.tick, k) for k, each in enumerate(packets) if each.is_needed and each.tick is not None)
    key_numbers = [k for k, each in enumerate(packets) if each.is_key]
    found: dict[int, str] = {}
    untold: dict[int, str] = {}
    has_paused = False
    for at, step in holes:
        count = round(step / usual) - 1
        if count < 1 or not _is_whole(step, usual):
            continue  # a pause of the camera, after which the times are not multiples of the step
        # The missing pictures were coded after the last reference picture before the hole.
        last = bisect_right(needed, (at, len(packets)))
        number = needed[last - 1][1] + 1 if last else 0
        if number >= len(packets) or packets[number].is_key:
            continue
        all_came = _all_came(key_numbers, number, count)
        has_paused = has_paused or all_came is True
        if not all_came:
            (found if all_came is False else untold)[number] = TIME_LEFT_OUT.format(count=count)
    # In a group without end, nothing counts the pictures: there the camera does what it did in the others.
    return found if has_paused and not found else found | untold


def _all_came(key_numbers: list[int], number: int, count: int) -> bool | None:
    """Whether as many packets as usual lie between the key frames around a hole, which means that the camera paused.

    None if the key frames do not tell, because they are few or irregular, or none follows.

    A coder that makes every n-th picture a key frame counts the pictures that it coded. Lost pictures would reduce the
    number of packets between two key frames, unless a multiple of n was lost.
    """
    lengths = [after - before for before, after in pairwise(key_numbers)]
    behind = bisect_right(key_numbers, number)
    if len(lengths) < FEWEST_LENGTHS or not 0 < behind < len(key_numbers):
        return None
    usual, often = Counter(lengths).most_common(1)[0]
    if usual < 2 or often < KEYS_SHARE * len(lengths):
        return None
    return lengths[behind - 1] == usual and count % usual != 0


def _sticks_out(steps: list[int], k: int) -> bool:
    """Whether a time step is longer than the usual steps before and after it (at a change of rate, it is not)."""
    before, behind = steps[max(0, k - BESIDE) : k], steps[k + 1 : k + 1 + BESIDE]
    return all(steps[k] > median(some) + TICKS for some in (before, behind) if some)


def _is_whole(step: int, usual: float) -> bool:
    return abs(step - max(1, round(step / usual)) * usual) <= TICKS


def _usual(steps: list[int]) -> float | None:
    """Time step of equidistant times (ticks); None if the times are not equidistant."""
    if not steps:
        return None
    middle = sorted(steps)[len(steps) // 2]
    single = [step for step in steps if abs(step - middle) <= 2 * TICKS]
    if middle <= 0 or len(single) < EVEN_STEPS:
        return None
    usual = fmean(single)
    even = sum(_is_whole(step, usual) for step in steps)
    return usual if even >= EVEN_SHARE * len(steps) else None
