"""Detect lost packets of a stream from the received packets, in addition to reports of the container reader."""

from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from statistics import median

import av
from av.bitstream import BitStreamFilterContext

from fingervision.frames.damage import TICKS, DamageTrail, EvenRow
from fingervision.frames.open_container import Heard

MISSING = "Frames are missing here: the otherwise equidistant times have a gap."
LOST_REFERENCE = "A picture on which the frame depends is missing: the numbers of the coded pictures have a gap."
# Codecs with a constant rate: in any container, a gap in the times means lost frames.
EVEN_CODECS = frozenset({"mpeg1video", "mpeg2video"})
# Number of time steps whose median is the usual step.
STEPS = 8
# Ratio to the usual step above which a picture is missing; it allows for rounding and for jitter in a network.
LEAP_SHARE = 1.5
# Smallest number of frame numbers that H.264 allows (log2_max_frame_num_minus4 = 0).
LEAST_BITS = 4
# Start code between units (ITU-T H.264, B.1), fields of a unit's first byte (7.3.1), and kinds of units that are slices
# of a picture (7.4.1). The fields of a slice's header up to its picture's number take less than the bytes stated.
START, REFERENCE, KIND, IDR, HEADER_BYTES = b"\0\0\1", 0x60, 0x1F, 5, 24
SLICES = (1, IDR)


class StreamLosses:
    """Checks the packets of a stream in order, and reports missing packets to the object that marks damaged pictures.

    Parameters
    ----------
    container_format : str
        FFmpeg's name of the container format.
    stream : av.VideoStream
        Video stream with its decoder; its stated rate is used from the first two frames that agree with it, because a
        loss may come at the very start.
    """

    def __init__(self, container_format: str, stream: av.VideoStream) -> None:
        codec = stream.codec_context
        self._numbers = FrameNumbers(stream) if codec.name == "h264" else None
        self._is_transport = container_format == "mpegts"
        self.is_even = self._is_transport or codec.name in EVEN_CODECS
        """Whether the stream's rate is constant, so that frames that are missing between two packets are told."""
        rate, tick_s = codec.framerate, stream.time_base
        self._row = EvenRow(float(1 / (rate * tick_s)) if rate and tick_s else None)
        self._was_corrupt = False

    def before(self, packet: "av.Packet[av.VideoStream]", trail: DamageTrail) -> str:
        """Report the packets that are missing before a packet, so that damaged pictures can be marked.

        Return a sentence if whole frames are missing from a series with equidistant times.
        """
        if not (self.is_even and packet.dts is not None and self._row.leaps(packet.dts)):
            return ""
        if self._numbers is None:
            trail.hole("Frames are missing before this frame.")
        return MISSING

    def behind(self, packet: "av.Packet[av.VideoStream]", trail: DamageTrail) -> None:
        """Report an incomplete packet as damaged after it entered the decoder, if the stream does not mark it so."""
        # Damage is marked before the stream is divided into pictures, so that the mark may be at the previous packet.
        if self._is_transport and (packet.pts is None or self._was_corrupt):
            trail.breaks("The frame is incomplete.")
        self._was_corrupt = packet.is_corrupt

    def decoded(self, packet: "av.Packet[av.VideoStream]", heard: Heard, trail: DamageTrail) -> None:
        """Report what the decoder said of a packet's number, before its pictures leave."""
        if self._numbers is not None:
            self._numbers.check(packet, heard, trail)


