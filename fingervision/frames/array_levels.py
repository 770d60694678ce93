"""Convert a numpy array to grey levels or colours as a camera would store them; refuse arrays that are no pictures."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import ArgumentError, ArgumentTypeError
from fingervision.domain.frame import Pixels

FULL_SCALE = 65535
"""Full scale of 16 bits, to which values from 0 to 1 are converted; the rounding has a standard deviation of 4e-6 of
the full scale (1 / (65535 sqrt 12)), a hundredth of the noise of the best cameras.
"""
OF_EIGHT_BITS = 1e-3
"""Largest distance of any pixel from whole 8-bit levels at which floats are regarded as converted from 8 bits; single
precision causes a distance of 2e-5. The uncertainty then includes the rounding to 8 bits, 1/sqrt(12) levels.
"""
COLOURS = (3, 4)
MUST = (
    "be a numpy array of shape (height, width), (height, width, 3), (frames, height, width) or "
    "(frames, height, width, 3), in uint8, uint16, or float from 0 to 1"
)


def stated_shape(pictures: object, argument: str = "source") -> NDArray[np.generic]:
    """Interpret an array as a stack of pictures, without checking its levels.

    Parameters
    ----------
    pictures : ndarray
        Array in one of the shapes accepted by `fingervision.frames.arrays.ArrayFrames`.
    argument : str
        Name of the argument, for error messages.

    Returns
    -------
    ndarray, shape (frames, height, width) or (frames, height, width, colours)
        A view of the array.

    Raises
    ------
    ArgumentTypeError
        The argument is not an array, or its numbers cannot be grey levels.
    ArgumentError
        The array's shape is not that of a picture.
    """
    if not isinstance(pictures, np.ndarray):
        advice = "convert it with numpy.asarray(...)" if hasattr(pictures, "__array__") else ""
        raise ArgumentTypeError(argument, MUST, f"is {what_it_is(pictures)}", advice)
    if np.ma.isMaskedArray(pictures):
        raise ArgumentTypeError(
            argument,
            MUST,
            "is a masked array, in which masked pixels have no level",
            "select a region by roi, or fill the masked pixels by .filled(...)",
        )
    if pictures.dtype.kind == "c":
        raise ArgumentTypeError(
            argument, MUST, f"contains complex numbers ({pictures.dtype})", "numpy.abs(...) gives levels"
        )
    if pictures.dtype.kind == "b":
        raise ArgumentTypeError(
            argument,
            MUST,
            "contains true and false",
            "a binary picture lacks the exact positions of edges; give the grey picture",
        )
    if not (pictures.dtype.kind == "f" or (pictures.dtype.kind == "u" and pictures.dtype.itemsize <= 2)):
        advice = "if no level exceeds 255, convert it with .astype(numpy.uint8)" if pictures.dtype.kind in "iu" else ""
        raise ArgumentTypeError(argument, MUST, f"is of type {pictures.dtype}", advice)
    if pictures.size == 0:
        raise ArgumentError(argument, MUST, f"is empty (shape {pictures.shape})")
    shape = pictures.shape
    if pictures.ndim == 2:
        return pictures[None]
    if pictures.ndim == 3:
        return pictures[None] if shape[2] in COLOURS or shape[2] == 1 else pictures
    if pictures.ndim == 4 and shape[3] in (1, *COLOURS):
        return pictures
    raise ArgumentError(argument, MUST, f"has shape {shape}")


def levels_of(picture: NDArray[np.generic], index: int | None = None, argument: str = "source") -> Pixels:
    """Return the levels of one picture in 8 or 16 bits.

    An alpha channel is dropped where it is opaque. Floats must lie between 0 (black) and 1 (full scale); they are
    converted to 8-bit levels if all are multiples of 1/255, else to 16-bit levels.

    Parameters
    ----------
    picture : ndarray, shape (height, width) or (height, width, colours)
        One picture of a stack accepted by `stated_shape`.
    index : int or None
        Number of the picture among several, for error messages.
    argument : str
        Name of the argument, for error messages.

    Returns
    -------
    ndarray of uint8 or uint16, shape (height, width) or (height, width, 3)
        Contiguous array.

    Raises
    ------
    ArgumentError
        If a level is not a number, lies outside 0 to 1, or has an alpha value that is not opaque.
    """
    subject = argument if index is None else f"picture {index} of {argument}"
    if picture.dtype.kind == "f":
        bad = int(np.count_nonzero(~np.isfinite(picture)))
        if bad:
            row, column = (int(at[0]) for at in np.nonzero(~np.isfinite(picture))[:2])
            raise ArgumentError(
                subject,
                "have a finite level in every pixel",
                f"{bad} of {picture.size} are NaN or infinite, the first in row {row}, column {column}",
                "replace these levels, for instance by those of their neighbours",
            )
        least, largest = float(picture.min()), float(picture.max())
        if least < 0.0 or largest > 1.0:
            raise ArgumentError(
                subject,
                "have levels from 0 (black) to 1 (full scale) if it contains floats",
                f"has levels from {least:.6g} to {largest:.6g}",
                "divide the levels by the camera's full scale",
            )
        picture = _stored(picture)
    native = picture.astype(picture.dtype.newbyteorder("="), copy=False)
    if native.ndim == 2:
        return np.ascontiguousarray(native)
    if native.shape[2] == 1:
        return np.ascontiguousarray(native[:, :, 0])
    if native.shape[2] == 4:
        opaque = FULL_SCALE if native.dtype == np.uint16 else 255
        see_through = int(np.count_nonzero(native[:, :, 3] != opaque))
        if see_through:
            raise ArgumentError(
                subject,
                "have an opaque alpha channel, or none",
                f"{see_through} of {native[:, :, 3].size} pixels are transparent",
                "give only the colours, source[..., :3], if the camera recorded them",
            )
    return np.ascontiguousarray(native[:, :, :3])


def _stored(picture: NDArray[np.generic]) -> NDArray[np.generic]:
    """Convert floats from 0 to 1 to levels: 8-bit levels if all are multiples of 1/255, else 16-bit levels."""
    light = np.asarray(picture, dtype=np.float64)
    levels = np.rint(255.0 * light)
    if np.abs(255.0 * light - levels).max() < OF_EIGHT_BITS:
        return levels.astype(np.uint8)
    return np.rint(FULL_SCALE * light).astype(np.uint16)


def what_it_is(value: object) -> str:
    """Type of a value in words, with its size if the value has one: 'a list of length 3'."""
    kind = type(value)
    library = kind.__module__.partition(".")[0]
    name = kind.__name__ if library in ("builtins", "__main__") else f"{library} {kind.__name__}"
    article = "an" if name[0] in "aeiou" else "a"
    if value is None:
        return "None"
    shape = getattr(value, "shape", None)
    if isinstance(shape, tuple):
        return f"{article} {name} of shape {shape}"
    if isinstance(value, list | tuple | dict | set):
        return f"{article} {name} of length {len(value)}"
    return f"{article} {name}"
