"""Check the times in an MP4 file's table of contents, because one damaged number in it shifts all frames.

The file states the duration of its pictures three times: as the sum of the pictures' durations (`stts`), in the head of
the track (`mdhd`), and in the edit list (`elst`), which also states the first picture to be shown. `stts` and `mdhd`
are in the track's own ticks, `elst` in ticks of the whole film. If FFmpeg cannot read a table to its end, it leaves the
rest unread, and the times are too late by the reordering delay of the encoder. The times are accepted if

* all tables of a track that FFmpeg needs can be read to their ends, and state the same number of pictures;
* the shown duration is not longer than the duration of all pictures;
* a shorter shown duration is not explained by a single damaged byte, so that somebody cut the film.

Files in fragments state their times with each fragment, and are not checked.

Source: ISO/IEC 14496-12, 8.4.2 (`mdhd`), 8.6 (`stts`, `ctts`, `elst`), 8.7.3 (`stsz`).
"""

import mmap
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate, chain, repeat
from pathlib import Path

# Boxes of an MP4 or QuickTime file, and the tables in them.
#
# Source: ISO/IEC 14496-12, 4.2 (boxes), 8.2.2 and 8.4.2 (`mvhd`, `mdhd`), 8.6.6 (`elst`).

HEAD_BYTES, LONG_HEAD_BYTES = 8, 16
INNER = frozenset({b"moov", b"trak", b"mdia", b"minf", b"stbl", b"edts"})
"""Boxes that contain other boxes."""


def boxes(content: mmap.mmap, begin: int, end: int) -> Iterator[tuple[bytes, int, int]]:
    """List the boxes of an MP4 file with the positions of their contents; inner boxes follow the outer box."""
    while begin + HEAD_BYTES <= end:
        size, name = struct.unpack_from(">I4s", content, begin)
        inside = begin + HEAD_BYTES
        if size == 1 and begin + LONG_HEAD_BYTES <= end:
            (size,) = struct.unpack_from(">Q", content, begin + HEAD_BYTES)
            inside = begin + LONG_HEAD_BYTES
        last = end if size == 0 else begin + size
        if last < inside or last > end:
            return
        yield name, inside, last
        if name in INNER:
            yield from boxes(content, inside, last)
        begin = last


def numbers(content: mmap.mmap, begin: int, end: int) -> tuple[int, int]:
    """Ticks per second, and duration in ticks, as stated in a box `mvhd` or `mdhd`."""
    form = ">4x8xII" if content[begin] == 0 else ">4x16xIQ"
    scale, ticks = struct.unpack_from(form, content[begin:end])
    return scale, ticks


def rows(content: mmap.mmap, place: tuple[int, int], form: str) -> list[tuple[int, int]]:
    """Rows of a table that begins with the number of its rows.

    Raises
    ------
    struct.error
        The table has fewer rows than stated.
    """
    begin, end = place
    (count,) = struct.unpack_from(">4xI", content[begin:end])
    last = begin + 8 + count * struct.calcsize(form)
    if last > end:
        raise struct.error("fewer rows than announced")
    return list(struct.iter_unpack(form, content[begin + 8 : last]))


MOST_ENTRIES = 4
"""Largest number of rows of a table for a constant rate. Longer tables are not searched for a single damaged byte that
would explain a difference, because among many bytes such a byte is always found.
"""
BYTE_VALUES = 256
MOST_PICTURES = 10_000_000
"""Largest number of pictures, more than a day at 100 Hz; a table that states more pictures is damaged, and is not
expanded.
"""
NO_SCALE = (
    "The file's table of contents is damaged, so that no frame's time is known: its durations contradict one another, "
    "or a table of times cannot be read."
)


@dataclass(frozen=True, slots=True)
class _Track:
    """Times and durations that the table of contents states for one video track.

    Parameters
    ----------
    scale, ticks : int
        Ticks per second of the track, and its duration in ticks.
    steps : sequence of (int, int)
        Numbers of pictures with their durations in ticks.
    sizes, offset_count : int or None
        Number of pictures with a size, and with an offset of presentation.
    presented : int
        Ticks from the first presentation to the end of the last.
    shown : int
        Duration of the edit list, in ticks of the film; 0 without an edit list.
    empty : int
        Part of `shown` in which nothing is shown.
    skipped : int
        Ticks of the track, from its first picture, that are not shown.
    """

    scale: int
    ticks: int
    steps: Sequence[tuple[int, int]]
    sizes: int | None
    offset_count: int | None
    presented: int
    shown: int
    empty: int
    skipped: int


def states_another_duration(path: Path) -> bool:
    """Whether the stated times of a file's pictures contradict one another.

    Parameters
    ----------
    path : Path
        An MP4 or QuickTime file.
    """
    try:
        with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            found = list(boxes(content, 0, len(content)))
            if any(name in (b"moof", b"mvex") for name, _, _ in found):
                return False
            films = [numbers(content, begin, end) for name, begin, end in found if name == b"mvhd"]
            tracks = [each for each in _tracks(content, found) if each is not None]
    except (OSError, ValueError):
        return False
    except struct.error:
        return True  # a table ends before its last row, or states impossible values
    film_scale = films[0][0] if films else 0
    return any(_contradicts(track, film_scale) for track in tracks)


