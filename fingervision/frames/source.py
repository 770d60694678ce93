"""Protocol of frame sources, their description, and the search for a source by its name."""

import importlib
import logging
import pkgutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache, partial
from math import isfinite
from pathlib import Path
from threading import Event
from typing import Protocol, cast

import av

import fingervision.frames
from fingervision.domain.errors import FingervisionError, InputFileError, UsageError, error_words
from fingervision.domain.frame import Coding, Frame, LostFrame
from fingervision.plugins.faults import MisfitError, PluginShapeError
from fingervision.plugins.origin import Entry
from fingervision.plugins.registry import Registry

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


class SourceKind(Protocol):
    """Protocol of a kind of frame source: a module, or another object, that opens sources by name."""

    def accepts(self, name: str) -> bool:
        """Whether a name belongs to this kind of source.

        The function `accepts` is called for every recording, so that it must be fast and must not open anything.
        """
        ...

    def open_frames(self, name: str, wish: Wish) -> FrameSource:
        """Open the source; raise FingervisionError with a sentence if that is impossible."""
        ...


def open_source(name: str, wish: Wish | None = None) -> FrameSource:
    """Open a recording or camera by its name.

    Every module of this package that has `accepts(name) -> bool` and `open_frames(name, wish) -> FrameSource` is a kind
    of source, as is every module or object with these two functions in another distribution (entry points of the group
    `fingervision.frame_sources`). A kind with `TAKES_THE_REST = True` is tried only if no other kind accepts the name.

    Raises
    ------
    DataError, DeviceError, InputFileError
        If no kind of source accepts the name, or the kind that does cannot read it.
    UsageError
        If several kinds accept the name.
    """
    if not name:
        raise UsageError("The recording must have a name, but it is empty: give a file, a folder, or a glob in quotes.")
    if Path(name).exists() and not (Path(name).is_file() or Path(name).is_dir() or name.startswith("/dev/")):
        raise InputFileError(f"{name} must be a file or a folder, but is a pipe or a device: save it as a file first.")
    claims = [entry for entry in REGISTRY.entries() if _accepts(entry, name)]
    claims = [entry for entry in claims if not getattr(entry.value, "TAKES_THE_REST", False)] or claims
    if len(claims) > 1:
        who = " and ".join(f"{entry.name} ({entry.origin})" for entry in claims)
        raise UsageError(
            f"Only one kind of source may accept {name}, but {who} accept it: rename the recording, or remove one of "
            "these kinds of source."
        )
    if claims:
        return _opened(claims[0], name, wish or Wish())
    raise InputFileError(f"There is no recording {name}: give a video file, a folder of images, or a glob in quotes.")


def _accepts(entry: Entry[SourceKind], name: str) -> bool:
    if entry.origin.built_in:
        return entry.value.accepts(name)
    try:
        return bool(entry.value.accepts(name))
    except Exception as error:  # an error in one kind of source must not affect the others
        LOG.warning("fingervision: The frame source %s of %s cannot be used (%r).", entry.name, entry.origin, error)
        return False


def _opened(entry: Entry[SourceKind], name: str, wish: Wish) -> FrameSource:
    from fingervision.frames.checked_frames import CheckedFrames  # which imports this module

    if entry.origin.built_in:
        return entry.value.open_frames(name, wish)
    who = f"The frame source {entry.name} of {entry.origin}"
    try:
        source = entry.value.open_frames(name, wish)
        described = hasattr(source, "description") and hasattr(source, "__iter__")
    except FingervisionError:
        raise
    except Exception as error:
        raise PluginShapeError(f"{who} could not open {name} ({error_words(error)}): {entry.origin.remedy}.") from error
    if not described:
        raise PluginShapeError(
            f"{who} must return a frame source (an iterable object with a Description), but returned a "
            f"{type(source).__name__}: {entry.origin.remedy}."
        )
    refused = partial(_refused, f"{entry.name} of {entry.origin}", entry.origin.remedy)
    return CheckedFrames(source, wish.rate_hz, refused, is_plugin=True)


def _refused(who: str, remedy: str, must: str, found: str) -> PluginShapeError:
    return PluginShapeError(f"The frame source {who} must {must}, but {found}: {remedy}.")


def kinds() -> list[SourceKind]:
    """Kinds of sources that open a recording by its name."""
    return [entry.value for entry in REGISTRY.entries()]


@cache
def _built_in() -> tuple[str, ...]:
    names = (module.name for module in pkgutil.iter_modules(fingervision.frames.__path__))
    return tuple(name for name in names if hasattr(_load(name), "accepts"))


def _load(name: str) -> SourceKind:
    return cast("SourceKind", importlib.import_module(f"{fingervision.frames.__name__}.{name}"))


def _held(held: object) -> dict[str, SourceKind]:
    lacks = [name for name in ("accepts", "open_frames") if not callable(getattr(held, name, None))]
    if lacks:
        raise MisfitError(f"must have accepts(name) and open_frames(name, wish), but has no {' and no '.join(lacks)}")
    return {"": cast("SourceKind", held)}


REGISTRY: Registry[SourceKind] = Registry("fingervision.frame_sources", "frame source", _built_in, _load, _held)


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
