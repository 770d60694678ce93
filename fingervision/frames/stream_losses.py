"""What the packets of a stream tell of those that never came, beside what the container says itself."""

import av

from fingervision.frames.damage import DamageTrail
from fingervision.frames.reference_chain import Link, ReferenceChain
from fingervision.frames.transport_stream import MISSING, TransportLosses

LOST_REFERENCE = "A picture that it hangs on is missing: the numbers of the coded pictures leave one out."


class StreamLosses:
    """Follows the packets of a stream, and tells the trail of damage what is missing.

    Parameters
    ----------
    container_format : str
        FFmpeg's name.
    stream : av.VideoStream
        With its decoder.
    """

    def __init__(self, container_format: str, stream: av.VideoStream) -> None:
        codec = stream.codec_context
        self._transport = TransportLosses(container_format, stream)
        self._chain = ReferenceChain(codec.name, codec.extradata)

    def before(self, packet: "av.Packet[av.VideoStream]", trail: DamageTrail) -> str:
        """Tell the trail of what is missing before a packet; gives a sentence if whole frames of an even row are."""
        link = self._chain.link(packet)
        leaps = self._transport.leaps(packet)
        if link is Link.BROKEN:
            trail.missing(LOST_REFERENCE)
        elif leaps and link is not Link.FOLLOWS:
            trail.hole("Frames are missing before it.")
        return MISSING if leaps else ""

    def behind(self, packet: "av.Packet[av.VideoStream]", trail: DamageTrail) -> None:
        """Tell the trail of the packet that it took in last."""
        self._transport.behind(packet, trail)
        if self._chain.recovered_over is not None:
            trail.recovers(self._chain.recovered_over)
