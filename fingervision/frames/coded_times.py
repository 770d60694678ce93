"""Times and numbers of a file's coded pictures, read without decoding."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import av

from fingervision.frames.av1_order import Av1Order
from fingervision.frames.mpeg4_headers import Mpeg4Headers, Mpeg4Kind
from fingervision.frames.open_container import open_container
from fingervision.frames.spoken_damage import listening


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
        Whether other pictures may depend on this one (it is no B picture of MPEG-4).
    turn : int or None
        The bit of MPEG-4 that toggles with every P picture.
    order, modulus : int or None
        Picture number of AV1, and the modulus of these numbers.
    """

    tick: int | None
    is_key: bool
    is_shown: bool = True
    is_needed: bool = True
    turn: int | None = None
    order: int | None = None
    modulus: int | None = None


def is_shown(packet: "av.Packet[Any]", codec: str) -> bool:
    """Whether a packet presents a picture, which VP8 states in a bit of the first byte (RFC 6386, 9.1)."""
    return codec != "vp8" or bool(bytes(packet)[0] & 0x10)


def coded_times(path: Path, stream: av.VideoStream) -> list[CodedTime]:
    """Read the packets of a file as far as the file can be read.

    Parameters
    ----------
    path : Path
        The file.
    stream : av.VideoStream
        The video stream, opened elsewhere.
    """
    with listening(stream.codec_context.name):
        return list(_coded_times(path, stream.index, stream.codec.canonical_name))


def _coded_times(path: Path, stream: int, codec: str) -> Iterator[CodedTime]:
    with suppress(av.FFmpegError, IndexError, OSError), open_container(path) as container:
        extradata = container.streams[stream].codec_context.extradata
        mpeg4, av1 = Mpeg4Headers(extradata), Av1Order(extradata)
        for packet in container.demux(container.streams[stream]):
            if not packet.size:
                continue
            tick = packet.dts if packet.pts is None else packet.pts
            if codec == "mpeg4":
                picture = mpeg4.of(bytes(packet))
                is_needed = picture is None or picture.kind is not Mpeg4Kind.B_PICTURE
                turn = None if picture is None else picture.rounding
                yield CodedTime(tick, packet.is_keyframe, is_needed=is_needed, turn=turn)
            elif codec == "av1":
                shown = av1.of(bytes(packet))
                is_key = packet.is_keyframe or (shown is not None and shown.is_key)
                order, modulus = (None, None) if shown is None else (shown.order, shown.modulus)
                yield CodedTime(tick, is_key, order=order, modulus=modulus)
            else:
                yield CodedTime(tick, packet.is_keyframe, is_shown(packet, codec))