def _contradicts(track: _Track, film_scale: int) -> bool:
    pictures = sum(count for count, _ in track.steps)
    if any(other is not None and other != pictures for other in (track.sizes, track.offset_count)):
        return True
    if not track.steps or not track.ticks:
        return False
    if track.scale < 1:
        return True
    longest = max(ticks for _, ticks in track.steps)
    total = sum(count * ticks for count, ticks in track.steps)
    # Programs state the sum of the durations, or the time from the first presentation to the last; some add one
    # picture.
    more = {total + ticks for _, ticks in track.steps}
    last_count, last_ticks = track.steps[-1]
    if last_count == 1:
        # The duration of the last picture does not affect any time, and programs that copy a film change it.
        more |= {one - last_ticks + ticks for one in (*more, total) for _, ticks in track.steps}
    departures = [abs(track.ticks - sound) for sound in (total, track.presented, *more)]
    if min(departures) and (_is_explained(track) or (min(departures) > longest and _is_another(track.ticks, total))):
        return True
    if not track.shown or film_scale < 1:
        return False
    shown_s = (track.shown - track.empty) / film_scale
    there_s = (track.ticks - track.skipped) / track.scale
    slack_s = longest / track.scale + 1.0 / film_scale
    # A track that states the sum of its durations (FFmpeg of PyAV 19) is shown for longer, where pictures with uneven
    # times are stored in another order than they are shown.
    reordered_s = (max(0, track.presented - track.ticks) if track.ticks == total else 0) / track.scale
    if shown_s > there_s + reordered_s + slack_s:
        return True
    # A shorter duration means that the film was cut, or that one byte of the ticks per second is damaged.
    is_cut = there_s > shown_s + slack_s
    return is_cut and any(
        abs(ticks - track.skipped - scale * shown_s) <= 1.0 + scale / film_scale
        for scale in _coarse_neighbours(track.scale)
        for ticks in (track.ticks, total, track.presented)
    )


def _is_explained(track: _Track) -> bool:
    """Whether one wrong byte, in the durations of a constant rate or in the total, would make the durations agree."""
    if len(track.steps) > MOST_ENTRIES:
        return False
    total = sum(count * step for count, step in track.steps)
    return total in _neighbours(track.ticks) or any(
        track.ticks - total - count * (other - step) in (0, other)
        for count, step in track.steps
        for other in _neighbours(step)
    )


def _is_another(ticks: int, total: int) -> bool:
    """Whether the larger of two numbers is more than twice the smaller number."""
    return ticks > 2 * total or total > 2 * ticks


def _neighbours(number: int) -> Iterator[int]:
    """All numbers that differ from a four-byte number in one byte."""
    for shift in (0, 8, 16, 24):
        rest = number & ~(0xFF << shift)
        yield from (rest | value << shift for value in range(BYTE_VALUES))


def _coarse_neighbours(number: int) -> Iterator[int]:
    """As `_neighbours`, but with no more than one wrong bit in the last byte.

    If the whole last byte could be wrong, a cut of less than 2 % would always be mistaken for damage.
    """
    yield from (other for other in _neighbours(number) if other & 0xFF == number & 0xFF)
    yield from (number ^ (1 << bit) for bit in range(8))


def _tracks(content: mmap.mmap, found: list[tuple[bytes, int, int]]) -> Iterator[_Track | None]:
    for name, begin, end in found:
        if name != b"trak":
            continue
        inner = {each: (first, last) for each, first, last in found if begin <= first and last <= end}
        if b"vmhd" in inner:
            yield _track(content, inner)


def _track(content: mmap.mmap, inner: dict[bytes, tuple[int, int]]) -> _Track | None:
    if not {b"mdhd", b"stts"} <= inner.keys():
        return None
    scale, ticks = numbers(content, *inner[b"mdhd"])
    steps = rows(content, inner[b"stts"], ">II")
    offsets = rows(content, inner[b"ctts"], ">Ii") if b"ctts" in inner else None
    shown_parts: list[tuple[int, int]] = []  # durations with the ticks at which they begin; -1: nothing is shown
    if b"elst" in inner:
        is_long = content[inner[b"elst"][0]] == 1
        shown_parts = rows(content, inner[b"elst"], ">Qq4x" if is_long else ">Ii4x")
    if b"edts" in inner and b"elst" not in inner:
        raise struct.error("a box edts without its list elst")
    sizes = None
    if b"stsz" in inner:
        begin, end = inner[b"stsz"]
        _, same, sizes = struct.unpack_from(">III", content[begin:end])
        listed = 0 if same else sizes
        if begin + 12 + 4 * listed > end:
            raise struct.error("fewer sizes than announced")
        stated = (size for (size,) in struct.iter_unpack(">I", content[begin + 12 : begin + 12 + 4 * listed]))
        if max(stated, default=same) > len(content):
            raise struct.error("a picture larger than the file")
    shown = sum(duration for duration, _ in shown_parts)
    empty = sum(duration for duration, at in shown_parts if at < 0)
    first, last = _presented(steps, offsets or ())
    skipped = min((at for _, at in shown_parts if at >= 0), default=first) - first
    counted = None if offsets is None else sum(count for count, _ in offsets)
    return _Track(scale, ticks, steps, sizes, counted, last - first, shown, empty, skipped)


def _presented(steps: Sequence[tuple[int, int]], offsets: Sequence[tuple[int, int]]) -> tuple[int, int]:
    """First tick at which a picture is presented, and the end of the last picture (ticks)."""
    if sum(count for count, _ in steps) > MOST_PICTURES:
        return 0, sum(count * ticks for count, ticks in steps)
    durations = [ticks for count, ticks in steps for _ in range(count)]
    moved = chain((offset for count, offset in offsets for _ in range(count)), repeat(0))
    coded = accumulate(durations, initial=0)
    begins = [at + offset for at, offset in zip(coded, moved, strict=False)][: len(durations)]
    ends = (at + ticks for at, ticks in zip(begins, durations, strict=True))
    return min(begins, default=0), max(ends, default=0)
