"""Folders and glob patterns of images, in natural order, with times if a table states the times."""

import csv
import glob
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path

from fingervision.domain.errors import DataError, InputFileError, UsageError
from fingervision.domain.frame import Coding, Frame, LostFrame
from fingervision.domain.status import Status
from fingervision.frames.image_file import IMAGE_SUFFIXES, LOSSY_SUFFIXES, UnreadableImageError, read_image
from fingervision.frames.source import Description, Wish

# Times of images from a table in their folder.

TIMES_FILE = "times.csv"


def times_of(files: tuple[Path, ...]) -> tuple[float, ...] | None:
    """Read the times of images from times.csv in their folder.

    The table has the columns `file,time_s`, or only `time_s` with one row per image, in order.

    Returns
    -------
    tuple of float or None
        Time of each image in seconds; None if there is no table.

    Raises
    ------
    DataError
        If the table cannot be read, has an invalid row, or does not fit the images.
    """
    table = files[0].parent / TIMES_FILE
    if not table.is_file():
        return None
    rows = _rows(table)
    if not rows:
        raise DataError(f"{table} must have a header line with time_s, but is empty.")
    header = [cell.strip() for cell in rows[0][1]]
    if "time_s" not in header:
        raise DataError(f"{table} must have a column time_s, but has {', '.join(header)}.")
    at, named = header.index("time_s"), header.index("file") if "file" in header else None
    times = {}
    for place, (line, cells) in enumerate(rows[1:]):
        if len(cells) != len(header):
            raise DataError(f"Line {line} of {table} must have {len(header)} cells, but has {len(cells)}.")
        times[cells[named].strip() if named is not None else place] = _seconds(table, line, cells[at])
    if named is None:
        if len(times) != len(files):
            raise DataError(
                f"{table} must have a time for each of the {len(files)} images, but has {len(times)}: "
                "add a column `file` with the names of the images."
            )
        return tuple(times.values())
    for file in files:
        if file.name not in times:
            raise DataError(f"{table} must have a time for each image, but has none for {file.name}.")
    return tuple(times[file.name] for file in files)


def _rows(table: Path) -> list[tuple[int, list[str]]]:
    """Rows of the table with their line numbers; comments and empty lines are omitted."""
    try:
        lines = table.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"{table} could not be read as a table of times: {error}.") from error
    return [
        (number, next(csv.reader([line])))
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.startswith("#")
    ]


def _seconds(table: Path, line: int, cell: str) -> float:
    try:
        time_s = float(cell)
    except ValueError:
        time_s = float("nan")
    if not isfinite(time_s):
        raise DataError(f"time_s in line {line} of {table} must be a number of seconds, but is '{cell}'.")
    return time_s


# Permitted rates: from one picture in eleven days to the fastest cameras; other rates are typing errors.
LEAST_HZ, GREATEST_HZ = 1e-6, 1e7


def accepts(name: str) -> bool:
    """Whether a name is a folder, an image, or a pattern that matches files."""
    path = Path(name)
    if path.exists():
        return path.is_dir() or (path.is_file() and path.suffix.lower() in IMAGE_SUFFIXES)
    return glob.has_magic(name) and "://" not in name


def open_frames(name: str, wish: Wish) -> "ImageFolder":
    """Open the images of a folder or a pattern, or a single image.

    Raises
    ------
    DataError, InputFileError
        The folder has no images, none of them can be read, or their times are invalid.
    UsageError
        If the rate is not positive, or is given for images that have times.
    """
    return ImageFolder(name, wish.rate_hz)


