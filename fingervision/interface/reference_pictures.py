"""Pictures of references, as files or arrays, each with its known size."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
from fingervision.frames.source import open_source
from fingervision.interface.argument_checks import number, one_of
from fingervision.vision.grey import GreyImage, to_grey

if TYPE_CHECKING:
    from calib.camera_response import CameraResponse
    from calib.known_widths import KnownSize
    from calib.measured_scale import Calibration
    from calib.parallel_edges import ParallelEdges
    from fingervision.vision.grey import GreyImage


# The camera response assumed for calibration pictures, and how far another response would move their edges.


@dataclass(frozen=True, slots=True)
class PictureResponse:
    """The response (grey level against light) with which pictures are read.

    Parameters
    ----------
    response, other : CameraResponse
        The response that is used, and the alternative standard response.
    is_known : bool
        Whether the user stated it.
    """

    response: "CameraResponse"
    other: "CameraResponse"
    is_known: bool

    @classmethod
    def of(cls, words: str, files: Sequence[Path]) -> "PictureResponse":
        """Choose the response by the option --response.

        `auto` takes the tag of the pictures, or a linear response if they have none. A picture without a tag, such as
        a frame saved as PNG, may be of the same camera as one with a tag.

        Raises
        ------
        DataError
            The tags of two pictures differ.
        """
        from calib.camera_response import standard_response
        from fingervision.frames.transfer_tag import transfer_tag
        from fingervision.storage.response_csv import response_named

        stated = response_named(words)
        tags = {tag: file for file in files if stated is None and (tag := transfer_tag((file,))) is not None}
        if len(tags) > 1:
            found = " and ".join(f"{tag} in {file.name}" for tag, file in tags.items())
            raise DataError(
                f"All pictures must state the same camera response, but they state {found}: take them with the same "
                "settings, or give the response with --response."
            )
        response = stated or standard_response(next(iter(tags), "linear"))
        other = standard_response("srgb" if response.name == "linear" else "linear")
        return cls(response, other, stated is not None)

    @classmethod
    def of_calibration(cls, calibration: "Calibration") -> "PictureResponse":
        """Use the response with which a calibration was made."""
        from calib.camera_response import standard_response

        response = calibration.camera_response or standard_response("linear")
        return cls(response, response, calibration.response_known)

    def light(self, grey: "GreyImage") -> "GreyImage":
        """Convert a picture to light; a linear response leaves the levels unchanged."""
        return _light(self.response, grey)

    def shift_px(
        self,
        stored: Sequence["KnownSize"],
        edges: Sequence["ParallelEdges"],
        region: tuple[int, int, int, int] | None,
    ) -> float:
        """Mean width (px) by which a light gap appears wider with this response than with the alternative response."""
        from calib.errors import CalibrationError
        from calib.parallel_edges import measure_parallel_edges

        shifts = []
        for picture, edge in zip(stored, edges, strict=True):
            levels = _light(self.other, picture.grey).astype(float)
            try:
                ends = (edge.edges_px[0][[0, -1]], edge.edges_px[1][[0, -1]])
                again = measure_parallel_edges(levels, ends, edge.light)
            except CalibrationError:
                continue
            shifts.append((edge.width_px - again.width_px) * (1.0 if edge.light else -1.0))
        return sum(shifts) / len(shifts) if shifts else 0.0

    def noted(self, calibration: "Calibration", shift_px: float) -> "Calibration":
        """Store in a calibration the response with which its pictures were read."""
        return replace(
            calibration,
            camera_response=self.response,
            response_known=self.is_known,
            response_shift_px=shift_px,
        )


def _light(response: "CameraResponse", grey: "GreyImage") -> "GreyImage":
    from fingervision.vision.grey import top_level

    if response.name == "linear":
        return grey
    return response.linearised(grey, response.top_level or top_level(grey))


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
        size = number(ARGUMENT, item[1])
        if not 0.0 < size < float("inf"):
            raise ArgumentError(ARGUMENT, "have positive sizes", f"has {size:g}")
        found.append(Reference(which, source, size))
    return found


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
        return f"picture {index}", to_grey(levels_of(stack[0], f" [{index}]", ARGUMENT))
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


__all__ = ["KINDS", "PictureResponse", "Reference", "files_of", "known_sizes", "read_pictures", "references_of"]
