"""Write a value with its uncertainty, both to the same digit."""

from math import floor, isfinite, log10

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
