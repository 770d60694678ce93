"""Arithmetic expressions in drawings: numbers that are computed from named lengths."""

import ast
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
