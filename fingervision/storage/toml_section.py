"""Reader of the tables of TOML and JSON documents, by key or by declared record; errors state file, line and key."""

import difflib
import re
import tomllib
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, is_dataclass, replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar, get_args, get_origin

from fingervision.domain.errors import DataError, InputFileError
from fingervision.domain.field import Declared, Field, declared
from fingervision.storage.csv_columns import is_number
from fingervision.storage.drawing_numbers import number
from fingervision.storage.plain_file import NotUtf8Error, parsed, text_of

# Table or key that only this kind of file has, whether it is a list of tables, and the option that takes the file.
_PURPOSES = {
    "the description of a bed": (("actuator", dict), "the option --bed takes it"),
    "a gauge file": (("gauge", list), "the option --gauges of measure and live takes it"),
    "the drawing of a mechanism": (("body", list), "the options --mechanism of measure and --model take it"),
    "the drawing of a gripper": (("lever", dict), "the options --mechanism of measure and --model take it"),
    "a mechanism after a gripper": (("gripper", dict), "the options --mechanism of measure and --model take it"),
    "a recipe": (("step", list), "the command bed run takes it"),
    "a corrected model": (("base", str), "the option --model of compare and diagnose takes it"),
}
DRAWINGS = ("the drawing of a mechanism", "the drawing of a gripper", "a mechanism after a gripper")


def refuse_other_file(path: Path | str, tables: Mapping[str, Any], need: str, wanted: Collection[str]) -> None:
    """Refuse a TOML file of another purpose; the message names the option or command that takes the file.

    Parameters
    ----------
    path : Path or str
        The file, for the message.
    tables : mapping
        Its tables.
    need : str
        What the file must be, for the message.
    wanted : collection of str
        Accepted kinds of file, in the words of this module.

    Raises
    ------
    DataError
        The tables belong to another kind of file.
    """
    for what, ((key, kind), takes) in _PURPOSES.items():
        if isinstance(tables.get(key), kind):
            if what not in wanted:
                raise DataError(f"{path} must be {need}, but is {what}: {takes}.")
            return


if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Record = TypeVar("Record")


def read_document(path: Path, what: str) -> tuple[dict[str, Any], str]:
    """Read a TOML file.

    Parameters
    ----------
    path : Path
        The file.
    what : str
        Kind of file for error messages, such as `recipe` or `bed`.

    Returns
    -------
    dict, str
        Tables of the file, and its text (for line numbers).

    Raises
    ------
    DataError, InputFileError
        The file does not exist, or is not TOML.
    """
    try:
        text = text_of(path)
        return parsed(tomllib.loads, text), text
    except FileNotFoundError:
        raise InputFileError(f"There is no {what} {path}.") from None
    except OSError as error:
        raise InputFileError(f"The {what} {path} could not be read ({error.strerror}).") from error
    except NotUtf8Error as error:
        raise DataError(f"{path} must be TOML in UTF-8, but is not: {error}.") from error
    except ValueError as error:  # also numbers of thousands of digits
        raise DataError(f"{path} must be TOML, but is not: {error}.") from error


def line_of(text: str, header: str, place: int = 0, key: str | None = None) -> int:
    """Line number, from 1, of the nth `[header]` or `[[header]]` of a file, or of a key or table below it.

    The library tomllib reports no line numbers, so that the text is searched for headers in their usual spelling; 1 is
    returned if the header is not found.
    """
    lines = text.splitlines()
    pattern = re.compile(rf"^\s*\[\[?\s*{re.escape(header)}\s*\]\]?")
    found = [number for number, line in enumerate(lines) if pattern.match(line)]
    if header and place >= len(found):
        return 1
    begin = found[place] + 1 if header else 0
    if key is not None:
        of_key = re.compile(rf'^\s*"?{re.escape(key)}"?\s*[.=]')
        for number in range(begin, len(lines)):
            if lines[number].lstrip().startswith("["):
                break
            if of_key.match(lines[number]):
                return number + 1
        of_table = re.compile(rf"^\s*\[\[?\s*{re.escape(f'{header}.{key}' if header else key)}\s*[\].]")
        begin = next((number for number in range(begin, len(lines)) if of_table.match(lines[number])), begin - 1) + 1
    return max(begin, 1)


