"""Reader of a table of a TOML file key by key; error messages state file, line and key."""

import difflib
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from fingervision.domain.errors import DataError, InputFileError
from fingervision.storage.number_columns import is_number
from fingervision.storage.plain_file import NotUtf8Error, parsed, text_of


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
    """Line number, from 1, of the nth `[header]` or `[[header]]` of a file, or of a key below it.

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
    """

    path: Path
    text: str
    header: str
    values: Mapping[str, Any]
    place: int = 0

    def at(self, key: str | None = None) -> str:
        """Location of a key: `line 12 of recipe.toml`."""
        return f"line {line_of(self.text, self.header, self.place, key)} of {self.path}"

    def refuse(self, key: str | None, words: str) -> NoReturn:
        """Raise an error that begins with the key and states its location."""
        if key is None and not self.header:
            raise DataError(f"{self.path} {words}")
        name = key if key is not None else f"[{self.header}]"
        raise DataError(f"{name} in {self.at(key)} {words}")

    def only(self, keys: Iterable[str]) -> None:
        """Refuse unknown keys, naming the nearest known one."""
        known = list(keys)
        for key in self.values:
            if key not in known:
                near = difflib.get_close_matches(key, known, n=1)
                hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(known)}."
                self.refuse(key, f"is not known: {hint}")

    def number(
        self, key: str, default: float | None = None, *, low: float = -float("inf"), high: float = float("inf"),
        above: float | None = None,
    ) -> float:  # fmt: skip
        """Read a finite number between limits (`above`: greater than); without a default the key is required."""
        value = self.values.get(key, default)
        if value is None:
            self.refuse(None, f"must state {key}, but does not: add it.")
        if not is_number(value):
            self.refuse(key, f"must be a number, but is {value!r}.")
        if above is not None and not value > above:
            self.refuse(key, f"must be greater than {above:g}, but is {value:g}.")
        if not low <= value <= high:
            limits = f"between {low:g} and {high:g}" if high < float("inf") else f"at least {low:g}"
            if low == -float("inf"):
                limits = f"at most {high:g}"
            self.refuse(key, f"must be {limits}, but is {value:g}.")
        return float(value)

    def whole(self, key: str, default: int | None = None, *, low: int, high: int = 1_000_000) -> int:
        """Read a whole number between limits."""
        value = self.number(key, default, low=low, high=high)
        if value != int(value):
            self.refuse(key, f"must be a whole number, but is {value:g}.")
        return int(value)

    def word(self, key: str, default: str | None = None, *, of: Iterable[str] | None = None) -> str:
        """Read a text; if `of` is given, the text must be one of these words."""
        value = self.values.get(key, default)
        if value is None:
            self.refuse(None, f"must state {key}, but does not: add it.")
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
        return Section(self.path, self.text, f"{self.header}.{key}" if self.header else key, value)

    def tables(self, key: str) -> tuple["Section", ...]:
        """Read the sub-tables `[[key]]`, in order."""
        value = self.values.get(key, [])
        if not isinstance(value, list) or not all(isinstance(each, dict) for each in value):
            self.refuse(key, f"must be tables [[{key}]], but is {value!r}.")
        header = f"{self.header}.{key}" if self.header else key
        return tuple(Section(self.path, self.text, header, each, place) for place, each in enumerate(value))