class FrameNumbers:
    """Checks the frame numbers of H.264 pictures in decoding order (ITU-T H.264, 7.4.3, `frame_num`).

    A decoder that misses a picture adds the differences of the next picture to whichever picture came before, which it
    mentions only in its log for developers. Pictures on which no other picture depends (mostly B pictures) have the
    number that the next reference picture has, and may be missing without damage to other pictures. FFmpeg compares a
    number with that of the picture before, so that it misses a lost reference picture behind a picture that bears the
    same number: this is told from the numbers themselves. HEVC needs no check of frame numbers: its pictures name
    their reference pictures, and FFmpeg reports missing ones.

    After a reset (a key frame) or a full cycle of numbers the numbers are the same: such a loss shows in the times
    only. A camera that halves its rate in the dark leaves the same gap in the times at any picture; only where a key
    frame is due by the distance of those before, may it be one that is missing.

    Parameters
    ----------
    stream : av.VideoStream
        Video stream with its decoder.
    """

    def __init__(self, stream: av.VideoStream) -> None:
        self._steps: deque[int] = deque(maxlen=STEPS)
        self._tick: int | None = None
        self.is_even = True  # whether the last steps agree
        self._since_key, self._key_every, self._has_seen_key = 0, 0, False
        # Picture number at which the recovery is complete, and number of pictures since its start.
        self._recovering: tuple[int, int] | None = None
        # FFmpeg's filter that writes all fields of the headers into the log, those of the parameter sets first; it
        # does not begin where these are damaged, which the decoder says at each picture that it cannot decode.
        self._headers: BitStreamFilterContext | None = None
        with av.logging.Capture(local=False) as log, suppress(av.FFmpegError):
            self._headers = BitStreamFilterContext("trace_headers", stream)
        stated = _fields(log)
        self._modulus = 1 << stated.get("log2_max_frame_num_minus4", 0) + LEAST_BITS
        self._before_number = 2 if stated.get("separate_colour_plane_flag") else 0  # bits, colour_plane_id
        extradata = stream.codec_context.extradata or b""
        # Bytes of the length before each unit, as `avcC` states it; 0 if start codes separate the units.
        self._length_bytes = 1 + (extradata[4] & 3) if len(extradata) > 4 and extradata[0] == 1 else 0
        self._reference: int | None = None
        # Number that the next reference picture has, by a picture on which no other depends.
        self._announced: int | None = None
        # Whether the stream allows gaps in the numbers (removed temporal layers).
        self._may_leap = stated.get("gaps_in_frame_num_allowed_flag") == 1

    def check(self, packet: "av.Packet[av.VideoStream]", heard: Heard, trail: DamageTrail) -> None:
        """Report a picture that is missing before a packet, and a refresh that is complete."""
        missing = self._missing(packet.dts)
        is_due = 0 < self._key_every <= self._since_key + 1 + missing
        self._since_key += 1 + missing
        if packet.is_keyframe:
            if self._has_seen_key:
                self._key_every = min(self._key_every or self._since_key, self._since_key)
            self._since_key, self._has_seen_key = 0, True
        hides = missing and not packet.is_keyframe
        has_leapt = self._announced_is_missing(packet) or heard.has_leapt
        # If the stream allows gaps in the numbers, pictures are missing only if the times have a gap as well.
        if (has_leapt and (missing or not self._may_leap)) or (
            hides and self._may_hide(packet, missing, is_due, heard)
        ):
            trail.lacks(LOST_REFERENCE)
        if trail.is_broken:
            self._follow_recovery(packet, heard, trail)
        else:
            self._recovering = None

    def _announced_is_missing(self, packet: "av.Packet[av.VideoStream]") -> bool:
        """Whether the reference picture did not come that a picture with its number announced."""
        found = first_slice(bytes(packet), self._length_bytes)
        if found is None:
            return False
        unit, bits = found
        for _ in range(3):  # first_mb_in_slice, slice_type, pic_parameter_set_id
            bits = bits[2 * bits.find("1") + 1 :]
        digits = bits[self._before_number :][: self._modulus.bit_length() - 1]
        if not digits:
            return False
        number, announced = int(digits, 2), self._announced
        if unit & REFERENCE:
            self._reference, self._announced = number, None
        elif number != self._reference:  # a second field has the number of the first
            self._announced = number
        # Numbers begin again with a picture on which alone the next ones depend.
        return unit & KIND != IDR and announced is not None and number == (announced + 1) % self._modulus

    def _may_hide(self, packet: "av.Packet[av.VideoStream]", missing: int, is_due: bool, heard: Heard) -> bool:
        """Whether as many pictures may be missing as make the numbers agree again."""
        if missing >= self._modulus - 1:
            # Where the times are uneven anyway, the camera paused: a loss agrees with the numbers by chance only.
            return self.is_even
        return is_due and missing >= self._header(packet, heard).get("frame_num", self._modulus)

    def _missing(self, tick: int | None) -> int:
        """Number of pictures that are missing before a picture, as far as the times show."""
        step = None if self._tick is None or tick is None else tick - self._tick
        self._tick = tick
        if step is None or step <= 0:
            return 0
        usual = median(self._steps) if self._steps else step
        self.is_even = all(abs(one - usual) <= TICKS for one in self._steps)
        self._steps.append(step)
        return round(step / usual) - 1 if step > LEAP_SHARE * usual else 0

    def _follow_recovery(self, packet: "av.Packet[av.VideoStream]", heard: Heard, trail: DamageTrail) -> None:
        """Follow a recovery point (D.1.8): a number of reference pictures after it, all pictures are exact again."""
        header = self._header(packet, heard)
        number = header.get("frame_num")
        if number is None:
            return
        if self._recovering is not None:
            self._recovering = self._recovering[0], self._recovering[1] + 1
        if header.get("exact_match_flag") and not header.get("broken_link_flag"):
            # A recovery that begins before the current recovery is complete would end later, and is ignored.
            self._recovering = self._recovering or ((number + header["recovery_frame_cnt"]) % self._modulus, 0)
        if self._recovering is not None and header["nal_ref_idc"] and number == self._recovering[0]:
            trail.recovers(self._recovering[1])
            self._recovering = None

    def _header(self, packet: "av.Packet[av.VideoStream]", heard: Heard) -> dict[str, int]:
        """Fields of a packet's headers; of fields that occur twice the first, none if they cannot be read."""
        if self._headers is None:
            return {}
        heard.log.clear()
        with suppress(av.FFmpegError):
            self._headers.filter(av.Packet(bytes(packet)))
        found = _fields(heard.log)
        heard.log.clear()
        return found


def first_slice(coded: bytes, length_bytes: int) -> tuple[int, str] | None:
    """First byte of the first slice's unit in a coded picture of H.264, and the bits of its header; None without one.

    Parameters
    ----------
    coded : bytes
        The coded picture.
    length_bytes : int
        Bytes of the length before each unit; 0 if start codes separate the units.
    """
    for begin in _units(coded, length_bytes):
        if coded[begin] & KIND in SLICES:
            head = coded[begin + 1 :][:HEADER_BYTES].replace(b"\0\0\3", b"\0\0")
            return coded[begin], f"{int.from_bytes(head, 'big'):0{8 * len(head)}b}"
    return None


def _units(coded: bytes, length_bytes: int) -> Iterator[int]:
    """Yield where the units of a coded picture begin."""
    at = 0
    while at < len(coded) - 1:
        if length_bytes:
            begin = at + length_bytes
            at = begin + int.from_bytes(coded[at:begin], "big")
        else:
            at = begin = coded.find(START, at) + len(START)
            if begin < len(START):
                return
        if begin < len(coded):
            yield begin


def _fields(log: list[tuple[int, str, str]]) -> dict[str, int]:
    """Names and values in lines like `40  frame_num  0001 = 1`."""
    found: dict[str, int] = {}
    for _, _, line in log:
        words = line.split()
        if len(words) == 5 and words[3] == "=":
            found.setdefault(words[1], int(words[4]))
    return found
