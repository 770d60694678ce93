"""Declaration of one field of a file format: unit, limits and meaning, stated once beside the field of a record.

A record (a frozen dataclass) annotates its fields: `gap_mm: Annotated[float | None, Field("distance", "mm")] = None`.
What reads and writes the file, checks its values, words its errors and fills the reference page follows from this. A
library such as pydantic or msgspec would read JSON and TOML from the same annotations, but no CSV, which half of the
formats are; it does not know the line of a key, and words its own errors.
"""

from dataclasses import MISSING, dataclass, fields
from functools import cache
from math import inf
from types import NoneType
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from fingervision.domain.errors import DataError


@dataclass(frozen=True, slots=True)
class Field:
    """Declaration of one field of a file format.

    Parameters
    ----------
    meaning : str
        What the field holds, for the reference page.
    unit : str
        Unit of its numbers; empty for none.
    places : int or None
        Decimal places that are written; None for nine significant digits.
    low, high : float
        Smallest and largest number.
    above, below : float
        Numbers that must be exceeded, and must not be reached.
    of : tuple of str
        Allowed words; empty for any text.
    shape : tuple of int
        Numbers along each dimension of an array; -1 for any.
    hint : str
        What to do if a number lies beyond the limits.
    since : int
        Schema number of the first version of the format with this field.
    """

    meaning: str = ""
    unit: str = ""
    places: int | None = None
    low: float = -inf
    high: float = inf
    above: float = -inf
    below: float = inf
    of: tuple[str, ...] = ()
    shape: tuple[int, ...] = ()
    hint: str = ""
    since: int = 1

    def refusal(self, value: float) -> str | None:
        """Say what a number must be and is; None if it lies within the limits."""
        if self.above < value < self.below and self.low <= value <= self.high:
            return None
        limits = [
            f"{words} {limit:g}"
            for words, limit in (
                ("at least", self.low), ("greater than", self.above), ("at most", self.high), ("below", self.below),
            )
            if abs(limit) < inf
        ]  # fmt: skip
        must = f"between {self.low:g} and {self.high:g}" if inf not in (-self.low, self.high) else " and ".join(limits)
        must = f"{self.low:g}" if self.low == self.high else must
        unit = f" {self.unit}" if self.unit else ""
        return f"must be {must}{unit}, but is {value:g}{f': {self.hint}' if self.hint else ''}"


@dataclass(frozen=True, slots=True)
class Declared:
    """A field of a record together with its declaration.

    Parameters
    ----------
    name : str
        Name of the field, in the record and in the file.
    kind : type
        Type of its values, without None.
    field : Field
        The declaration.
    is_optional : bool
        Whether None is a value.
    is_required : bool
        Whether the field must be given.
    """

    name: str
    kind: Any
    is_optional: bool
    field: Field
    is_required: bool


def declared(record: Any) -> tuple[Declared, ...]:
    """Return the fields of a record (a dataclass) with their declarations, in order."""
    return _declared(record)


@cache
def _declared(record: Any) -> tuple[Declared, ...]:
    hints = get_type_hints(record, include_extras=True)
    found = []
    for each in fields(record):
        hint, field = hints[each.name], Field()
        if get_origin(hint) is Annotated:
            hint, field = get_args(hint)[:2]
        is_optional = NoneType in get_args(hint)
        kind = next(one for one in get_args(hint) if one is not NoneType) if is_optional else hint
        is_required = each.default is MISSING and each.default_factory is MISSING
        found.append(Declared(each.name, kind, is_optional, field, is_required))
    return tuple(found)


class Limited:
    """A record that cannot be made with a number beyond the limits that its fields declare."""

    __slots__ = ()

    def __post_init__(self) -> None:
        for each in declared(type(self)):
            value = getattr(self, each.name)
            if isinstance(value, int | float) and (words := each.field.refusal(value)) is not None:
                raise DataError(f"{each.name} {words}.")


def names_of(record: Any) -> tuple[str, ...]:
    """Return the names of a record's fields, in order."""
    return tuple(each.name for each in fields(record))


def reference_table(*records: Any) -> str:
    """Return the reference table of a format's fields in Markdown: name, unit, meaning with limits and default.

    Fields that differ only in their names (`left_mm`, `right_mm`) stand in one row, as does a field of several records.
    """
    rows: dict[tuple[str, str], list[str]] = {}
    for each in (each for record in records for each in declared(record)):
        rows.setdefault((each.field.unit, each.field.meaning), []).append(f"`{each.name}`")
    lines = [f"| {', '.join(dict.fromkeys(names))} | {unit} | {meaning} |" for (unit, meaning), names in rows.items()]
    return "\n".join(["| field | unit | meaning |", "|---|---|---|", *lines])
