"""Pictures of references, as files or arrays, each with its known size."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from calib.known_widths import KnownSize
from fingervision.domain.errors import (
    ArgumentError,
    ArgumentTypeError,
    DataError,
    InputFileError,
    UsageError,
)
from fingervision.domain.frame import Frame, Pixels
from fingervision.frames.array_levels import levels_of, stated_shape, what_it_is
from fingervision.frames.image_file import UnreadableImageError, is_image, read_image
from fingervision.frames.source_kinds import open_source
from fingervision.interface.argument_checks import number, one_of
from fingervision.vision.grey import GreyImage, to_grey

KINDS = ("bar", "slot")
ARGUMENT = "pictures"
MUST = "be a mapping of pictures to sizes in mm, or a sequence of (picture, size) or (picture, size, 'bar' or 'slot')"


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """A picture with the known size of the object that it shows.

    Parameters
    ----------
    kind : str
        Kind of the object: bar or slot.
    source : Path or ndarray
        The picture.
    value : float
        The size in mm, or another known value of the picture.
    """

    kind: str
    source: Any
    value: float


def references_of(pictures: Any, kind: str) -> list[Reference]:
    """Pair each picture with its known size.

    Parameters
    ----------
    pictures : mapping of path to float, or sequence of (path or ndarray, float[, str])
        Pictures with sizes; a path may begin with `slot:` or `bar:`, if its object is of another kind than `kind`.
    kind : str
        Kind of the objects whose path has no prefix.

    Raises
    ------
    ArgumentTypeError, ArgumentError
        The argument does not pair pictures with sizes, or a size is not positive.
    """
    if isinstance(pictures, Mapping):
        items: list[Any] = [(source, value) for source, value in pictures.items()]
    elif isinstance(pictures, list | tuple):
        items = list(pictures)
    else:
        raise ArgumentTypeError(ARGUMENT, MUST, f"is {what_it_is(pictures)}")
    if not items:
        raise ArgumentError(ARGUMENT, MUST, "is empty")
    found = []
    for item in items:
        if not isinstance(item, list | tuple) or len(item) not in (2, 3):
            raise ArgumentTypeError(ARGUMENT, MUST, f"holds {what_it_is(item)}")
        which = one_of(ARGUMENT, item[2], KINDS) if len(item) == 3 else kind
        source = item[0]
        if isinstance(source, str):
            prefix, colon, rest = source.partition(":")
            if colon and prefix in KINDS:
                which, source = prefix, rest
        if isinstance(item[1], bool) or not isinstance(item[1], Real):
            states = f"states {item[1]!r} for {_named(source)}"
            raise ArgumentTypeError(ARGUMENT, "state each size as a number in mm", states)
        size = float(item[1])
        if not 0.0 < size < float("inf"):
            states = f"states {size:g} for {_named(source)}"
            raise ArgumentError(ARGUMENT, "state each size as a positive number in mm", states)
        found.append(Reference(which, source, size))
    return found


def _named(source: Any) -> str:
    """Name of a picture in an error: its file, or what it is."""
    return str(source) if isinstance(source, str | os.PathLike) else what_it_is(source)


def known_sizes(references: Sequence[Reference], u_size_mm: float) -> list[KnownSize]:
    """Read the picture of every reference, with the known size and its uncertainty.

    Raises
    ------
    DataError, InputFileError, UsageError
        A picture cannot be read, or differs in size from the others.
    """
    u_mm = number("u_size_mm", u_size_mm)
    named = read_pictures([each.source for each in references])
    return [
        KnownSize(name, each.kind, each.value, u_mm, grey) for each, (name, grey) in zip(references, named, strict=True)
    ]


def read_pictures(sources: Sequence[Any]) -> list[tuple[str, GreyImage]]:
    """Read pictures as grey levels, and name each; all must have the same size, and no file may be named twice.

    Of a video, the first frame is the picture.

    Raises
    ------
    UsageError
        A file is named twice, or an item is not a picture.
    DataError, InputFileError
        A picture cannot be read, or differs in size from the others.
    """
    paths = [Path(each) for each in sources if isinstance(each, str | os.PathLike)]
    seen: dict[Path, Path] = {}
    for path in paths:
        twin = seen.setdefault(path.resolve(), path)
        if twin is not path:
            raise UsageError(f"Every picture may be named once, but {path} is named twice: leave one out.")
    pictures: list[tuple[str, GreyImage]] = []
    for index, source in enumerate(sources):
        pictures.append(_read(source, index))
        (name, grey), (first_name, first) = pictures[-1], pictures[0]
        if grey.shape != first.shape:
            (height, width), (first_height, first_width) = grey.shape, first.shape
            raise DataError(
                f"All pictures must have the same size, but {name} is {width}x{height} and {first_name} is "
                f"{first_width}x{first_height}: take all of them with the same camera settings."
            )
    return pictures


def files_of(sources: Sequence[Any]) -> list[Path]:
    """Return those of the given pictures that are files."""
    return [Path(each) for each in sources if isinstance(each, str | os.PathLike)]


def _read(source: Any, index: int) -> tuple[str, GreyImage]:
    if isinstance(source, np.ndarray) or hasattr(source, "__array__"):
        stack = stated_shape(source, ARGUMENT)
        if len(stack) != 1:
            raise ArgumentError(ARGUMENT, "be single pictures", f"holds a stack of {len(stack)}")
        return f"picture {index}", to_grey(levels_of(stack[0], index, ARGUMENT))
    if not isinstance(source, str | os.PathLike):
        raise ArgumentTypeError(ARGUMENT, "hold names of files or numpy arrays", f"holds {what_it_is(source)}")
    path = Path(source)
    if not path.exists():
        raise InputFileError(f"There is no picture {path}; check the name.")
    try:
        return path.name, to_grey(read_image(path) if is_image(path) else _first_frame(path))
    except UnreadableImageError as error:
        raise DataError(f"The picture {path} cannot be used: {error}") from error


def _first_frame(path: Path) -> Pixels:
    """First frame of a video that could be decoded."""
    for frame in open_source(str(path)):
        if isinstance(frame, Frame):
            return frame.pixels
    raise DataError(f"The video {path} must have a frame that can be decoded, but has none: record it again.")
