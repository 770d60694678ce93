"""Checks of the values in a request, and the response to a request."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fingervision.domain.errors import FingervisionError, StateError, UsageError
from fingervision.domain.frame import Region
from fingervision.domain.numbers import stated_number
from fingervision.live.frame_measurement import Seen
from fingervision.live.view import View
from fingervision.tables.units import known_unit

GREATEST = 10**12
"""Largest number in a request; the comparison with this limit is safe for any value, including NaN, whereas a
conversion is not."""
SIDES = ("column", "row", "width", "height")
FIELDS = {
    "px_per_mm": ("The scale", "px/mm"),
    "u_px_per_mm": ("The uncertainty of the scale", "px/mm"),
    "below_tip_mm": ("The height below the tips", "mm"),
    "least": ("The lower limit", "mm"),
    "greatest": ("The upper limit", "mm"),
    "size_mm": ("The size", "mm"),
    "u_size_mm": ("The uncertainty of the size", "mm"),
    "input_mm": ("The input", "mm"),
    "to_mm": ("The position", "mm"),
    "speed_mm_s": ("The speed", "mm/s"),
    "for_s": ("The time", "s"),
    "time_s": ("The time", "s"),
    "frame": ("The frame", ""),
    **{side: (f"The region's {side}", "px") for side in SIDES},
}
"""What the page's user calls a number of a request, and its unit, which may be typed behind it."""
MULTIPLES = {"mm": {"m": 1e3, "cm": 10.0, "um": 1e-3, "inch": 25.4}, "s": {"ms": 1e-3, "min": 60.0}}
"""Other units of a length and of a time, by their names in `fingervision.tables.units`."""
WITH_UNIT = re.compile(
    r"(?P<number>[^a-zA-Z\u00b5\u03bc%]*\d(?:[eE][+-]?\d+)?)\s*(?P<unit>[a-zA-Z\u00b5\u03bc%][^\d]*)"
)
"""A number with a unit behind it: `0,3 mm`."""
MOST_LETTERS = 1000
"""Largest length of a text in a request, such as a path or a name."""
MOST_CHANGE = 2.0
"""Largest factor by which a scale changes without a question: refocusing changes it by per cent, a wrong unit or a
lost decimal mark by 10 or more."""


@dataclass(frozen=True, slots=True)
class Answer:
    """Response to a request.

    Parameters
    ----------
    words : str
        Sentence for the user; empty if the page shows the result in any case.
    pictures : tuple of (str, bytes)
        Names and PNG pictures of the measuring steps.
    more : mapping
        Additional data for the script of the page that sent the request, transmitted as JSON.
    """

    words: str = ""
    pictures: tuple[tuple[str, bytes], ...] = ()
    more: Mapping[str, Any] = field(default_factory=dict)


Request = Mapping[str, Any]
Command = Callable[[View, Request], Answer]


def seen_of(view: View) -> Seen:
    """Return the displayed frame with its measurement; an error if there is no frame yet.

    Raises
    ------
    StateError
        No picture has arrived yet.
    """
    if view.seen is None:
        raise StateError("No picture has arrived yet: wait until the source sends one.")
    return view.seen


class QuestionError(FingervisionError):
    """A request that is probably a mistake: the user is asked, and the page sends it again with `sure` if it is not."""


def number(request: Request, name: str) -> float:
    """Read a number from a request, also as a text with a decimal point or comma and a unit.

    Raises
    ------
    UsageError
        The value is not a number, a text that may be two different numbers, or has another unit.
    """
    called, unit = FIELDS.get(name, (name, ""))
    value, factor = request.get(name), 1.0
    if isinstance(value, str) and 0 < len(value) <= MOST_LETTERS:
        if name in FIELDS and (found := WITH_UNIT.fullmatch(value.strip())) is not None:
            value, factor = found["number"], _factor(found["unit"].strip(), unit, called)
        value = stated_number(value, called)
    if not isinstance(value, bool) and isinstance(value, int | float) and abs(value) <= GREATEST:
        return float(value) * factor
    raise UsageError(f"{called} must be a number, but is {shown(value)}.")


