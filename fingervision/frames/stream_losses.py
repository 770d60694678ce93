"""Detect lost packets of a stream from the received packets, in addition to reports of the container reader."""

import av

from fingervision.frames.damage import DamageTrail
from fingervision.frames.reference_chain import Link, ReferenceChain
from fingervision.frames.transport_stream import MISSING, TransportLosses

LOST_REFERENCE = "A picture on which the frame depends is missing: the numbers of the coded pictures have a gap."


class StreamLosses:
    """Checks the packets of a stream in order, and reports missing packets to the object that marks damaged pictures.

    Parameters
    ----------
    container_format : str
        FFmpeg's name of the container format.
    stream : av.VideoStream
        Video stream with its decoder.
    """

    def __init__(self, container_format: str, stream: av.VideoStream) -> None:
        codec = stream.codec_context
        self._transport = TransportLosses(container_format, stream)
        self._chain = ReferenceChain(codec.name, codec.extradata)

    def before(self, packet: "av.Packet[av.VideoStream]", trail: DamageTrail) -> str:
        """Report the packets that are missing before a packet, so that damaged pictures can be marked.

        Return a sentence if whole frames are missing from a series with equidistant times.
        """
        link = self._chain.link(packet)
        leaps = self._transport.leaps(packet)
        if link is Link.BROKEN:
            trail.missing(LOST_REFERENCE)
        elif leaps and link is not Link.FOLLOWS:
            trail.hole("Frames are missing before this frame.")
        return MISSING if leaps else ""

    def behind(self, packet: "av.Packet[av.VideoStream]", trail: DamageTrail) -> None:
        """Report damage of the packet that last entered the decoder, so that damaged pictures can be marked."""
        self._transport.behind(packet, trail)
        if self._chain.recovered_over is not None:
            trail.recovers(self._chain.recovered_over)
