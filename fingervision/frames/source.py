"""Protocols of frame sources, recorded and live, their description, and what a user asks of them."""

import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from threading import Event
from typing import Protocol

import av

from fingervision.domain.errors import UsageError
from fingervision.domain.frame import Coding, Frame, LostFrame

LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Description:
    """Properties of a recording that are known before its frames are read.

    Parameters
    ----------
    name : str
        Name given by the user.
    kind : str
        Kind of source: video file, images, camera.
    codec : str
        Compression format of the pictures.
    coding : Coding
        Whether the compression is lossy: errors of neighbouring pixels are then correlated.
    width_px, height_px : int
        Size of every picture.
    rate_hz : float or None
        Mean frame rate stated by the source; None if not stated. Times are never derived from it.
    has_times : bool
        Whether every picture has a time.
    frame_count : int or None
        Number of frames that the source announces; only used to show progress.
    files : tuple of Path
        Files of the recording, in order; empty for a live source.
    notes : tuple of str
        Sentences that the user should know about the recording.
    camera : mapping of str to str
        Settings stated by a camera, with their units.

    Examples
    --------
    >>> import fingervision as fv
    >>> described = fv.Description(
    ...     name="my camera", kind="camera", codec="none", coding=fv.Coding.LOSSLESS, width_px=640, height_px=480,
    ...     rate_hz=25.0, has_times=True, frame_count=None,
    ... )
    >>> described.coding
    <Coding.LOSSLESS: 'lossless'>
    """

    name: str
    kind: str
    codec: str
    coding: Coding
    width_px: int
    height_px: int
    rate_hz: float | None
    has_times: bool
    frame_count: int | None
    files: tuple[Path, ...] = ()
    notes: tuple[str, ...] = ()
    camera: Mapping[str, str] = field(default_factory=dict)

    @property
    def lossy(self) -> bool:
        """Whether the coding is lossy."""
        return self.coding is not Coding.LOSSLESS


class FrameSource(Protocol):
    """A recording or a camera: it yields frames in order, each a picture or marked as lost; each is read once.

    Examples
    --------
    >>> import numpy as np, fingervision as fv
    >>> class Dark:
    ...     '''Three black pictures.'''
    ...
    ...     description = fv.Description("dark", "array", "none", fv.Coding.LOSSLESS, 320, 240, 25.0, True, 3)
    ...
    ...     def __iter__(self):
    ...         for index in range(3):
    ...             yield fv.Frame(np.zeros((240, 320), np.uint8), index, 0.04 * index)
    >>> fv.measure(Dark(), px_per_mm=34.0).counts
    {'low_contrast': 3}
    """

    @property
    def description(self) -> Description:
        """Description of the source before its frames are read."""
        ...

    def __iter__(self) -> Iterator[Frame | LostFrame]:
        """Read the frames; `index` counts from 0 without gaps."""
        ...


@dataclass(frozen=True, slots=True)
class CameraWish:
    """Settings that the user requests from a camera of this machine; None leaves a setting unchanged.

    Parameters
    ----------
    format : str or None
        Four-letter pixel format, such as YUYV or MJPG.
    exposure_ms : float or None
        Exposure time.
    gain, focus : float or None
        Values in the camera's own units.
    white_balance_k : float or None
        Colour temperature.

    Raises
    ------
    UsageError
        If a value is not possible for a camera.
    """

    format: str | None = None
    exposure_ms: float | None = None
    gain: float | None = None
    focus: float | None = None
    white_balance_k: float | None = None

    def __post_init__(self) -> None:
        if self.format is not None and not (len(self.format) == 4 and self.format.isascii() and self.format.isalnum()):
            raise UsageError(f"--format must be four letters, such as YUYV or MJPG, but is '{self.format}'.")
        for option, value in (("--exposure-ms", self.exposure_ms), ("--white-balance-k", self.white_balance_k)):
            if value is not None and not 0.0 < value < float("inf"):
                raise UsageError(f"{option} must be positive, but is {value:g}.")
        for option, value in (("--gain", self.gain), ("--focus", self.focus)):
            if value is not None and not isfinite(value):
                raise UsageError(f"{option} must be a number, but is {value:g}.")


@dataclass(frozen=True, slots=True)
class Wish:
    """Options that the user sets for a source.

    Parameters
    ----------
    rate_hz : float or None
        Frame rate of images without times, or of a camera.
    size_px : (int, int) or None
        Width and height requested from a camera.
    camera : CameraWish
        Other settings requested from a camera.
    """

    rate_hz: float | None = None
    size_px: tuple[int, int] | None = None
    camera: CameraWish = CameraWish()


# A frame of a live source, with the coded packets in which the camera sent it.


@dataclass(frozen=True, slots=True, eq=False)
class OwnPacket:
    """A packet in the camera's own coding.

    Parameters
    ----------
    packet : av.Packet
        The packet with its bytes.
    time_s, decode_s : float
        Presentation time and decoding time, on the source's clock.
    is_key : bool
        Whether the packet's picture depends on no other picture.
    """

    packet: "av.Packet[av.VideoStream]"
    time_s: float
    decode_s: float
    is_key: bool


@dataclass(frozen=True, slots=True)
class Driven:
    """State of the stage at the exposure of a frame.

    Parameters
    ----------
    input_mm : float
        Position of the stage.
    force_n : float or None
        Force of the stage, if it is measured.
    run : str
        Name of the run to which the frame belongs; effects with memory start again with each run.
    """

    input_mm: float
    force_n: float | None = None
    run: str = "1"


@dataclass(frozen=True, slots=True, eq=False)
class Received:
    """A frame as received from a live source.

    Parameters
    ----------
    item : Frame or LostFrame
        The frame; its `time_s` is on the source's clock.
    arrived_s : float
        Time by the computer's monotonic clock at which the whole frame had been received.
    packets : tuple of OwnPacket
        Packets received since the previous frame; empty if the source does not compress.
    driven : Driven or None
        State of the stage at the exposure, if the source knows it.
    """

    item: Frame | LostFrame
    arrived_s: float
    packets: tuple[OwnPacket, ...] = ()
    driven: Driven | None = None


class LiveSource(Protocol):
    """A live source: it runs independently, and may be interrupted and opened again."""

    @property
    def description(self) -> Description:
        """Description of the source before its frames are read."""
        ...

    @property
    def has_own_clock(self) -> bool:
        """Whether times are from the source's own clock; if not, from the computer's monotonic clock on arrival."""
        ...

    @property
    def template(self) -> av.VideoStream | None:
        """The coded stream to which the packets belong; None if the source has no coded packets."""
        ...

    def received(self) -> Iterator[Received]:
        """Yield the frames as they arrive; if the source is a recording, the iteration ends with the recording.

        Raises
        ------
        DeviceError
            If the connection to the source is lost.
        """
        ...

    def close(self) -> None:
        """Close the camera or connection, which ends the iteration."""
        ...


class Endable:
    """Base of sources whose frames come until they are closed."""

    template: av.VideoStream | None = None
    _closed: Event

    def __iter__(self) -> Iterator[Frame | LostFrame]:
        """Yield the frames as they arrive."""
        for received in self.received():
            yield received.item

    def received(self) -> Iterator[Received]:
        """Yield the frames as they arrive, until the source is closed."""
        raise NotImplementedError

    def close(self) -> None:
        """End the iteration with the next frame, or after the time limit for it."""
        self._closed.set()
