"""Network cameras: rtsp:// and http:// streams through PyAV, with the camera's coded packets kept."""

import io
import re
from collections.abc import Iterator
from itertools import count
from threading import Event
from time import monotonic
from typing import Any

import av

from fingervision.domain.errors import DeviceError, UsageError
from fingervision.domain.frame import Coding, Frame, LostFrame
from fingervision.domain.status import Status
from fingervision.frames.damage import DamageTrail, Picture
from fingervision.frames.decoded_picture import EXPORTED, StepTrail, luma
from fingervision.frames.open_container import STRICT, WHATEVER_METADATA, Heard, listening
from fingervision.frames.sound_jpeg import SoundJpeg
from fingervision.frames.source import Description, Endable, OwnPacket, Received, Wish
from fingervision.frames.stream_losses import StreamLosses

# Names of parameters with which cameras transmit secrets: password, pwd, token, key, auth, user, loginpas and others.
SECRET_PARAMETERS = re.compile(
    r"([?&;][^=&;#]*(?:pass|pwd|psw|pw|token|key|secret|auth|user|usr|login)[^=&;#]*=)[^&;#]*", re.I
)
STARTS = ("rtsp://", "http://", "https://")
# Longest time until a camera answers, and longest time without data before the connection counts as lost.
OPEN_TIMEOUT_S, READ_TIMEOUT_S = 5.0, 2.0
# Options for a short delay: few bytes are examined before the first frame, and no frame is buffered.
OPTIONS = {"rtsp_transport": "tcp", "fflags": "nobuffer", "flags": "low_delay", "probesize": "1000000"}
# Codecs that code every picture independently.
INTRAFRAME_CODECS = frozenset({"mjpeg", "png"})
# Formats in which pictures have no times.
WITHOUT_TIMES = frozenset({"mpjpeg", "mjpeg", "jpeg_pipe", "image2pipe", "h264", "hevc"})
# Beginnings of FFmpeg's warnings about losses in a network: missing sequence numbers, incomplete pictures.
LOST_ON_THE_WAY = ("RTP: missed", "max delay reached", "Packet corrupt", "Continuity check failed")
LOSSLESS_CODECS = frozenset({"png", "rawvideo", "ffv1"})


def accepts(name: str) -> bool:
    """Whether a name is the address of a stream."""
    return name.startswith(STARTS)


def without_password(name: str) -> str:
    """Return the address without the camera's password, for display on a browser page and storage in a run."""
    # A password may contain `/` and `@`, so that user and password extend to the last @.
    shown = re.sub(r"^(\w+://[^/@:?#]*):.*@", r"\1:***@", name)
    return SECRET_PARAMETERS.sub(r"\1***", shown)


def open_frames(name: str, wish: Wish) -> "NetworkStream":
    """Connect to a stream.

    Raises
    ------
    DeviceError
        If there is no response, or the response is no video.
    UsageError
        If a size or rate is requested, which only the camera can set.
    """
    if wish.rate_hz is not None or wish.size_px is not None:
        raise UsageError(
            "--size and --rate-hz are for cameras of this computer, but "
            f"{without_password(name)} determines size and rate itself: set them in that camera."
        )
    return NetworkStream(name)


