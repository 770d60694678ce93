"""Detect lost packets of a stream from the received packets, in addition to reports of the container reader."""

from collections import deque
from enum import Enum
from statistics import median

import av

from fingervision.frames.damage import DamageTrail
from fingervision.frames.h264_numbers import CodedPicture, H264Numbers
from fingervision.frames.told_times import TICKS
from fingervision.frames.transport_stream import MISSING, TransportLosses

# Check that a coded picture follows its reference picture: a lost picture leaves a hole in the frame numbers.


# Number of time steps whose median is the usual step.
STEPS = 8
# Ratio to the usual step above which a picture is missing; it allows for rounding and for jitter in a network.
LEAP_SHARE = 1.5


class Link(Enum):
    """Result of checking a picture's number: it follows the last number, a reference may be missing, or unknown."""

    FOLLOWS = "follows"
    BROKEN = "broken"
    UNKNOWN = "unknown"


class ReferenceChain:
    """Checks the frame numbers of H.264 pictures in decoding order (ITU-T H.264, 7.4.3, `frame_num`).

    A decoder that misses a picture reports nothing: it adds the differences of the next picture to whichever picture
    came before. Pictures on which no other picture depends (mostly B pictures) are recognised, because they may be
    missing without damage to other pictures. HEVC needs no check of frame numbers: its pictures name their reference
    pictures, and FFmpeg reports missing ones. Other codecs write no frame numbers, so that nothing can be checked.

    Resets of the numbers in mid-stream (memory management operation 5) are not detected, since no camera is known to
    use them; pictures after such a reset would be reported as damaged until the next key frame.

    Parameters
    ----------
    codec : str
        FFmpeg's name of the codec.
    extradata : bytes or None
        The container's parameter sets.
    """

    def __init__(self, codec: str, extradata: bytes | None) -> None:
        self._numbers = H264Numbers(extradata) if codec == "h264" else None
        self._before: CodedPicture | None = None  # last reference picture
        self._steps: deque[int] = deque(maxlen=STEPS)
        self._tick: int | None = None
        self._is_even = True  # whether the last steps agree
        self._since_key, self._has_seen_key = 0, False
        self._key_every: int | None = None
        # Picture number at which the recovery is complete, and number of pictures since its start.
        self._recovering: tuple[int, int] | None = None
        self.recovered_over: int | None = None
        """Number of pictures since the start of the recovery that the last picture completes; None if it completes
        none."""

    def link(self, packet: "av.Packet[av.VideoStream]") -> Link:
        """Check the next packet."""
        missing = self._missing(packet.dts)
        self.recovered_over = None
        picture = self._numbers.of(bytes(packet)) if self._numbers is not None else None
        if picture is None:
            return Link.UNKNOWN
        link = self._judged(picture, missing)
        self._since_key += 1 + missing
        if picture.is_key:
            if self._has_seen_key:
                self._key_every = min(self._key_every or self._since_key, self._since_key)
            self._since_key, self._has_seen_key = 0, True
        self._follow_recovery(picture)
        if picture.is_reference:
            self._before = picture
        return link

    def _judged(self, picture: CodedPicture, missing: int) -> Link:
        before = self._before
        if picture.is_key:
            return Link.FOLLOWS
        if before is None:
            return Link.UNKNOWN
        step = (picture.number - before.number) % picture.modulus
        if step == 0 and (picture.is_field or not picture.is_reference):
            return Link.FOLLOWS
        if step == 1:
            return Link.BROKEN if self._may_hide_a_key(before, missing, picture.modulus) else Link.FOLLOWS
        # In a stream of intra pictures only, no picture depends on others, and some cameras do not count the pictures.
        if step == 0 and picture.is_intra and before.is_intra:
            return Link.UNKNOWN
        # If the stream allows gaps in the numbers, pictures are missing only if the times have a gap as well.
        return Link.UNKNOWN if picture.may_leap and step and not missing else Link.BROKEN

    def _may_hide_a_key(self, before: CodedPicture, missing: int, modulus: int) -> bool:
        """Whether a loss may be undetectable, because after a reset or a full cycle the numbers are the same."""
        if missing >= modulus:
            # Where the times are uneven anyway, the camera paused: a loss agrees with the numbers by chance only.
            return self._is_even
        # A camera that halves its rate in the dark leaves the same gap in the times at any picture; only where a key
        # picture is due by the distance of those before, may it be one that is missing.
        is_due = self._key_every is not None and self._since_key + 1 + missing >= self._key_every
        return missing > before.number and is_due

    def _missing(self, tick: int | None) -> int:
        """Number of pictures that are missing before a picture, as far as the times show."""
        step = None if self._tick is None or tick is None else tick - self._tick
        self._tick = tick
        if step is None or step <= 0:
            return 0
        usual = median(self._steps) if self._steps else step
        self._is_even = all(abs(one - usual) <= TICKS for one in self._steps)
        self._steps.append(step)
        return round(step / usual) - 1 if step > LEAP_SHARE * usual else 0

    def _follow_recovery(self, picture: CodedPicture) -> None:
        if self._recovering is not None:
            self._recovering = self._recovering[0], self._recovering[1] + 1
        if picture.recovers_after is not None:
            # A recovery that begins before the current recovery is complete would end later, and is ignored.
            target = (picture.number + picture.recovers_after) % picture.modulus
            self._recovering = self._recovering or (target, 0)
        if self._recovering is not None and picture.is_reference and picture.number == self._recovering[0]:
            self.recovered_over, self._recovering = self._recovering[1], None


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
