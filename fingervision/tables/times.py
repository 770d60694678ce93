"""Convert dates and times of day, in the notations of common programs, to seconds; leaps of clocks."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, datetime

import numpy as np
from numpy.typing import NDArray

from fingervision.storage.csv_columns import Numbers
from fingervision.tables.dialect import MISSING

MONTH_WORDS = (
    "jan january januar janv", "feb february februar fev", "mar march mrz marz", "apr april avr", "may mai",
    "jun june juni juin", "jul july juli juil", "aug august aout", "sep sept september", "oct october okt oktober",
    "nov november", "dec december dez dezember",
)  # fmt: skip
MONTHS = {word: number for number, words in enumerate(MONTH_WORDS, start=1) for word in words.split()}
"""Months in English, German and French, in lower case and without accents."""
WORD = r"(?P<month>[A-Za-zäéû]{3,9})\.?"
CLOCK_PART = r"(?P<clock>\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?(?:\s*[AaPp]\.?[Mm]\.?)?)?"
WITH_WORD = (
    re.compile(
        rf"(?:[A-Za-z]{{2,9}},?\s+)?(?P<day>\d{{1,2}})\.?[-\s/]{WORD}[-\s/,]\s*(?P<year>\d{{4}}|\d\d)[T,:\s]*{CLOCK_PART}"
    ),
    re.compile(rf"(?:[A-Za-z]{{2,9}},?\s+)?{WORD}\s+(?P<day>\d{{1,2}}),?\s+(?P<year>\d{{4}}),?\s*{CLOCK_PART}"),
    re.compile(rf"[A-Za-z]{{3}}\s+{WORD}\s+(?P<day>\d{{1,2}})\s+{CLOCK_PART}\s+(?P<year>\d{{4}})"),
)
"""`23-Nov-2026 13:24:07`, `Nov 23, 2026 13:24`, and the order of C's `ctime`: `Mon Nov 23 13:24:07 2026`."""
COMPACT = re.compile(r"(\d{4})(\d\d)(\d\d)T(\d\d)(\d\d)(\d\d)([.,]\d+)?(Z|[+-]\d{2}:?\d{2})?")
WITH_DAYS = re.compile(r"(?P<days>\d+) days?,? (?P<clock>\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?)")
PLAIN = str.maketrans("äéû", "aeu")


def rewritten(text: str) -> str:
    """Rewrite a date as `2026-11-23 13:24:07`; any other text is returned unchanged.

    Examples
    --------
    >>> rewritten("23-Nov-2026 13:24:07.5"), rewritten("Mon Nov 23 13:24:07 2026"), rewritten("20261123T132407Z")
    ('2026-11-23 13:24:07.5', '2026-11-23 13:24:07', '2026-11-23 13:24:07Z')
    >>> rewritten("Nov 3, 2026 1:24 PM"), rewritten("13:24:07")
    ('2026-11-03 1:24 PM', '13:24:07')
    """
    if (compact := COMPACT.fullmatch(text)) is not None:
        year, month, day, hours, minutes, seconds, fraction, zone = compact.groups()
        return f"{year}-{month}-{day} {hours}:{minutes}:{seconds}{fraction or ''}{zone or ''}"
    if not any(map(str.isalpha, text)):
        return text
    for pattern in WITH_WORD:
        match = pattern.fullmatch(text)
        month = MONTHS.get(match["month"].lower().translate(PLAIN)) if match is not None else None
        if match is not None and month is not None:
            year = match["year"] if len(match["year"]) == 4 else f"20{match['year']}"
            return f"{year}-{month:02}-{int(match['day']):02} {match['clock'] or ''}".rstrip()
    return text


def days_and_clock(text: str) -> tuple[int, str] | None:
    """Split a duration with days.

    Examples
    --------
    >>> days_and_clock("1 days 00:00:00.5")
    (1, '00:00:00.5')
    """
    match = WITH_DAYS.fullmatch(text)
    return None if match is None else (int(match["days"]), match["clock"])


