"""One line for a record that holds arrays."""

from dataclasses import fields

import numpy as np

LONGEST, LONGEST_RECORD = 40, 200
"""Longest text (characters) of a value, and of a record within a record, that is printed as it is."""


class ShortRepr:
    """Base of frozen dataclasses (with `repr=False`) whose arrays may have thousands of rows.

    Arrays, tuples and mappings are printed with their size, and fields that are private or have the value None are left
    out.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True, repr=False)
    ... class Gaps(ShortRepr):
    ...     gap_mm: np.ndarray
    ...     name: str
    >>> Gaps(np.array([0.25, 1.5, 0.75]), "opening")
    Gaps(gap_mm=3 values from 0.25 to 1.5, name='opening')
    """

    __slots__ = ()

    def __repr__(self) -> str:
        held = {each.name: getattr(self, each.name) for each in fields(self) if each.repr}  # type: ignore[arg-type]
        told = [f"{name}={_told(value)}" for name, value in held.items() if value is not None and name[0] != "_"]
        return f"{type(self).__name__}({', '.join(told)})"


def _told(value: object) -> str:
    if isinstance(value, np.ndarray) and value.size > 1 and value.dtype.kind in "fiu":
        counted = " x ".join(map(str, value.shape))
        return f"{counted} values from {np.nanmin(value):.6g} to {np.nanmax(value):.6g}"
    if isinstance(value, float):
        return f"{value:.9g}"
    whole = repr(value)
    if len(whole) <= LONGEST:
        return whole
    if isinstance(value, tuple | list | dict) or hasattr(value, "keys"):
        return f"{len(value)} {'entries' if hasattr(value, 'keys') else 'items'}"  # type: ignore[arg-type]
    is_record = isinstance(value, ShortRepr) and len(whole) <= LONGEST_RECORD
    return whole if is_record else f"{whole[:LONGEST]}..."
