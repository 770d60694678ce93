"""Where frames come from: what every source says of itself, and how one is found."""

import importlib
import pkgutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Protocol

import fingervision.frames
from fingervision.domain.errors import FingervisionError
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
class Wish:
    """What the user asks of a source.

    Parameters
    ----------
    rate_hz : float or None
        Frame rate of images without times, or of a camera.
    size_px : (int, int) or None
        Width and height that a camera shall deliver.
    """

    rate_hz: float | None = None
    size_px: tuple[int, int] | None = None


def open_source(name: str, wish: Wish | None = None) -> FrameSource:
    """Open a recording or camera by the name that the user gave.

    Every module of this package that has `accepts(name) -> bool` and `open_frames(name, wish) -> FrameSource` is a
    kind of source; adding one adds one file.

    Raises
    ------
    FingervisionError
        No kind of source knows the name, or the one that does cannot read it.
    """
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
