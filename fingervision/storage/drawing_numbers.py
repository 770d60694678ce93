"""Numbers in the tables of a drawing: arithmetic expressions of named lengths, uncertainties, and changes by name.

A number may be written `{ value = 1.0, u = 0.1 }`, with its standard uncertainty, wherever a number or an expression is
allowed. Repeated sections are addressed by their name, or by their position from 1: `flexure.left.thickness_mm`,
`body.2.width_mm`.
"""

import ast
import copy
import math
import operator
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Any, NoReturn

from fingervision.domain.errors import DataError
from fingervision.storage.csv_columns import is_number

Path = tuple[str | int, ...]

_KEYS = frozenset({"value", "u"})
_BINARY: Mapping[type[ast.operator], Callable[[float, float], float]] = MappingProxyType(
    {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv}
)
_FUNCTIONS: Mapping[str, Callable[[float], float]] = MappingProxyType(
    {
        "sqrt": lambda value: value**0.5 if value >= 0.0 else _refuse(f"there is no sqrt of {value:g}"),
        "sin_deg": lambda angle: math.sin(math.radians(angle)),
        "cos_deg": lambda angle: math.cos(math.radians(angle)),
        "tan_deg": lambda angle: math.tan(math.radians(angle)),
    }
)
_REASONS: Mapping[type[Exception], str] = MappingProxyType(
    {
        SyntaxError: "it cannot be read as arithmetic",
        ZeroDivisionError: "it divides by zero",
        OverflowError: "its value is too large",
        RecursionError: "it has too many parts",
    }
)
"""Why an expression has no value, where Python's own words would say it in terms of a program."""
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
            why = next((words for kind, words in _REASONS.items() if isinstance(error, kind)), str(error))
            raise DataError(
                f"{what} must be a number or an arithmetic expression with names, but is {raw!r}: {why}."
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


def _refuse(words: str) -> NoReturn:
    raise ValueError(words)


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


def bare_tables(tables: Mapping[str, Any], origin: str) -> tuple[dict[str, Any], dict[str, float]]:
    """Separate the tables of a drawing from the uncertainties stated in them.

    Parameters
    ----------
    tables : mapping
        Tables of the drawing as read from TOML.
    origin : str
        Name of the file, for error messages.

    Returns
    -------
    tables : dict
        Copy of the tables in which a number with an uncertainty is replaced by the number alone.
    uncertainties : dict of str to float
        Positive standard uncertainties by dotted name, each in the unit of its number.

    Raises
    ------
    DataError
        An uncertainty is not a positive number, or belongs to a list.
    """
    bare = copy.deepcopy(dict(tables))
    uncertainties = {}
    for name, path, raw in list(_walk(bare)):
        if isinstance(raw, dict):
            u, value = raw["u"], raw["value"]
            if not is_number(u) or u < 0.0:
                raise DataError(
                    f"The uncertainty of {name} in {origin} must be a number that is not negative, but is {u!r}."
                )
            if isinstance(value, list | dict):
                raise DataError(
                    f"The uncertainty of {name} in {origin} can be given for a single number only, but the "
                    f"value is {value!r}."
                )
            _put(bare, path, value)
            if u > 0.0:
                uncertainties[name] = float(u)
    return bare, uncertainties


def changed_tables(
    tables: Mapping[str, Any], changes: Mapping[str, float], origin: str, *, absolute: bool = False
) -> dict[str, Any]:
    """Change some numbers of a drawing.

    Parameters
    ----------
    tables : mapping
        Tables of the drawing with plain numbers.
    changes : mapping of str to float
        Amount to add, or the new value (if `absolute`), by dotted name.
    origin : str
        Name of the file, for error messages.
    absolute : bool
        Whether the numbers are replaced instead of changed by an amount.

    Raises
    ------
    DataError
        A name does not denote a number of the drawing.
    """
    changed = copy.deepcopy(dict(tables))
    places = {name: (path, raw) for name, path, raw in _walk(changed)}
    for name, by in changes.items():
        if name not in places:
            raise DataError(
                f"There is no number called {name} in {origin}. Numbers in this file are, for example, "
                f"{', '.join(sorted(places)[:8])}."
            )
        path, raw = places[name]
        if absolute:
            _put(changed, path, by)
        else:
            _put(changed, path, f"({raw}) + ({by!r})" if isinstance(raw, str) else raw + by)
    return changed


def numbers_of(tables: Mapping[str, Any]) -> dict[str, float | str]:
    """Return every plain number or expression, by dotted name."""
    return {name: raw if isinstance(raw, str) else float(raw) for name, _, raw in _walk(tables)}


def _walk(tables: Mapping[str, Any]) -> Iterator[tuple[str, Path, Any]]:
    """Iterate over all numbers, expressions and uncertain numbers of a drawing: dotted name, key path and content."""
    yield from _walk_in(tables, "", ())


def _walk_in(node: Any, name: str, path: Path) -> Iterator[tuple[str, Path, Any]]:
    if isinstance(node, Mapping):
        if set(node) == _KEYS:
            yield name, path, node
            return
        for key, value in node.items():
            if key != "name":
                yield from _walk_in(value, f"{name}.{key}" if name else key, (*path, key))
    elif isinstance(node, list):
        for place, value in enumerate(node):
            own = str(value["name"]) if isinstance(value, Mapping) and "name" in value else str(place + 1)
            yield from _walk_in(value, f"{name}.{own}", (*path, place))
    elif is_number(node) or isinstance(node, str):
        yield name, path, node


def _put(tables: Any, path: Path, value: Any) -> None:
    for step in path[:-1]:
        tables = tables[step]
    tables[path[-1]] = value
