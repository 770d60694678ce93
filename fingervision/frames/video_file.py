"""Video files through PyAV: any container, with its own time stamps, read in sequence and never by seeking."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path

import av
import numpy as np
from av.stream import Disposition

from fingervision.domain.errors import DataError, FingervisionError, InputFileError, UsageError
from fingervision.domain.frame import Coding, Frame, LostFrame, Pixels
from fingervision.domain.quantiser import Quantiser
from fingervision.domain.status import Status
from fingervision.frames.damage import DamageTrail, believable
from fingervision.frames.decoded_picture import EXPORTED, StepTrail, luma
from fingervision.frames.file_pictures import pictures
from fingervision.frames.image_file import IMAGE_SUFFIXES
from fingervision.frames.open_container import STRICT, open_container
from fingervision.frames.source import Description, Wish
from fingervision.frames.unchecked_codecs import UNCHECKED_CODECS, ClusterChecksums, unseen_damage

# FFmpeg's AV_CODEC_PROP_INTRA_ONLY and AV_CODEC_PROP_LOSSY. A codec with both a lossy and a lossless mode (H.264)
# counts as lossy, because the stream does not state its mode.
INTRA_PROPERTY, LOSSY_PROPERTY = 1, 2
QUARTER_DEG = 90
RAW_CAMERA_FILES = {
    ".mraw": "contains raw pixels of a Photron camera without their size and rate: export the recording from Photron "
    "FASTCAM Viewer as 16-bit TIFF images or uncompressed AVI, and measure the exported files.",
    ".cihx": "describes a Photron recording but contains no pictures: export the recording from Photron FASTCAM "
    "Viewer as 16-bit TIFF images or uncompressed AVI, and measure the exported files.",
    ".cine": "must be a Phantom camera's recording, but cannot be read (only uncompressed 8- and 16-bit recordings "
    "can): export it from PCC as 16-bit TIFF images or uncompressed AVI, and measure the exported files.",
}
"""Advice for files of high-speed cameras that cannot be read."""

NO_CHECKSUM = (
    "Neither {codec} nor this file has checksums, so that a damaged frame may look undamaged. If the file came over a "
    "network or from an old disk, compare it with its source; record with FFV1 or H.264."
)


def _coding(properties: int) -> Coding:
    if not properties & LOSSY_PROPERTY:
        return Coding.LOSSLESS
    return Coding.INTRAFRAME if properties & INTRA_PROPERTY else Coding.INTERFRAME


TAKES_THE_REST = True
"""A file that no other kind of source accepts is read as a video: FFmpeg determines its format."""


def accepts(name: str) -> bool:
    """Whether a name is that of an existing file which is not an image."""
    path = Path(name)
    return path.is_file() and path.suffix.lower() not in IMAGE_SUFFIXES


def open_frames(name: str, wish: Wish) -> "VideoFile":
    """Open a video file.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read, is not a video, or contains no picture.
    UsageError
        If a rate is given for a file with its own times.
    """
    if wish.rate_hz is not None:
        raise UsageError(
            f"--rate-hz is for images without times, but {name} is a video with its own times: leave --rate-hz out."
        )
    return VideoFile(name)


@dataclass(frozen=True, slots=True)
class VideoFile:
    """A video file; it is opened again for every pass over its frames.

    Parameters
    ----------
    name : str
        Path of the file.
    """

    name: str
    description: Description = field(init=False)

    def __post_init__(self) -> None:
        with self._opened() as container:
            stream = _stream(container, self.name)
            codec = stream.codec_context
            if codec.width < 1 or codec.height < 1:
                raise DataError(
                    f"{self.name} has no pictures in its video: the file is empty or was truncated near its start; "
                    "record the video again."
                )
            rate = float(stream.average_rate) if stream.average_rate else None
            length_s = float(container.duration / av.time_base) if container.duration else None
            expected = stream.frames or (round(length_s * rate) if length_s and rate else None)
            ratio = stream.sample_aspect_ratio
            notes: tuple[str, ...] = (
                ()
                if ratio in (None, 0, 1)
                else (
                    f"The file states pixels that are not square ({ratio}): a single scale is then not valid along "
                    "both axes.",
                )
            )
            if (tracks := len(_tracks(container))) > 1:
                notes += (
                    f"The file contains {tracks} videos; the first ({codec.width}x{codec.height}) is measured. "
                    "`ffmpeg -i "
                    f"{Path(self.name).name} -map 0:v:1 -c copy second.mkv` extracts the second video.",
                )
            size_px = (codec.width, codec.height)
            if stream.codec.canonical_name in UNCHECKED_CODECS and not ClusterChecksums(Path(self.name)).cover_all:
                notes += (NO_CHECKSUM.format(codec=stream.codec.canonical_name),)
            turned = _rotation_deg(container, stream)
            if turned % QUARTER_DEG:
                notes += (
                    f"The file states a rotation of {turned} degrees, which is not a multiple of 90 degrees and "
                    "is not applied.",
                )
            elif turned:
                size_px = (size_px[1], size_px[0]) if turned % (2 * QUARTER_DEG) else size_px
                notes += (f"The pictures are rotated by {turned} degrees, as the file requests.",)
            object.__setattr__(
                self,
                "description",
                Description(
                    name=self.name,
                    kind=f"video file ({container.format.long_name})",
                    codec=codec.name,
                    coding=_coding(codec.codec.properties),
                    width_px=size_px[0],
                    height_px=size_px[1],
                    rate_hz=rate,
                    has_times=True,
                    frame_count=expected or None,
                    files=(Path(self.name),),
                    notes=notes,
                ),
            )

    def __iter__(self) -> Iterator[Frame | LostFrame]:
        """Decode in sequence; frames that cannot be decoded, or depend on such frames, are marked as damaged."""
        numbers = count()
        last_tick: int | None = None
        trail = StepTrail()
        with self._opened() as container:
            stream = _stream(container, self.name)
            stream.codec_context.options = STRICT | EXPORTED
            if self.description.coding is Coding.INTERFRAME:
                # With threads for slices, FFmpeg's H.264 decoder neither replaces nor marks missing parts of a picture
                # (libavcodec/h264_slice.c, enable_er), so that parts of older pictures would remain unnoticed.
                # With threads for frames, the exported quantiser steps of some pictures are incomplete, differently in
                # every run, because FFmpeg exports them before the last slice is decoded.
                stream.codec_context.thread_count = 1
            DamageTrail.prepare(stream.codec_context)
            tick_s = stream.time_base
            untrusted = unseen_damage(Path(self.name), stream, container.metadata.get("comment"))
            # Only a checksum over the bytes between the pictures, as Matroska has, tells that a time may be damaged.
            is_damaged = "matroska" in container.format.name and ClusterChecksums(Path(self.name)).is_any_broken
            for tick, found in believable(pictures(container, stream, Path(self.name)), is_damaged=is_damaged):
                index = next(numbers)
                time_s = None if tick is None or tick_s is None else tick * tick_s.numerator / tick_s.denominator
                if untrusted or isinstance(found, str):
                    words = found if isinstance(found, str) else untrusted
                    yield LostFrame(index, time_s, Status.DAMAGED, words)
                    last_tick = tick
                    continue
                pixels, steps = upright(luma(found), found.rotation), upright_steps(trail.of(found), found)
                if pixels.shape[1::-1] != (self.description.width_px, self.description.height_px):
                    yield LostFrame(index, time_s, Status.DAMAGED, _of_another_size(pixels, self.description))
                elif tick is not None and tick == last_tick:
                    yield LostFrame(
                        index, time_s, Status.DUPLICATE, "The frame has the same time as the previous frame."
                    )
                else:
                    hangs = not found.key_frame
                    yield Frame(pixels, index, time_s, self.description.coding, hangs, steps)
                last_tick = tick

    def _opened(self) -> av.container.InputContainer:
        try:
            return open_container(self.name)
        except (av.FFmpegError, OSError) as error:
            raise _not_a_video(self.name, error) from error


def _stream(container: av.container.InputContainer, name: str) -> av.VideoStream:
    """Find the first video stream of a file, and its decoder."""
    tracks = _tracks(container)
    if not tracks:
        raise DataError(f"{name} must contain a video, but has no video stream: give another file.")
    stream = tracks[0]
    if stream.codec_context is None:
        raise DataError(
            f"{name} is stored with a codec that this program cannot decode: convert it losslessly, for instance with "
            "`ffmpeg -i IN -c:v ffv1 OUT.mkv`."
        )
    return stream


def _tracks(container: av.container.InputContainer) -> list[av.VideoStream]:
    """Tracks that are videos; a cover picture, which is listed as a track too, is excluded."""
    return [one for one in container.streams.video if not one.disposition & Disposition.attached_pic]


def _rotation_deg(container: av.container.InputContainer, stream: av.VideoStream) -> int:
    """Rotation that the file requests for its pictures, anticlockwise; 0 if the first picture cannot be decoded."""
    try:
        first = next(iter(container.decode(stream)), None)
    except (av.FFmpegError, OSError):
        return 0
    return 0 if first is None else int(first.rotation)


def upright(pixels: Pixels, rotation_deg: int) -> Pixels:
    """Rotate a picture by quarter turns as its file requests; other angles are ignored."""
    if rotation_deg % QUARTER_DEG or not rotation_deg:
        return pixels
    turned: Pixels = np.ascontiguousarray(np.rot90(pixels, rotation_deg // QUARTER_DEG))  # type: ignore[assignment]
    return turned


def upright_steps(steps: Quantiser | None, picture: av.VideoFrame) -> Quantiser | None:
    """Return the quantiser steps of a picture, rotated as the file requests."""
    if steps is None or picture.rotation % QUARTER_DEG:
        return steps
    return steps.turned(picture.rotation // QUARTER_DEG, picture.width, picture.height)


def _of_another_size(pixels: Pixels, description: Description) -> str:
    return (
        f"The frame has {pixels.shape[1]}x{pixels.shape[0]} pixels, but the recording has "
        f"{description.width_px}x{description.height_px}."
    )


def _not_a_video(name: str, error: Exception) -> FingervisionError:
    path = Path(name)
    if not path.exists():
        return InputFileError(f"There is no file {name}.")
    if isinstance(error, PermissionError):
        return InputFileError(f"{name} may not be read: change its permissions.")
    if path.suffix.lower() in RAW_CAMERA_FILES:
        return DataError(f"{name} {RAW_CAMERA_FILES[path.suffix.lower()]}")
    if path.is_file() and path.stat().st_size == 0:
        return DataError(f"{name} must be a video, but the file is empty: record or copy it again.")
    return DataError(
        f"{name} must be a video, but cannot be read as one: the file has another format, or was truncated before its "
        "index was written (the index of an MP4 file is often at its end); record or copy it again."
    )
