"""Reader of a drawing's tables, whose numbers may be arithmetic expressions of named lengths."""

import ast
import difflib
import math
import operator
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from fingervision.domain.errors import DataError

_BINARY: Mapping[type[ast.operator], Callable[[float, float], float]] = MappingProxyType(
    {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv}
)
_FUNCTIONS: Mapping[str, Callable[[float], float]] = MappingProxyType(
    {
        "sqrt": math.sqrt,
        "sin_deg": lambda angle: math.sin(math.radians(angle)),
        "cos_deg": lambda angle: math.cos(math.radians(angle)),
        "tan_deg": lambda angle: math.tan(math.radians(angle)),
    }
)
LARGEST = 1e5
"""Largest number in a drawing: 100 m in mm, or as many degrees."""


def number(raw: Any, names: Mapping[str, float], what: str) -> float:
    """Read a number, or evaluate an expression of numbers, names, + - * / ( ), sqrt, sin_deg, cos_deg and tan_deg.

    Parameters
    ----------
    raw : object
        The value as read from the file.
    names : mapping of str to float
        Values of the names that an expression may contain.
    what : str
        Description of the number and its file, for error messages.

    Raises
    ------
    DataError
        The value is not a finite number of at most `LARGEST`, or the expression contains an unknown name or operation.
    """
    if isinstance(raw, str):
        try:
            value = _evaluated(ast.parse(raw, mode="eval").body, names)
        except (SyntaxError, ValueError, ZeroDivisionError, OverflowError, RecursionError) as error:
            raise DataError(
                f"{what} must be a number or an arithmetic expression with names, but is {raw!r}: {error}."
            ) from None
    elif isinstance(raw, bool) or not isinstance(raw, int | float):
        raise DataError(f"{what} must be a number or an arithmetic expression with names, but is {raw!r}.")
    else:
        # A whole number may be too large for a float.
        value = float(raw) if not abs(raw) > 10.0 * LARGEST else math.copysign(math.inf, 1 if raw > 0 else -1)
    if not abs(value) <= LARGEST:
        said = f"{raw:g}" if isinstance(raw, float) else f"{value:g}"
        if isinstance(raw, int) and math.isinf(value):
            said = f"a whole number of {len(str(abs(raw)))} digits"
        raise DataError(f"{what} must be a number of at most {LARGEST:g}, but is {said}.")
    return value


def _evaluated(node: ast.expr, names: Mapping[str, float]) -> float:
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return float(value)
        case ast.Name(id=name):
            if name not in names:
                raise ValueError(f"there is no {name} in [lengths] above it")
            return names[name]
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_evaluated(operand, names)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
            return _BINARY[type(op)](_evaluated(left, names), _evaluated(right, names))
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in _FUNCTIONS:
            return _FUNCTIONS[name](_evaluated(argument, names))
        case _:
            raise ValueError("only numbers, names, + - * / ( ), sqrt, sin_deg, cos_deg and tan_deg are allowed")


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
