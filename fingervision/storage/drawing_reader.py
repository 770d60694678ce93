"""Reader of a drawing's tables; every error names the file and the number, and states the expected and found value."""

import difflib
from collections.abc import Mapping
from typing import Any

from fingervision.domain.errors import DataError
from fingervision.storage.arithmetic import number


def as_table(raw: Any, what: str) -> Mapping[str, Any]:
    """Return a value if it is a TOML table; otherwise raise an error."""
    if not isinstance(raw, dict):
        raise DataError(f"{what} must be a table, but is {raw!r}.")
    return raw


class DrawingReader:
    """Reads the numbers of a drawing, which may be expressions of names in its section [lengths].

    Parameters
    ----------
    lengths : mapping of str to float
        Values of the names defined in [lengths].
    origin : str
        The file, for errors.
    """

    def __init__(self, lengths: Mapping[str, float], origin: str) -> None:
        self.lengths, self.origin = lengths, origin

    def sections(self, tables: Mapping[str, Any], name: str, least: int = 1) -> list[Mapping[str, Any]]:
        """Return the tables `[[name]]` of the drawing, in order."""
        raw = tables.get(name, [])
        if not isinstance(raw, list) or len(raw) < least:
            raise DataError(f"{self.origin} must have [[{name}]] sections, at least {least}, but has {raw!r}.")
        return [as_table(table, f"[[{name}]] in {self.origin}") for table in raw]

    def known(self, table: Mapping[str, Any], keys: tuple[str, ...], what: str) -> None:
        """Refuse a table of the drawing that has unknown keys."""
        for key in table:
            if key not in keys:
                near = difflib.get_close_matches(key, keys, 1, cutoff=0.0)[0]
                raise DataError(f"{what} in {self.origin} has an unknown key, {key}; did you mean {near}?")

    def value(self, table: Mapping[str, Any], key: str, what: str) -> float:
        """Read one number or expression."""
        name = f"{what}.{key}" if what else key
        if key not in table:
            raise DataError(f"{self.origin} must state {name}, but does not.")
        return number(table[key], self.lengths, f"{name} in {self.origin}")

    def positive(self, table: Mapping[str, Any], key: str, what: str) -> float:
        """Read one positive number."""
        value = self.value(table, key, what)
        if value <= 0.0:
            name = f"{what}.{key}" if what else key
            raise DataError(f"{name} in {self.origin} must be positive, but is {value:g}.")
        return value

    def numbers(self, table: Mapping[str, Any], key: str, count: int, what: str) -> tuple[float, ...]:
        """Read a list of `count` numbers."""
        raw = table.get(key)
        if not isinstance(raw, list) or len(raw) != count:
            raise DataError(f"{what}.{key} in {self.origin} must be a list of {count} numbers, but is {raw!r}.")
        return tuple(number(part, self.lengths, f"{what}.{key} in {self.origin}") for part in raw)

    def grown(self, values: tuple[float, ...], what: str, *, flat: bool = False) -> tuple[float, float, float, float]:
        """Check a rectangle given by its limits (x from, x to, y from, y to).

        With `flat`, the width or the height of the rectangle may be zero.
        """
        x0, x1, y0, y1 = values
        fine = x1 >= x0 and y1 >= y0 if flat else x1 > x0 and y1 > y0
        if not fine:
            raise DataError(
                f"{what} in {self.origin} must be [x from, x to, y from, y to], each range from the smaller "
                "to the larger number, but is "
                f"[{x0:g}, {x1:g}, {y0:g}, {y1:g}]."
            )
        return x0, x1, y0, y1
