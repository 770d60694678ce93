"""What an MPEG transport stream tells of losses beside its marks: incomplete pictures, and an even row with holes."""

import av

from fingervision.frames.damage import DamageTrail
from fingervision.frames.told_times import EvenRow

MISSING = "Frames are missing here: the times leave an even row."


class TransportLosses:
    """Follows the packets of a transport stream; of another format it says nothing.

    Parameters
    ----------
    container_format : str
        FFmpeg's name.
    stream : av.VideoStream
        The rate that it states is believed from the first two frames that keep it: a loss may come right at the start.
    """

    def __init__(self, container_format: str, stream: av.VideoStream) -> None:
        self._is_one = container_format == "mpegts"
        rate, tick_s = stream.codec_context.framerate, stream.time_base
        self._row = EvenRow(float(1 / (rate * tick_s)) if rate and tick_s else None)
        self._was_corrupt = False

    def before(self, packet: "av.Packet[av.VideoStream]", trail: DamageTrail) -> str:
        """Tell the trail of frames that are missing before a packet; gives a sentence if there are any."""
        if not (self._is_one and packet.dts is not None and self._row.leaps(packet.dts)):
            return ""
        trail.hole("Frames are missing before it.")
        return MISSING

    def behind(self, packet: "av.Packet[av.VideoStream]", trail: DamageTrail) -> None:
        """Tell the trail, behind a packet that entered, whether it is incomplete without being marked."""
        # Pictures are cut out of the stream after its damage was marked: the mark may be one too early.
        if self._is_one and (packet.pts is None or self._was_corrupt):
            trail.breaks("It is incomplete.")
        self._was_corrupt = packet.is_corrupt
