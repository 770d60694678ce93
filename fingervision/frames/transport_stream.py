"""Detect losses that an MPEG transport stream does not mark: incomplete pictures, gaps in a regular series."""

import av

from fingervision.frames.damage import DamageTrail
from fingervision.frames.told_times import EvenRow

MISSING = "Frames are missing here: the otherwise equidistant times have a gap."


# Codecs with a constant rate: in any container, a gap in the times means lost frames.
EVEN_CODECS = frozenset({"mpeg1video", "mpeg2video"})


class TransportLosses:
    """Checks the packets of a transport stream, or of a codec with constant rate; reports nothing for other streams.

    Parameters
    ----------
    container_format : str
        FFmpeg's name of the container format.
    stream : av.VideoStream
        Video stream; its stated rate is used from the first two frames that agree with it, because a loss may come at
        the very start.
    """

    def __init__(self, container_format: str, stream: av.VideoStream) -> None:
        self._is_one = container_format == "mpegts"
        rate, tick_s = stream.codec_context.framerate, stream.time_base
        self._is_even = self._is_one or stream.codec_context.name in EVEN_CODECS
        self._row = EvenRow(float(1 / (rate * tick_s)) if rate and tick_s else None)
        self._was_corrupt = False

    def leaps(self, packet: "av.Packet[av.VideoStream]") -> bool:
        """Whether frames are missing before a given packet."""
        return self._is_even and packet.dts is not None and self._row.leaps(packet.dts)

    def behind(self, packet: "av.Packet[av.VideoStream]", trail: DamageTrail) -> None:
        """Report an incomplete packet as damaged after it entered the decoder, if the stream does not mark it so."""
        # Damage is marked before the stream is divided into pictures, so that the mark may be at the previous packet.
        if self._is_one and (packet.pts is None or self._was_corrupt):
            trail.breaks("The frame is incomplete.")
        self._was_corrupt = packet.is_corrupt
