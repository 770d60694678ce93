"""Numbers in the tables of a drawing, addressed by dotted names: read their uncertainties, and change numbers.

A number may be written `{ value = 1.0, u = 0.1 }`, with its standard uncertainty, wherever a number or an expression is
allowed. Repeated sections are addressed by their name, or by their position from 1: `flexure.left.thickness_mm`,
`body.2.width_mm`.
"""

import copy
from collections.abc import Iterator, Mapping
from typing import Any

from fingervision.domain.errors import DataError
from fingervision.storage.number_columns import is_number

Path = tuple[str | int, ...]

_KEYS = frozenset({"value", "u"})


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
