"""Video file of a recording: the camera's own packets or FFV1, with true times, readable at any interruption."""

from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np

from fingervision.domain.errors import DataError, FingervisionError, OutputError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.missing_references import OWN_RECORDING
from fingervision.frames.open_container import open_container
from fingervision.frames.source import OwnPacket
from fingervision.storage.durable import Flushing, flush
from fingervision.vision.grey import to_grey

# All times in the recording are multiples of 1 / TICKS_PER_S seconds.
TICKS_PER_S = 1_000_000
TIME_BASE = Fraction(1, TICKS_PER_S)
# Matroska stores times in milliseconds only; fragmented MP4 stores exact times, and each frame is a fragment of its
# own.
CONTAINER = {"movflags": "frag_every_frame+empty_moov+default_base_moof", "flush_packets": "1"}
# Version 3 has a checksum for each slice.
FFV1 = {"level": "3", "slices": "4", "slicecrc": "1", "g": "1"}
GREY_FORMATS = {"uint8": "gray", "uint16": "gray16le"}


class RecordedVideo:
    """Writes video frames to a file as they are measured.

    Numbers and times start at the first frame whose picture does not depend on another picture.

    Parameters
    ----------
    path : Path
        The file.
    template : av.VideoStream or None
        The camera's coded stream, whose packets are stored unchanged; None stores the grey levels with FFV1.
    keep : int, optional
        Number of frames to keep of an interrupted FFV1 recording that is to be continued. The file on disk is valid at
        all times: the kept frames are copied to a new file, which then replaces the old file.

    Raises
    ------
    FingervisionError
        The file cannot be written, or holds fewer frames than are to be kept.
    """

    def __init__(self, path: Path, template: av.VideoStream | None, keep: int = 0) -> None:
        self._path = path
        self._template = template
        self._flushing = Flushing(path)
        self._stream: Any = None
        self._first_s: float | None = None
        self._last_tick = -1
        place = path.with_name(f".{path.name}.part") if keep else path
        try:
            self._container = av.open(f"file:{place}", "w", format="mp4", options=dict(CONTAINER))
            self._container.metadata["comment"] = OWN_RECORDING
            if keep:
                self._keep(keep)
                flush(place)
                place.replace(path)
        except (av.FFmpegError, OSError) as error:
            raise self._failed(error) from error

    def add(self, item: Frame | LostFrame, packets: tuple[OwnPacket, ...]) -> float | None:
        """Write one frame to the file.

        Returns
        -------
        float or None
            Time of the frame in the recording, exactly as stored in the file; None if the recording begins after this
            frame.

        Raises
        ------
        OutputError
            The file cannot be written.
        """
        self._begin(item, packets)
        tick = self._tick(item)
        if tick is None:
            return None
        try:
            if self._template is not None:
                self._copy(packets)
                if tick < 0:  # a picture that was decoded late, from before the recording
                    return None
            elif isinstance(item, LostFrame):
                self._last_tick = max(self._last_tick, tick)
            elif tick > self._last_tick:
                self._encode(item, tick)
            else:
                return None
            self._flushing.when_due()
        except (av.FFmpegError, OSError, ValueError) as error:
            raise self._failed(error) from error
        return tick / TICKS_PER_S

    def time_s(self, lost: LostFrame, packets: tuple[OwnPacket, ...]) -> float | None:
        """Time (s) in the recording of a lost frame that is not yet added; None before the recording begins."""
        self._begin(lost, packets)
        tick = self._tick(lost)
        return None if tick is None or tick < 0 else tick / TICKS_PER_S

    def close(self) -> None:
        """Write pending packets and close the file."""
        try:
            if self._stream is not None and self._template is None:
                self._container.mux(self._stream.encode(None))
            self._container.close()
            if self._path.exists():  # a run without frames has no video
                flush(self._path)
        except (av.FFmpegError, OSError) as error:
            raise self._failed(error) from error

    def _keep(self, frames: int) -> None:
        with open_container(self._path) as old:
            stream = old.streams.video[0]
            self._stream_of(stream.codec_context.width, stream.codec_context.height, str(stream.codec_context.pix_fmt))
            kept = 0
            for packet in old.demux(stream):
                if kept == frames or packet.pts is None or packet.time_base is None:
                    break
                tick = round(packet.pts * packet.time_base * TICKS_PER_S)
                packet.stream, packet.time_base, packet.pts, packet.dts = self._stream, TIME_BASE, tick, tick
                packet.duration = 0
                self._container.mux(packet)
                self._last_tick = tick
                kept += 1
        if kept < frames:
            raise DataError(
                f"To resume the run, {self._path} must hold at least {frames} frames, but holds {kept}: start the run "
                "from the beginning in another folder."
            )
        self._first_s = 0.0

    def _tick(self, item: Frame | LostFrame) -> int | None:
        if item.time_s is None or self._first_s is None:
            return None
        return round((item.time_s - self._first_s) * TICKS_PER_S)

    def _begin(self, item: Frame | LostFrame, packets: tuple[OwnPacket, ...]) -> None:
        if self._first_s is None and item.time_s is not None:
            if self._template is not None:
                self._first_s = next((own.time_s for own in packets if own.is_key), None)
            elif isinstance(item, Frame):
                self._first_s = item.time_s

    def _copy(self, packets: tuple[OwnPacket, ...]) -> None:
        assert self._first_s is not None  # noqa: S101 - set by the caller
        if self._stream is None and self._template is not None:
            self._stream = self._container.add_stream_from_template(self._template, opaque=True)
            self._stream.time_base = TIME_BASE
        for own in packets:
            packet = own.packet
            shown, decoded = (round((time_s - self._first_s) * TICKS_PER_S) for time_s in (own.time_s, own.decode_s))
            if self._last_tick < 0 and not own.is_key:
                continue
            # Decoding times must increase; if the source's clock jumps back, the next time is one unit later.
            decoded = max(decoded, self._last_tick + 1)
            self._last_tick = decoded
            packet.stream, packet.time_base = self._stream, TIME_BASE
            packet.pts, packet.dts = max(shown, decoded), decoded
            packet.duration = 0
            self._container.mux(packet)

    def _encode(self, frame: Frame, tick: int) -> None:
        grey: Any = np.ascontiguousarray(to_grey(frame.pixels))
        if self._stream is None:
            self._stream_of(grey.shape[1], grey.shape[0], GREY_FORMATS[str(grey.dtype)])
        picture = av.VideoFrame.from_ndarray(grey, format=GREY_FORMATS[str(grey.dtype)])
        picture.pts, picture.time_base = tick, TIME_BASE
        self._last_tick = tick
        self._container.mux(self._stream.encode(picture))

    def _stream_of(self, width_px: int, height_px: int, pixel_format: str) -> None:
        self._stream = self._container.add_stream("ffv1", options=FFV1)
        self._stream.width, self._stream.height, self._stream.pix_fmt = width_px, height_px, pixel_format
        self._stream.codec_context.time_base = self._stream.time_base = TIME_BASE
        self._stream.codec_context.thread_count = 1  # with several threads, each would hold back one frame

    def _failed(self, error: Exception) -> FingervisionError:
        why = getattr(error, "strerror", None) or str(error)
        return OutputError(
            f"{self._path} could not be written any further ({why}); it holds what was recorded before: free disk "
            f"space, "
            "or name another --out."
        )


def frames_in(path: Path) -> int:
    """Number of complete frames in a recording that may have been interrupted; 0 without a recording."""
    count = 0
    try:
        with open_container(path) as container:
            for packet in container.demux(container.streams.video[0]):
                count += packet.pts is not None and packet.size > 0
    except (av.FFmpegError, OSError, IndexError):
        return count
    return count
