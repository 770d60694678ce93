"""Packets that belong to a frame: all packets up to the frame's own, so that a recording ends with its table."""

import av

from fingervision.frames.network_stream import _until_shown
from fingervision.frames.source import OwnPacket


def own(pts: int | None) -> OwnPacket:
    packet: av.Packet[av.VideoStream] = av.Packet(b"picture")
    packet.pts = pts
    return OwnPacket(packet, 0.0, 0.0, False)


def test_a_packet_whose_picture_is_held_back_waits() -> None:
    waiting = [own(1), own(2), own(3)]
    assert _until_shown(waiting, 2) == 2
    assert _until_shown(waiting, 3) == 3


def test_no_packet_waits_for_ever() -> None:
    assert _until_shown([own(1), own(2)], None) == 2
    assert _until_shown([own(1), own(2)], 7) == 2
    assert _until_shown([own(None)], 7) == 1