HOUR_S = 3600.0
COUNTER_BITS = (16, 24, 31, 32)
COUNTS_S = (1.0, 1e-3, 1e-6)
"""What one count of a clock may be worth (s)."""
OVERFLOWS_S = np.array([2.0**bits * count for bits in COUNTER_BITS for count in COUNTS_S])
PERIODS_S = np.concatenate([[HOUR_S], OVERFLOWS_S])
MOST_STEPS = 3.0
"""Largest difference between a leap and its cause, in usual steps: a step may be lost or late beside it."""


def usual_step(time: NDArray[np.float64]) -> float:
    """Median time between two rows."""
    return float(np.median(np.abs(np.diff(time))))


def _period(step: NDArray[np.float64], usual: float) -> NDArray[np.float64]:
    """For each step, what summer time or an overflow added to it, with its sign; 0 if neither explains it."""
    if not 0.0 < usual < HOUR_S / (2.0 * MOST_STEPS):
        return np.zeros(step.size)
    signed = np.concatenate([PERIODS_S[:1], -PERIODS_S])
    apart = np.abs(step[:, None] - signed - usual)
    best = np.argmin(apart, axis=1)
    return np.where(apart[np.arange(step.size), best] <= MOST_STEPS * usual, signed[best], 0.0)


def is_known_leap(step: NDArray[np.float64], time: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether summer time or the overflow of a counter explains each of some steps of a time."""
    return np.asarray(_period(step, usual_step(time)) != 0.0)


def clock_leaps(time: NDArray[np.float64], *, dated: bool) -> NDArray[np.intp]:
    """Steps of a clock that go back, and those by an hour more than usual, if times are dates.

    Parameters
    ----------
    time : ndarray of float, shape (n,)
        Times (s).
    dated : bool
        Whether the times were written as dates: only such clocks are put forward.
    """
    steps = np.diff(time)
    far = np.flatnonzero((steps < 0.0) | ((steps > 0.5 * HOUR_S) & dated))
    return far[(steps[far] < 0.0) | is_known_leap(steps[far], time)]


def without_leaps(time: NDArray[np.float64], leaps: NDArray[np.intp]) -> NDArray[np.float64]:
    """Elapsed time of a clock whose steps at some places are leaps.

    What is known to cause a leap is taken away; any other leap is replaced by the usual step.
    """
    usual = usual_step(time)
    steps = np.diff(time)
    cause = _period(steps[leaps], usual)
    steps[leaps] = np.where(cause != 0.0, steps[leaps] - cause, usual)
    return np.concatenate([[0.0], np.cumsum(steps)])


CLOCK = re.compile(r"(?P<h>\d{1,2}):(?P<m>\d{2})(?::(?P<s>\d{2})(?:[.,:](?P<f>\d+))?)?\s*(?P<half>[AaPp]\.?[Mm]\.?)?")
DAY = re.compile(r"(?P<a>\d{1,4})(?P<mark>[-./])(?P<b>\d{1,2})(?P=mark)(?P<c>\d{1,4})")
STAMP = re.compile(
    r"(?P<day>\d{1,4}[-./]\d{1,2}[-./]\d{1,4})[T,;]?\s*(?P<clock>\d{1,2}:\d{2}\S*(?:\s*[AaPp]\.?[Mm]\.?)?)?"
)
USUAL = re.compile(r"(\d[\d./-]*)[T ](\d{1,2}):(\d\d):(\d\d)(?:[.,](\d+))?")
"""Pattern of a date and time as most programs write them."""
ZONE = re.compile(r"(Z|[+-]\d{2}:?\d{2})$")
DAY_S = 86400.0
HALF_DAY_S = 43200.0
TEN_HOURS_S = 36000.0
ORDERS = ("dmy", "mdy")
DAY_NUMBERS = (36526.0, 58500.0)
"""Days since 1899-12-30 of the years 2000 to 2060: a date as a spreadsheet stores it."""
DAY_STEP = 0.01
"""Largest median step between day numbers, in days: a log has at least one row per quarter of an hour. Numbers with
larger steps are taken as seconds."""


@dataclass(frozen=True, slots=True, eq=False)
class Seconds:
    """A column of dates or times of day, converted to seconds.

    Parameters
    ----------
    numbers : Numbers
        Seconds since the first value.
    since : str
        The first value, as written in the file.
    notes : tuple of str
        Assumptions that were made, one sentence each.
    open_order : bool
        Whether the order of day and month is ambiguous and affects the times.
    unread : int
        Number of cells that are neither a date nor a time.
    """

    numbers: Numbers
    since: str
    notes: tuple[str, ...] = ()
    open_order: bool = False
    unread: int = 0


def looks_like_time(cells: Sequence[str]) -> bool:
    """Whether a column's first values are dates or times of day."""
    some = [cell for cell in cells[:50] if cell.strip().lower() not in MISSING]
    return bool(some) and all(
        STAMP.match(cell) or CLOCK.fullmatch(ZONE.sub("", cell).strip()) or _is_written_out(cell) for cell in some
    )


def _is_written_out(cell: str) -> bool:
    """Whether a cell is a date with a word, a compact date, or a duration with days."""
    return rewritten(cell.strip()) != cell.strip() or days_and_clock(cell.strip()) is not None


def seconds_of(cells: Sequence[str], date_order: str = "") -> Seconds:
    """Read dates and times of day.

    If the time of day decreases by more than half a day, one midnight is assumed to have passed. An offset from UTC is
    subtracted; times without an offset are used unchanged.

    Parameters
    ----------
    cells : sequence of str
        `2024-05-03T12:00:01.5+02:00`, `03.05.2024 12:00:01,5`, `5/3/2024 1:00:01 PM`, `12:00:01.250`.
    date_order : str
        Order of day, month and year if the user has stated it: `dmy`, `mdy` or `ymd`.
    """
    clock_s, present, codes, words = _taken_apart(cells)
    days = {order: _days(words, order) for order in ([date_order] if date_order else ORDERS)}
    usable = [numbers for numbers in days.values() if numbers is not None]
    if not usable or not present.any():
        none = np.zeros(len(cells))
        return Seconds(Numbers(none, none > 0.0), "", unread=len(cells))
    value = clock_s + np.where(codes >= 0, DAY_S * usable[0][codes], 0.0)
    notes = []
    if not words:
        known = np.flatnonzero(present)
        if _counts_to_twelve(cells, value[known]):
            value[known[1:]] += HALF_DAY_S * np.cumsum(np.diff(value[known]) < -TEN_HOURS_S)
            notes.append("The times of day count to twelve, without AM or PM: twelve hours were added after 12:59.")
        falls = np.diff(value[known]) < -HALF_DAY_S
        if falls.any():
            value[known[1:]] += DAY_S * np.cumsum(falls)
            notes.append(f"The times of day pass midnight {int(falls.sum())} time(s): a day was added each time.")
    first = int(np.argmax(present))
    unread = sum(cells[row].strip().lower() not in MISSING for row in np.flatnonzero(~present).tolist())
    return Seconds(
        Numbers(np.where(present, value - value[first], 0.0), present),
        cells[first],
        tuple(notes),
        len(usable) > 1 and bool(np.any(usable[0] != usable[1])),
        unread,
    )


def _counts_to_twelve(cells: Sequence[str], value: NDArray[np.float64]) -> bool:
    """Whether times of day without AM or PM go from 12:59 to 1:00, and lie in the hours from 1 to 12."""
    steps = np.diff(value)
    back = steps < 0.0
    return bool(
        back.any()
        and not any(cell.strip()[-1:] in "mM." for cell in cells[:1])
        and np.all((steps[back] <= -TEN_HOURS_S) & (steps[back] >= -HALF_DAY_S))
        and np.all((value >= 3600.0) & (value < 13.0 * 3600.0))
        and np.all(value[:-1][back] >= HALF_DAY_S)
    )


def _taken_apart(
    cells: Sequence[str],
) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.intp], list[str]]:
    """For each cell: seconds of the day, whether it is a time, and index of its date (-1 for none); also all dates."""
    clock_s, present = np.zeros(len(cells)), np.zeros(len(cells), dtype=np.bool_)
    codes = np.full(len(cells), -1, dtype=np.intp)
    number: dict[str, int] = {}
    for row, cell in enumerate(cells):
        if (usual := USUAL.fullmatch(cell)) is not None:
            day, hours, minutes, whole, fraction = usual.groups()
            seconds: float | None = 3600 * int(hours) + 60 * int(minutes) + float(f"{whole}.{fraction or 0}")
        else:
            day, seconds = _one(cell.strip())
        if seconds is None:
            continue
        clock_s[row], present[row] = seconds, True
        if day:
            codes[row] = number.setdefault(day, len(number))
    return clock_s, present, codes, list(number)


