"""Hold a frame source from outside this package to what `Description` and `Frame` say, for measurement and contract."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from math import isfinite
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from fingervision.domain.errors import ArgumentError, FingervisionError, UsageError, error_words
from fingervision.domain.frame import Coding, Frame, LostFrame
from fingervision.domain.status import Status
from fingervision.frames.array_levels import what_it_is
from fingervision.frames.source import Description, FrameSource

Fault = tuple[str, str]
"""What a source must do, worded to follow the word "must", and what it does, worded to follow the word "but"."""
Refusal = Callable[[str, str], Exception]

_FIELDS: dict[str, tuple[str, Callable[[Any], bool]]] = {
    **dict.fromkeys(("name", "kind", "codec"), ("a text", lambda value: isinstance(value, str) and bool(value))),
    "coding": ("a fingervision.Coding", lambda value: isinstance(value, Coding)),
    **dict.fromkeys(("width_px", "height_px"), ("a positive whole number", lambda value: _is_whole(value, 1))),
    "rate_hz": (
        "a positive number or None",
        lambda value: value is None or (isinstance(value, Real) and 0.0 < float(value) < float("inf")),
    ),
    "has_times": ("True or False", lambda value: isinstance(value, bool | np.bool_)),
    "frame_count": ("a whole number or None", lambda value: value is None or _is_whole(value, 0)),
    "files": (
        "a tuple of pathlib.Path",
        lambda value: isinstance(value, tuple) and all(isinstance(one, Path) for one in value),
    ),
    "notes": (
        "a tuple of texts",
        lambda value: isinstance(value, tuple) and all(isinstance(one, str) for one in value),
    ),
}


def held(described: Any, items: Iterable[Any], refused: Refusal) -> Iterator[Frame | LostFrame]:
    """Yield the frames of a source as long as they are what its description and the records say.

    Parameters
    ----------
    described : Description
        The description of the source.
    items : iterable
        What the source yields.
    refused : callable
        Makes the exception that is raised, from what the source must do and what it does.
    """
    for fault in description_faults(described):
        raise refused(*fault)
    last_s: float | None = None
    index = -1
    for index, item in enumerate(items):
        for fault in _faults(item, index, described, last_s):
            raise refused(*fault)
        if isinstance(item, Frame):
            last_s = item.time_s
        yield item
    if index < 0:
        raise refused("yield at least one frame", "yields none")


def description_faults(described: Any) -> Iterator[Fault]:
    """Yield every rule that a description breaks."""
    if not isinstance(described, Description):
        yield "have a `description` that is a fingervision.Description", f"has {what_it_is(described)}"
        return
    for name, (must, is_sound) in _FIELDS.items():
        if not is_sound(value := getattr(described, name)):
            yield f"have a description whose {name} is {must}", f"its {name} is {value!r}"


def _faults(item: Any, index: int, described: Description, last_s: float | None) -> Iterator[Fault]:
    """Yield every rule that an item of a source breaks."""
    if not isinstance(item, Frame | LostFrame):
        yield "yield fingervision.Frame or fingervision.LostFrame", f"item {index} is {what_it_is(item)}"
        return
    if item.index != index:
        must = "number its frames 0, 1, 2 and so on, lost ones included"
        yield must, f"the frame at place {index} has the index {item.index}"
    if isinstance(item, Frame):
        yield from _picture_faults(item, described)
        yield from _time_faults(item, described, last_s)
    elif item.status not in (Status.DAMAGED, Status.DUPLICATE):
        must = "give a lost frame fingervision.Status.DAMAGED or fingervision.Status.DUPLICATE"
        yield must, f"frame {index} has {item.status!r}"


def _picture_faults(frame: Frame, described: Description) -> Iterator[Fault]:
    pixels: Any = frame.pixels
    shape: tuple[int, ...] = getattr(pixels, "shape", ())
    is_picture = isinstance(pixels, np.ndarray) and (len(shape) == 2 or shape[2:] == (3,))
    if not (is_picture and pixels.dtype.name in ("uint8", "uint16")):
        found = f"{what_it_is(pixels)}{f' of {pixels.dtype}' if isinstance(pixels, np.ndarray) else ''}"
        must = "yield pixels as uint8 or uint16 of shape (height, width) or (height, width, 3)"
        yield must, f"those of frame {frame.index} are {found}"
    elif shape[:2] != (described.height_px, described.width_px):
        must = f"yield pictures of {described.width_px} x {described.height_px} px, as its description says"
        yield must, f"frame {frame.index} has {shape[1]} x {shape[0]} px"
    coding: Any = frame.coding
    if not isinstance(coding, Coding):
        yield "give its frames a fingervision.Coding", f"frame {frame.index} has {coding!r}"


def _time_faults(frame: Frame, described: Description, last_s: float | None) -> Iterator[Fault]:
    time_s: Any = frame.time_s
    if (time_s is not None) != described.has_times:
        must = f"yield frames {'with' if described.has_times else 'without'} times, as its description says"
        yield must, f"frame {frame.index} has {'none' if time_s is None else f'the time {time_s!r}'}"
    elif time_s is not None and not (isinstance(time_s, Real) and isfinite(time_s)):
        yield "yield times that are finite numbers of seconds", f"the time of frame {frame.index} is {time_s!r}"
    elif time_s is not None and last_s is not None and time_s <= last_s:
        must = "yield times that increase (a frame with a repeated time is a fingervision.LostFrame)"
        yield must, f"frame {frame.index} has {time_s:g} s after {last_s:g} s"


def _is_whole(value: Any, least: int) -> bool:
    return not isinstance(value, bool) and isinstance(value, int | np.integer) and int(value) >= least


def of_argument(must: str, found: str) -> Exception:
    """Error about a source that a user gave as an argument."""
    return ArgumentError("source", must, found)


@dataclass(eq=False)
class CheckedFrames:
    """A frame source of somebody else: its frames are checked, copied, and given times if it has none.

    The pixels are copied, because frames are read ahead and a source may use its memory again for the next picture.
    A recording is closed at the end of each reading. The pictures that a camera receives live are not checked.

    Parameters
    ----------
    source : FrameSource
        The source.
    rate_hz : float or None
        Pictures per second of a recording without times, stated by the user.
    refused : callable
        As in `held`.
    is_plugin : bool
        Whether an exception of the source is told by `refused`; that of a user's own class is raised as it is.

    Raises
    ------
    UsageError
        A rate is given for a recording that has times.
    """

    source: FrameSource = field(repr=False)
    rate_hz: float | None = None
    refused: Refusal = field(default=of_argument, repr=False)
    is_plugin: bool = False
    description: Description = field(init=False)

    def __post_init__(self) -> None:
        described = self.source.description
        for fault in description_faults(described):
            raise self.refused(*fault)
        if self.rate_hz is not None and not (isfinite(self.rate_hz) and self.rate_hz > 0.0):
            raise UsageError(f"--rate-hz must be positive, but is {self.rate_hz:g}.")
        if self.rate_hz is not None and not described.has_times:
            self.description = replace(described, rate_hz=self.rate_hz, has_times=True)
            return
        # A camera, and a source that was opened with this rate, have times of their own at the wished rate.
        if self.rate_hz not in (None, described.rate_hz) and not self._is_live:
            raise UsageError(
                f"--rate-hz is for pictures without times, but {described.name} has times of its own: leave --rate-hz "
                "out."
            )
        self.description = described

    def __iter__(self) -> Iterator[Frame | LostFrame]:
        """Yield the frames of the source, each checked."""
        described = self.source.description
        is_timed = self.rate_hz is not None and not described.has_times
        try:
            for item in held(described, self.source, self.refused):
                taken: Frame | LostFrame = item
                if isinstance(item, Frame):
                    kind = item.pixels.dtype.newbyteorder("=")
                    pixels: Any = np.array(item.pixels, kind, order="C")
                    taken = replace(item, pixels=pixels)
                yield replace(taken, time_s=item.index / self.rate_hz) if is_timed and self.rate_hz else taken
        except FingervisionError:
            raise
        except Exception as error:
            if not self.is_plugin:
                raise
            raise self.refused("yield its frames", f"it raised {error_words(error)}") from error
        finally:
            close = getattr(self.source, "close", None)
            if close is not None and not self._is_live:
                close()

    def __getattr__(self, name: str) -> Any:
        """Return what else the source has: a camera's `received`, `controls` and `close`."""
        if name.startswith("__") or name == "source":
            raise AttributeError(name)
        return getattr(self.source, name)

    @property
    def _is_live(self) -> bool:
        return hasattr(self.source, "received")
