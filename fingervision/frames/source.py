"""Where frames come from: what every source says of itself, and how one is found."""

import importlib
import pkgutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from types import ModuleType
from typing import Protocol

import fingervision.frames
from fingervision.domain.errors import FingervisionError, UsageError
from fingervision.domain.frame import Coding, Frame, LostFrame


@dataclass(frozen=True, slots=True)
class Description:
    """What is known of a recording before its frames are read.

    Parameters
    ----------
    name : str
        What the user called it.
    kind : str
        Video file, images, camera.
    codec : str
        How the pictures are stored.
    coding : Coding
        Whether that loses something: errors of neighbouring pixels are then correlated.
    width_px, height_px : int
        Size of every frame; a frame of another size counts as damaged.
    rate_hz : float or None
        Mean frame rate that the source states; None where it states none. Times never come from it.
    has_times : bool
        Whether frames carry times.
    frame_count : int or None
        Frames that the source announces: good for a progress bar, not for more.
    files : tuple of Path
        What the recording is made of, in order; empty for a live source.
    notes : tuple of str
        What the user should know of the recording, one sentence each.
    camera : mapping of str to str
        Settings that a camera states, with their units.
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
        """Whether anything of the picture is lost."""
        return self.coding is not Coding.LOSSLESS


class FrameSource(Protocol):
    """A recording or a camera: its frames in order, once, each as it is or as lost."""

    @property
    def description(self) -> Description:
        """What is known before the frames are read."""
        ...

    def __iter__(self) -> Iterator[Frame | LostFrame]:
        """Read the frames; `index` counts from 0 without holes."""
        ...


@dataclass(frozen=True, slots=True)
class CameraWish:
    """What the user asks of a camera of this machine; None leaves a setting as it is.

    Parameters
    ----------
    format : str or None
        Four letters, such as YUYV or MJPG.
    exposure_ms : float or None
        Time that the sensor gathers light.
    gain, focus : float or None
        In the camera's own units.
    white_balance_k : float or None
        Colour temperature.

    Raises
    ------
    UsageError
        No camera has such a value.
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
    """What the user asks of a source.

    Parameters
    ----------
    rate_hz : float or None
        Frame rate of images without times, or of a camera.
    size_px : (int, int) or None
        Width and height that a camera shall deliver.
    camera : CameraWish
        What else a camera shall be set to.
    """

    rate_hz: float | None = None
    size_px: tuple[int, int] | None = None
    camera: CameraWish = CameraWish()


def open_source(name: str, wish: Wish | None = None) -> FrameSource:
    """Open a recording or camera by the name that the user gave.

    Every module of this package that has `accepts(name) -> bool` and `open_frames(name, wish) -> FrameSource` is a
    kind of source; adding one adds one file.

    Raises
    ------
    FingervisionError
        No kind of source knows the name, or the one that does cannot read it.
    """
    if not name:
        raise UsageError("The recording must have a name, but it is empty: give a file, a folder, or a glob in quotes.")
    if Path(name).exists() and not (Path(name).is_file() or Path(name).is_dir() or name.startswith("/dev/")):
        raise FingervisionError(
            f"{name} must be a file or a folder, but is a pipe or a device: save it as a file first."
        )
    for module in kinds():
        if module.accepts(name):
            source: FrameSource = module.open_frames(name, wish or Wish())
            return source
    raise FingervisionError(
        f"There is no recording {name}: give a video file, a folder of images, or a glob in quotes."
    )


def kinds() -> list[ModuleType]:
    """Modules of this package that open sources by name."""
    names = sorted(module.name for module in pkgutil.iter_modules(fingervision.frames.__path__))
    modules = (importlib.import_module(f"{fingervision.frames.__name__}.{name}") for name in names)
    return [module for module in modules if hasattr(module, "accepts")]
