"""Checks of the values in a request, and the response to a request."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from fingervision.domain.errors import StateError, UsageError
from fingervision.domain.region import Region
from fingervision.live.frame_measurement import Seen
from fingervision.live.view import View

GREATEST = 10**12
"""Largest number in a request; the comparison with this limit is safe for any value, including NaN, whereas a
conversion is not."""
MOST_LETTERS = 1000
"""Largest length of a text in a request, such as a path or a name."""


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


def number(request: Request, name: str) -> float:
    """Read a number from a request.

    Raises
    ------
    UsageError
        The value is not a number.
    """
    value = request.get(name)
    if not isinstance(value, bool) and isinstance(value, int | float) and abs(value) <= GREATEST:
        return float(value)
    raise UsageError(f"{name} must be a number, but is {shown(value)}.")


def number_or_none(request: Request, name: str) -> float | None:
    """Read a number from a request; None if the number is missing."""
    return None if request.get(name) is None else number(request, name)


def whole(request: Request, name: str) -> int:
    """Read a whole number from a request.

    Raises
    ------
    UsageError
        The value is not a whole number.
    """
    value = request.get(name)
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) <= GREATEST:
        return value
    raise UsageError(f"{name} must be a whole number, but is {shown(value)}.")


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
    if not (
        isinstance(sides, list)
        and len(sides) == 4
        and all(isinstance(side, int) and not isinstance(side, bool) and abs(side) <= GREATEST for side in sides)
    ):
        raise UsageError("The region must be four whole numbers (column, row, width, height), but are not.")
    return Region(*sides)