class NetworkStream(Endable):
    """A connected stream; after an interruption, a new object is opened.

    Time stamps are those of the stream (RTSP, MPEG-TS), or else of the computer's clock on arrival: a sequence of JPEG
    pictures over HTTP contains no times, and times derived from a nominal frame rate would not be measured ones.

    Parameters
    ----------
    name : str
        Address of the stream.

    Raises
    ------
    FingervisionError
        If there is no response, or the response is no video.
    """

    def __init__(self, name: str) -> None:
        self.name = without_password(name)
        try:
            self._container = av.open(
                name, options=dict(OPTIONS), timeout=(OPEN_TIMEOUT_S, READ_TIMEOUT_S), **WHATEVER_METADATA
            )
        except (av.FFmpegError, OSError, ValueError) as error:
            raise DeviceError(
                f"The stream {self.name} must answer with a video, but does not ({_reason(error)}): check the address, "
                "that the camera is switched on, and that no other program uses it."
            ) from error
        if not self._container.streams.video or self._container.streams.video[0].codec_context is None:
            self._container.close()
            raise DeviceError(f"The stream {self.name} must contain a video that can be decoded, but does not.")
        self._stream = self._container.streams.video[0]
        # The stream's coding parameters are copied into a container of our own, because a recording may begin after the
        # camera's container is closed. They are copied as parameters, because some decoders have no encoder of the same
        # name (AV1).
        self._kept = av.open(io.BytesIO(), "w", format="matroska")
        self.template = self._kept.add_stream_from_template(self._stream, opaque=True)
        codec = self._stream.codec_context
        codec.options = STRICT | EXPORTED
        DamageTrail.prepare(codec)
        codec.thread_count = 1  # each thread of a frame-parallel decoder would delay one frame
        if codec.width < 1 or codec.height < 1:
            self._container.close()
            raise DeviceError(
                f"The stream {self.name} must state the size of its pictures, but does not: choose another "
                "format in the camera's own settings."
            )
        self._jpegs = SoundJpeg(codec.name)
        self._steps = StepTrail()
        self.has_own_clock = self._container.format.name not in WITHOUT_TIMES
        self._closed = Event()
        coding = Coding.INTRAFRAME if codec.name in INTRAFRAME_CODECS else Coding.INTERFRAME
        rate = self._stream.average_rate
        self.description = Description(
            name=self.name,
            kind="network stream",
            codec=codec.name,
            coding=Coding.LOSSLESS if codec.name in LOSSLESS_CODECS else coding,
            width_px=codec.width,
            height_px=codec.height,
            # Without times, the rate would be FFmpeg's guess.
            rate_hz=float(rate) if rate and self.has_own_clock else None,
            has_times=True,
            frame_count=None,
        )

    def received(self) -> Iterator[Received]:
        """Yield the frames with the packets in which they arrived."""
        numbers, trail = count(), DamageTrail()
        losses = StreamLosses(self._container.format.name, self._stream)
        last_s: float | None = None
        sent_s: float | None = None
        waiting: list[OwnPacket] = []
        try:
            with listening(self._stream.codec_context.name, LOST_ON_THE_WAY) as heard:
                for packet, arrived_s in self._packets():
                    waiting.append(self._own(packet, arrived_s, sent_s))
                    sent_s = waiting[-1].decode_s
                    if said := heard.of_file():
                        trail.hole(f"Data of the stream were lost ({said}).")
                    losses.before(packet, trail)
                    trail.enters(packet)
                    losses.behind(packet, trail)
                    for tick, found in self._decoded(packet, trail, heard, losses):
                        time_s = self._time_s(tick, arrived_s, last_s)
                        item = self._item(next(numbers), time_s, found, last_s)
                        last_s = time_s
                        # A packet whose picture is still in the decoder stays in the list; otherwise a recording would
                        # contain one picture more than its table.
                        arrived = _until_shown(waiting, tick)
                        yield Received(item, arrived_s, tuple(waiting[:arrived]))
                        del waiting[:arrived]
        finally:
            self._container.close()

    def _packets(self) -> Iterator[tuple[Any, float]]:
        demuxed = self._container.demux(self._stream)
        while not self._closed.is_set():
            try:
                packet = next(demuxed, None)
            except (av.FFmpegError, OSError) as error:
                why = "the connection was interrupted" if isinstance(error, av.InvalidDataError) else _reason(error)
                raise DeviceError(self._cut(why)) from error
            if packet is None or not packet.size:
                raise DeviceError(self._cut("the camera ended the stream"))
            yield packet, monotonic()

    def _cut(self, why: str) -> str:
        return f"The stream {self.name} is interrupted ({why})."

    def _decoded(
        self, packet: "av.Packet[av.VideoStream]", trail: DamageTrail, heard: Heard, losses: StreamLosses
    ) -> Iterator[Picture]:
        if packet.size and (fault := self._jpegs.fault(bytes(packet))):
            trail.breaks(f"The frame arrived damaged ({fault}).")
        try:
            pictures = packet.decode()
        except av.FFmpegError as error:
            why = f"The frame could not be decoded ({error.strerror})."
            if self.description.coding is Coding.INTERFRAME:
                trail.breaks(why)
            else:
                yield from trail.fails(why)
            return
        finally:
            said = heard.of_picture()
        if said:
            trail.breaks(f"The frame arrived damaged ({said}).")
        losses.decoded(packet, heard, trail)
        for picture in pictures:
            yield from trail.leaves(picture)

    def _item(self, index: int, time_s: float, found: av.VideoFrame | str, last_s: float | None) -> Frame | LostFrame:
        size_px = (self.description.width_px, self.description.height_px)
        if isinstance(found, str):
            return LostFrame(index, time_s, Status.DAMAGED, found)
        steps = self._steps.of(found)
        if (found.width, found.height) != size_px:
            words = f"The frame has {found.width}x{found.height} pixels, but the stream has {size_px[0]}x{size_px[1]}."
            return LostFrame(index, time_s, Status.DAMAGED, words)
        if time_s == last_s:
            return LostFrame(index, time_s, Status.DUPLICATE, "The frame has the same time as the previous frame.")
        coding = self.description.coding
        return Frame(luma(found), index, time_s, coding, not found.key_frame, steps)

    def _own(self, packet: "av.Packet[av.VideoStream]", arrived_s: float, sent_s: float | None) -> OwnPacket:
        shown_s = self._time_s(packet.pts, arrived_s, sent_s)
        decode_s = shown_s if packet.dts is None else self._time_s(packet.dts, arrived_s, sent_s)
        return OwnPacket(packet, shown_s, decode_s, packet.is_keyframe)

    def _time_s(self, tick: int | None, arrived_s: float, before_s: float | None) -> float:
        """Convert a tick of the stream to seconds of the source's clock.

        A frame without a tick is placed one tick after the previous frame, which keeps the order.
        """
        if not self.has_own_clock or self._stream.time_base is None:
            return arrived_s
        if tick is None:
            # The header with the time was lost. A time by the computer's clock would shift all following frames.
            return (before_s or 0.0) + float(self._stream.time_base)
        return float(tick * self._stream.time_base)


def _until_shown(waiting: list[OwnPacket], tick: int | None) -> int:
    """Number of waiting packets up to the packet that is shown at a tick; all packets if no packet has this tick."""
    shown = [place for place, own in enumerate(waiting, 1) if tick is not None and own.packet.pts == tick]
    return shown[-1] if shown else len(waiting)


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error) or type(error).__name__