def _one(text: str) -> tuple[str, float | None]:
    """Split a cell into date ('' for none) and seconds of the day; None if the cell contains no time."""
    if (duration := days_and_clock(text)) is not None:
        days, text = duration
        seconds = _clock(text)
        return "", None if seconds is None else days * DAY_S + seconds
    text = rewritten(text)
    offset = 0.0
    if (zone := ZONE.search(text)) is not None and ":" in text[: zone.start()]:
        offset = _offset(zone[0])
        text = text[: zone.start()].strip()
    match = STAMP.fullmatch(text)
    if match is None and CLOCK.fullmatch(text) is None:
        return "", None
    clock = match["clock"] if match else text
    seconds = 0.0 if clock is None else _clock(clock)
    return match["day"] if match else "", None if seconds is None else seconds - offset


def _days(words: Sequence[str], order: str) -> NDArray[np.float64] | None:
    """Convert each date to days since the first date (a single zero without dates).

    The result is None if a date does not exist in the assumed order of day, month and year.
    """
    numbers = [_ordinal(word, order) for word in words]
    if None in numbers:
        return None
    # Times are counted from the first time, so that a float holds microseconds exactly enough.
    known = [number for number in numbers if number is not None]
    return np.array([number - known[0] for number in known] or [0], dtype=np.float64)


