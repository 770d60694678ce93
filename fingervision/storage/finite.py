"""Whether what stands in a document is a number that can be calculated with."""

from math import isfinite


def is_number(value: object) -> bool:
    """Whether it is a whole or floating-point number that a float holds: no nan, no infinity, not 400 digits."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return isfinite(value)
    except OverflowError:
        return False