@dataclass(frozen=True, slots=True)
class ImageFolder:
    """Image files as a recording.

    Parameters
    ----------
    name : str
        A folder, a glob pattern, or one image.
    rate_hz : float or None
        Images per second. Without a rate and without times, frames have no time.
    """

    name: str
    rate_hz: float | None = None
    description: Description = field(init=False)
    times_s: tuple[float, ...] | None = field(init=False)

    def __post_init__(self) -> None:
        if self.rate_hz is not None and not 0.0 < self.rate_hz < float("inf"):
            raise UsageError(f"--rate-hz must be positive, but is {self.rate_hz:g}.")
        if self.rate_hz is not None and not LEAST_HZ <= self.rate_hz <= GREATEST_HZ:
            raise UsageError(
                f"--rate-hz must be between {LEAST_HZ:g} and {GREATEST_HZ:g} images per second, but is "
                f"{self.rate_hz:g}."
            )
        files = _files(self.name)
        times_s = times_of(files)
        if times_s is not None and self.rate_hz is not None:
            raise UsageError(
                f"The times of the images are read from {files[0].parent / TIMES_FILE}: leave out --rate-hz, "
                "or remove that table."
            )
        height_px, width_px = _first_readable(self.name, files)
        coding = max((_coding(file) for file in files), key=lambda coding: coding is not Coding.LOSSLESS)
        object.__setattr__(self, "times_s", times_s)
        object.__setattr__(
            self,
            "description",
            Description(
                name=self.name,
                kind="images",
                codec=", ".join(sorted({file.suffix.lower().lstrip(".") for file in files})),
                coding=coding,
                width_px=width_px,
                height_px=height_px,
                rate_hz=self.rate_hz,
                has_times=times_s is not None or self.rate_hz is not None,
                frame_count=len(files),
                files=files,
            ),
        )

    def __iter__(self) -> Iterator[Frame | LostFrame]:
        """Read the images one by one."""
        return map(self.frame, range(len(self.description.files)))

    def frame(self, index: int) -> Frame | LostFrame:
        """Read the image with a given number, from 0."""
        file, time_s = self.description.files[index], self._time_s(index)
        size_px = (self.description.height_px, self.description.width_px)
        if self.times_s is not None and index and time_s == self.times_s[index - 1]:
            return LostFrame(index, time_s, Status.DUPLICATE, "The frame has the same time as the previous frame.")
        try:
            pixels = read_image(file)
        except UnreadableImageError as error:
            return LostFrame(index, time_s, Status.DAMAGED, str(error))
        if pixels.shape[:2] == size_px:
            return Frame(pixels, index, time_s, _coding(file))
        words = (
            f"{file.name} has {pixels.shape[1]}x{pixels.shape[0]} pixels, but the recording has "
            f"{size_px[1]}x{size_px[0]}."
        )
        return LostFrame(index, time_s, Status.DAMAGED, words)

    def _time_s(self, index: int) -> float | None:
        if self.times_s is not None:
            return self.times_s[index]
        return None if self.rate_hz is None else index / self.rate_hz


def _coding(file: Path) -> Coding:
    return Coding.INTRAFRAME if file.suffix.lower() in LOSSY_SUFFIXES else Coding.LOSSLESS


def _files(name: str) -> tuple[Path, ...]:
    """Images in natural order: frame2 before frame10."""
    path = Path(name)
    if path.is_dir():
        try:
            found = list(path.iterdir())
        except PermissionError:
            raise InputFileError(f"The folder {name} may not be read: change its permissions.") from None
        what = f"The folder {name} must contain images"
    elif path.is_file():
        found = [path]
        what = f"{name} must be an image"
    else:
        found = [Path(match) for match in glob.glob(name)]  # noqa: PTH207 - the pattern may be absolute
        what = f"The pattern {name} must match images"
    images = [file for file in found if file.suffix.lower() in IMAGE_SUFFIXES and not file.name.startswith(".")]
    files = tuple(sorted((file for file in images if file.is_file()), key=_natural))
    if not files:
        raise InputFileError(f"{what} ({', '.join(sorted(IMAGE_SUFFIXES))}), but no such image was found.")
    return files


def _natural(file: Path) -> tuple[tuple[int, int, str], ...]:
    """Sort key in which digits count as numbers and all other characters as letters."""
    parts = re.split(r"([0-9]+)", str(file))
    return tuple((1, int(part), part) if place % 2 else (0, 0, part) for place, part in enumerate(parts))


def _first_readable(name: str, files: tuple[Path, ...]) -> tuple[int, int]:
    """Height and width of the first readable image, which all images of the recording must have."""
    first_words = ""
    for file in files:
        try:
            pixels = read_image(file)
        except UnreadableImageError as error:
            first_words = first_words or str(error)
            continue
        return int(pixels.shape[0]), int(pixels.shape[1])
    raise InputFileError(f"None of the {len(files)} images of {name} can be read: {first_words}")