def _clock(text: str) -> float | None:
    match = CLOCK.fullmatch(text.strip())
    if match is None:
        return None
    hours = int(match["h"])
    if match["half"]:
        hours = hours % 12 + (12 if match["half"][0] in "pP" else 0)
    seconds = 3600.0 * hours + 60.0 * int(match["m"]) + int(match["s"] or 0)
    fraction = match["f"]
    return seconds + (int(fraction) / 10.0 ** len(fraction) if fraction else 0.0)


def _offset(zone: str) -> float:
    """Number of seconds by which a time zone is ahead of UTC."""
    if zone == "Z":
        return 0.0
    sign = -1.0 if zone[0] == "-" else 1.0
    return sign * (3600.0 * int(zone[1:3]) + 60.0 * int(zone[-2:]))


def _ordinal(text: str, order: str) -> int | None:
    """Convert a date to a day number; None if no such day exists. Dates before 1970 are accepted."""
    match = DAY.fullmatch(text)
    if match is None:
        return None
    a, b, c = (int(match[part]) for part in "abc")
    if len(match["a"]) > 2 or order == "ymd":
        year, month, day = a, b, c
    elif order == "mdy" and match["mark"] != ".":
        month, day, year = a, b, c
    else:
        day, month, year = a, b, c
    if year < 100 and len(match["a"]) <= 2:
        year += 2000 if year < 70 else 1900  # as POSIX's %y
    try:
        return date(year, month, day).toordinal()
    except ValueError:
        return None


def is_epoch(first: float) -> str:
    """Name of the epoch from which a large number of seconds is counted; empty if it matches no known epoch.

    Examples
    --------
    >>> is_epoch(1714730400.0), is_epoch(3797577600.0), is_epoch(12.5)
    ('seconds since 1970', 'seconds since 1904', '')
    """
    for name, epoch in (("1970", datetime(1970, 1, 1)), ("1904", datetime(1904, 1, 1))):
        years = first / (365.25 * DAY_S) + epoch.year
        if 2000.0 <= years <= 2060.0:
            return f"seconds since {name}"
    return ""


def is_day_number(value: float) -> bool:
    """Whether a number may be a date as a spreadsheet stores it, in days since 1899-12-30.

    Examples
    --------
    >>> is_day_number(45415.4244), is_day_number(12.5)
    (True, False)
    """
    return DAY_NUMBERS[0] <= value <= DAY_NUMBERS[1]


def counts_days(values: NDArray[np.float64]) -> bool:
    """Whether a column of times without a unit looks like dates of a spreadsheet."""
    return values.size > 1 and is_day_number(float(values[0])) and 0.0 < float(np.median(np.diff(values))) < DAY_STEP
