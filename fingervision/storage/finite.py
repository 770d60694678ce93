"""Check that a value read from a document is a finite number."""

from math import isfinite


def is_number(value: object) -> bool:
    """Whether a value is an integer or floating-point number in the range of floats, and neither NaN nor infinite."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return isfinite(value)
    except OverflowError:
        return False
