"""Numbers as people and programs write them: a decimal point or comma, and separators between groups of digits."""

import re
from math import floor, isfinite, log10

from fingervision.domain.errors import ArgumentError

MINUS = str.maketrans({"\N{MINUS SIGN}": "-", "\N{NO-BREAK SPACE}": " "})
SPACES = dict.fromkeys(map(ord, "'\u2019 \u00a0\u2007\u2009\u202f"))
GROUPED = {
    ".": re.compile(r"[+-]?[1-9]\d{0,2}([,'\u2019 \u00a0\u2007\u2009\u202f]\d{3})+(\.\d+)?"),
    ",": re.compile(r"[+-]?[1-9]\d{0,2}([.'\u2019 \u00a0\u2007\u2009\u202f]\d{3})+(,\d+)?"),
}
"""Patterns of numbers with thousands separators, by decimal mark. No program groups the digits of a number that begins
with a zero: `0,067` has a decimal comma."""


def to_number(cell: str, decimal: str) -> float | None:
    """Read a text as a finite number with the given decimal mark; None if the text is not a number.

    Examples
    --------
    >>> to_number("1.234,5", ","), to_number("1,234.5", "."), to_number("2,5D-03", ","), to_number("nan", ".")
    (1234.5, 1234.5, 0.0025, None)
    """
    text = cell.strip().translate(MINUS)
    if GROUPED[decimal].fullmatch(text):
        text = text.translate(SPACES).replace("," if decimal == "." else ".", "")
    if decimal == ",":
        if "." in text:
            return None
        text = text.replace(",", ".")
    text = text.replace("D", "e").replace("d", "e")
    try:
        number = float(text)
    except ValueError:
        return None
    return number if isfinite(number) else None


def stated_number(text: str, name: str) -> float:
    """Read a number that a person typed, with a decimal point or comma.

    A single point is a decimal point, as everywhere in options and configuration files. A comma is read where only
    one reading is possible: `1,234` may be 1.234 or 1234.

    Parameters
    ----------
    text : str
        The text as typed.
    name : str
        Name of the option or field, for the message.

    Raises
    ------
    ArgumentError
        The text is not a number, or may be two different numbers.

    Examples
    --------
    >>> [stated_number(text, "size") for text in ("34,0", "0,067", "1.234", "1.234,5", "1,234.5", "1,5e-3")]
    [34.0, 0.067, 1.234, 1234.5, 1234.5, 0.0015]
    """
    readings = [value for mark in ".," if (value := to_number(text, mark)) is not None]
    if not readings or any(sign.isdigit() and not sign.isascii() for sign in text):
        raise ArgumentError(name, "be a number", f"is {text!r}")
    if "," in text and len(set(readings)) > 1:
        whole, broken = readings
        raise ArgumentError(
            name, "be a number with one reading", f"is {text!r}", f"write {broken!r} or {whole:.0f}, whichever is meant"
        )
    return readings[0]


# Write a value with its uncertainty, both to the same digit.

_MOST_DECIMALS = 7
"""Decimals beyond which a number is easier to read with an exponent."""


def with_uncertainty(value: float, u: float, sign: str = "") -> str:
    """Write a value and its uncertainty, such as `7.720 +- 0.011`.

    The uncertainty has two significant digits, and the value is rounded to the same decimal place (JCGM 100:2008,
    7.2.6).

    Parameters
    ----------
    value, u : float
        The value and its standard or expanded uncertainty, in the same unit.
    sign : str
        `"+"` to write the sign of a positive value too.
    """
    if not isfinite(value) or not isfinite(u) or u <= 0.0:
        return f"{value:{sign}.4g} +- {u:.2g}"
    place = 1 - floor(log10(float(f"{u:.1e}")))
    if place > _MOST_DECIMALS:
        digits = max(1, place + floor(log10(abs(value))) + 1) if value else 1
        return f"{value:{sign}.{digits}g} +- {u:.2g}"
    decimals = max(0, place)
    return f"{round(value, place):{sign}.{decimals}f} +- {round(u, place):.{decimals}f}"