def _factor(typed: str, unit: str, called: str) -> float:
    """Factor from a typed unit to the unit of a field."""
    multiples = MULTIPLES.get(unit, {})
    factor = 1.0 if typed == unit else multiples.get(known_unit(typed) or "", 1.0 if known_unit(typed) == unit else 0.0)
    if not factor:
        raise UsageError(f"{called} must be {f'in {unit}' if unit else 'a number without unit'}, but is in {typed!r}.")
    return factor


def number_or_none(request: Request, name: str) -> float | None:
    """Read a number from a request; None if the number is missing."""
    return None if request.get(name) in (None, "") else number(request, name)


def whole(request: Request, name: str) -> int:
    """Read a whole number from a request.

    Raises
    ------
    UsageError
        The value is not a whole number.
    """
    value = number(request, name)
    if value.is_integer():
        return int(value)
    raise UsageError(f"{FIELDS.get(name, (name,))[0]} must be a whole number, but is {value:g}.")


def words(request: Request, name: str) -> str:
    """Read a text from a request.

    Raises
    ------
    UsageError
        The value is not a text, or the text is too long.
    """
    value = request.get(name)
    if isinstance(value, str) and 0 < len(value) <= MOST_LETTERS and value.isprintable():
        return value
    raise UsageError(f"{name} must be a text of 1 to {MOST_LETTERS} letters, but is {shown(value)}.")


def one_of(request: Request, name: str, allowed: Sequence[str], called: str) -> str:
    """Read one of a few words from a request.

    Raises
    ------
    UsageError
        The value is another one.
    """
    value = request.get(name)
    if value not in allowed:
        raise UsageError(f"{called} must be one of {', '.join(allowed)}, but is {shown(value)}.")
    return str(value)


def file_inside(view: View, request: Request, name: str, called: str) -> Path:
    """Read the name of a file that a browser page may name: below the program's start folder or the output folder.

    Raises
    ------
    UsageError
        The file lies elsewhere.
    """
    path = Path(words(request, name)).resolve()
    if not any(path.is_relative_to(folder.resolve()) for folder in (Path.cwd(), view.out)):
        raise UsageError(
            f"{called} must lie inside the folder {Path.cwd()} or {view.out}, but {shown(str(path))} does not: copy "
            "the file there."
        )
    return path


def check_scale(view: View, px_per_mm: float, request: Request) -> None:
    """Ask about a scale that differs from the present one by more than a factor of `MOST_CHANGE`.

    Raises
    ------
    QuestionError
        The scale differs by more, and the user has not confirmed it.
    """
    before = view.choices.scale
    if before is None or request.get("sure") is True:
        return
    change = px_per_mm / before.px_per_mm
    if not 1.0 / MOST_CHANGE <= change <= MOST_CHANGE:
        raise QuestionError(
            f"The scale was {before.px_per_mm:g} px/mm and would be {px_per_mm:g} px/mm, so that all gaps would change "
            f"by a factor of {1.0 / change:.3g}. Is the new scale right?"
        )


def shown(value: Any) -> str:
    """Shorten a received value for an error message; a number may have more digits than Python prints."""
    if value is None or value == "":
        return "empty"
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) > GREATEST:
        return "too large"
    return repr(str(value)[:40])


def box(request: Request) -> Region:
    """Read a rectangle of the picture from a request.

    Raises
    ------
    UsageError
        The value is not of the required type.
    """
    sides = request.get("box")
    if not isinstance(sides, list) or len(sides) != len(SIDES):
        raise UsageError(f"The region must be four whole numbers ({', '.join(SIDES)}), but is {shown(sides)}.")
    named = dict(zip(SIDES, sides, strict=True))
    return Region(*(whole(named, side) for side in SIDES))
