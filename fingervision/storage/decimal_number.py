"""Read decimal numbers in tables, written in ASCII characters.

Python's own conversion would also accept 1_0 as 10, and digits of other scripts.
"""

from collections.abc import Iterable


def decimal_number(cell: str) -> float:
    """Read a decimal number from a table cell.

    Raises
    ------
    ValueError
        The cell is not a decimal number in a notation that tables use.

    Examples
    --------
    >>> decimal_number(" -1.5e-3 ")
    -0.0015
    >>> decimal_number("1_0")
    Traceback (most recent call last):
    ...
    ValueError: 1_0 is not a decimal number
    """
    if not are_decimal((cell,)):
        raise ValueError(f"{cell} is not a decimal number")
    return float(cell)


def are_decimal(cells: Iterable[str]) -> bool:
    """Whether cells that Python can convert to numbers are also decimal numbers in a notation used in tables."""
    joined = "".join(cells)
    return "_" not in joined and joined.isascii()
