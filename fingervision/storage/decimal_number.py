"""Numbers in tables: decimal, in ASCII.

Python's own conversion would also accept 1_0 as 10, and digits of other scripts.
"""

from collections.abc import Iterable


def decimal_number(cell: str) -> float:
    """Read a number.

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
    ValueError: 1_0 is no decimal number
    """
    if not are_decimal((cell,)):
        raise ValueError(f"{cell} is not a decimal number")
    return float(cell)


def are_decimal(cells: Iterable[str]) -> bool:
    """Whether the cells, if Python can convert them, are decimal numbers as in tables."""
    joined = "".join(cells)
    return "_" not in joined and joined.isascii()