@dataclass(frozen=True, slots=True)
class Section:
    """One table of a TOML file, whose values are read and checked.

    Parameters
    ----------
    path : Path
        The file.
    text : str
        Text of the file.
    header : str
        Name of the table as in its header; empty for the top of the file.
    values : mapping
        Values of the table by key.
    place : int
        Index, from 0, of the table among those with the same header.
    uncertainties : dict of str to float, or None
        Where not None, a number may be written `{ value = 1.0, u = 0.1 }`; its standard uncertainty is put here, by
        its dotted name.
    is_open : bool
        Whether other programs may add keys, which are then ignored.
    names : mapping of str to float, or None
        Where not None, a number may be an arithmetic expression of these names.
    """

    path: Path
    text: str
    header: str
    values: Mapping[str, Any]
    place: int = 0
    uncertainties: dict[str, float] | None = None
    is_open: bool = False
    names: Mapping[str, float] | None = None

    def at(self, key: str | None = None) -> str:
        """Location of a key: `line 12 of recipe.toml`; the file alone if its text is not known."""
        if not self.text:
            return str(self.path)
        return f"line {line_of(self.text, self.header, self.place, key)} of {self.path}"

    def dotted(self, key: str) -> str:
        """Name of a key with that of its table."""
        return f"{self.header}.{key}" if self.header else key

    def refuse(self, key: str | None, words: str) -> NoReturn:
        """Raise an error that begins with the key and states its location."""
        if key is None and not self.header:
            raise DataError(f"{self.path} {words}")
        name = f"[{self.header}]" if key is None else key if self.text else self.dotted(key)
        raise DataError(f"{name} in {self.at(key)} {words}")

    def only(self, keys: Iterable[str]) -> None:
        """Refuse unknown keys, naming the nearest known one."""
        known = list(keys)
        for key in self.values:
            if key not in known:
                near = difflib.get_close_matches(key, known, n=1)
                hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(known)}."
                self.refuse(key, f"is not known: {hint}")

    def schema(self, newest: int, default: int | None = None) -> None:
        """Refuse a file whose schema number is higher than the newest that this program reads."""
        if (stated := self.whole("schema", default, low=1)) > newest:
            self.refuse("schema", f"must be at most {newest}, but is {stated}: use a newer fingervision.")

    def number(
        self, key: str, default: float | None = None, *, low: float = -float("inf"), high: float = float("inf"),
        above: float | None = None,
    ) -> float:  # fmt: skip
        """Read a finite number between limits (`above`: greater than); without a default the key is required."""
        limits = Field(low=low, high=high, above=-float("inf") if above is None else above)
        return self._number(key, self._stated(key, default), limits)

    def _stated(self, key: str, default: Any = None) -> Any:
        value = self.values.get(key, default)
        if value is None:
            near = difflib.get_close_matches(key, self.values, n=1)
            self.refuse(None, f"must state {key}, but {f'states {near[0]}: rename' if near else 'does not: add'} it.")
        return value

    def _number(self, key: str, value: Any, field: Field) -> float:
        if self.names is not None:
            value = number(value, self.names, f"{self.dotted(key)} in {self.path}")
        elif not is_number(value):
            self.refuse(key, f"must be a number, but is {value!r}.")
        if (words := field.refusal(value)) is not None:
            self.refuse(key, f"{words}.")
        return float(value)

    def whole(self, key: str, default: int | None = None, *, low: int, high: int = 1_000_000) -> int:
        """Read a whole number between limits."""
        value = self.number(key, default, low=low, high=high)
        if value != int(value):
            self.refuse(key, f"must be a whole number, but is {value:g}.")
        return int(value)

    def word(self, key: str, default: str | None = None, *, of: Iterable[str] | None = None) -> str:
        """Read a text; if `of` is given, the text must be one of these words."""
        value = self._stated(key, default)
        if not isinstance(value, str):
            self.refuse(key, f"must be a text, but is {value!r}.")
        if of is not None and value not in (known := list(of)):
            near = difflib.get_close_matches(value, known, n=1)
            hint = f": did you mean {near[0]}?" if near else "."
            self.refuse(key, f"must be one of {', '.join(known)}, but is {value!r}{hint}")
        return value

    def flag(self, key: str, default: bool = False) -> bool:
        """Read true or false."""
        value = self.values.get(key, default)
        if not isinstance(value, bool):
            self.refuse(key, f"must be true or false, but is {value!r}.")
        return value

    def table(self, key: str) -> "Section":
        """Read a sub-table of this table; empty if missing."""
        value = self.values.get(key, {})
        if not isinstance(value, dict):
            self.refuse(key, f"must be a table [{key}], but is {value!r}.")
        return self._inner(key, value, self.place)

    def _inner(self, key: str, values: Mapping[str, Any], place: int) -> "Section":
        return replace(self, header=self.dotted(key), values=values, place=place)

    def tables(self, key: str) -> tuple["Section", ...]:
        """Read the sub-tables `[[key]]`, in order."""
        value = self.values.get(key, [])
        if not isinstance(value, list) or not all(isinstance(each, dict) for each in value):
            self.refuse(key, f"must be tables [[{key}]], but is {value!r}.")
        # Without a text, whose lines tell them apart, tables are told by their names or numbers.
        is_named = not self.text and len(value) > 1
        return tuple(
            self._inner(f"{key} {each.get('name', place + 1)}" if is_named else key, each, place)
            for place, each in enumerate(value)
        )

    def record(self, kind: type[Record]) -> Record:
        """Read the table as a record (a dataclass) whose declared fields are its keys; nested records are sub-tables.

        Raises
        ------
        DataError
            A key is unknown or missing, or its value is not one of the declared kind and limits.
        """
        fields = declared(kind)
        if not self.is_open:
            self.only([each.name for each in fields])
        given = [each for each in fields if self.values.get(each.name) is not None or each.is_required]
        return kind(**{each.name: self._value(each) for each in given})

    def _value(self, each: Declared) -> Any:
        key, kind, field = each.name, each.kind, each.field
        # The type checker takes a type that `is_dataclass` accepted for a record or its type.
        inner: Any = next(iter(get_args(kind)), None)
        nested: Any = kind if is_dataclass(kind) else inner
        if is_dataclass(kind):
            if key not in self.values and not each.is_optional:
                self.refuse(None, f"must have a section [{self.dotted(key)}], but has none.")
            return self.table(key).record(nested)
        if get_origin(kind) is tuple and is_dataclass(inner):
            sections = self.tables(key)
            if each.is_required and not sections:
                self.refuse(None, f"must have at least one [[{key}]], but has none: add one.")
            return tuple(section.record(nested) for section in sections)
        if field.shape:
            return self.array(key, field.shape)
        if get_origin(kind) is tuple:
            return self._tuple(key, self._stated(key), kind, field)
        if kind is bool:
            return self.flag(key)
        if isinstance(kind, type) and issubclass(kind, Enum):
            return kind(self.word(key, of=[one.value for one in kind]))
        if kind is str:
            return self.word(key, of=field.of or None)
        value = self._stated(key)
        if isinstance(value, dict) and self.uncertainties is not None:
            value, u = self.uncertain(key, field, needs_u=True)
            if u is not None:
                self.uncertainties[self.dotted(key)] = u
        return self._one(key, value, kind, field)

    def array(self, key: str, shape: tuple[int, ...]) -> "NDArray[np.float64]":
        """Read finite numbers in nested lists; -1 stands for any number of them along a dimension."""
        import numpy as np

        value = self._stated(key)
        try:
            array = np.array(value, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            array = np.full((), np.nan)
        sizes = zip(shape, array.shape, strict=False)
        is_shaped = array.ndim == len(shape) and all(size in (-1, found) for size, found in sizes)
        if not is_shaped or not np.all(np.isfinite(array)):
            words = " by ".join("any number of" if size < 0 else str(size) for size in shape)
            self.refuse(key, f"must be {words} numbers, but is {value!r}.")
        return array

    def uncertain(self, key: str, field: Field, *, needs_u: bool = False) -> tuple[float, float | None]:
        """Read a number, or `{ value, u }`: the number, and its standard uncertainty or None if it is not stated."""
        value, u = self._stated(key), None
        if isinstance(value, dict):
            if set(value) not in ({"value", "u"}, {"value"})[: 1 if needs_u else 2]:
                self.refuse(key, f"must be a number or {{value = ..., u = ...}}, but has the keys {', '.join(value)}.")
            u = self._number(f"{key}.u", value["u"], Field(low=0.0)) if "u" in value else None
            value = value["value"]
        return self._number(key, value, field), u

    def _tuple(self, key: str, value: Any, kind: Any, field: Field) -> tuple[Any, ...]:
        """Read a list: numbers, or points of numbers (`tuple[Point, ...]`)."""
        inner = get_args(kind)
        if Ellipsis in inner:
            if not isinstance(value, list):
                self.refuse(key, f"must be a list, but is {value!r}.")
            if get_origin(inner[0]) is tuple:
                return tuple(self._tuple(key, each, inner[0], field) for each in value)
            inner = (inner[0],) * len(value)
        if isinstance(value, dict) and self.uncertainties is not None:
            self.refuse(key, "is a list and can have no uncertainty: state it at a single number.")
        if not isinstance(value, list) or len(value) != len(inner):
            self.refuse(
                key, f"must be a list of {len(inner)} {'words' if str in inner else 'numbers'}, but is {value!r}."
            )
        return tuple(self._one(key, each, one, field) for one, each in zip(inner, value, strict=True))

    def _one(self, key: str, value: Any, kind: Any, field: Field) -> Any:
        """Read a number of a kind, or a word of a list."""
        if kind is str:
            return replace(self, values={key: value}).word(key)
        found = self._number(key, value, field)
        if kind is int and found != int(found):
            self.refuse(key, f"must be a whole number, but is {value:g}.")
        return kind(found)


def read_section(
    path: Path, what: str, keys: Iterable[str] = (), newest: int | None = None, stated: int | None = None
) -> Section:
    """Read a TOML file as a section, with the keys and the schema number that it may have.

    Parameters
    ----------
    path : Path
        The file.
    what : str
        Kind of file for error messages, such as `recipe`.
    keys : iterable of str
        Keys beside `schema`.
    newest : int, optional
        Newest schema number that this program reads; None leaves keys and number to the caller.
    stated : int, optional
        Number of a file that states none; by default, a file must state it.

    Raises
    ------
    DataError, InputFileError
        The file does not exist, is not TOML, is newer, or has an unknown key.
    """
    values, text = read_document(path, what)
    top = Section(path, text, "", values)
    if newest is not None:
        top.only(("schema", *keys))
        top.schema(newest, stated)
    return top
