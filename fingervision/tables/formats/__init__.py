"""File formats of tables, one per file: each recognises its files by their first bytes and reads them raw."""

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

from fingervision.domain.errors import DataError, InputFileError
from fingervision.tables.formats._apart import read_apart
from fingervision.tables.mapping import Entry
from fingervision.tables.raw_table import RawTable

HEAD_BYTES = 1024


@dataclass(frozen=True, slots=True)
class Format:
    """A format.

    Parameters
    ----------
    name : str
        Of its module.
    order : int
        Formats are asked in this order; what any file may be comes last.
    recognises : callable
        Whether a file is of the format, from its path and first bytes.
    read : callable
        Reads the file, with what the user states of it.
    """

    name: str
    order: int
    recognises: Callable[[Path, bytes], bool]
    read: Callable[[Path, Entry], RawTable]


@cache
def formats() -> tuple[Format, ...]:
    """All formats: every module of this package with `ORDER`, `recognises` and `read`.

    One with `IN_OWN_PROCESS` uses libraries that may crash, and is therefore run in a process of its own.
    """
    found = []
    for module in pkgutil.iter_modules(__path__):
        if not module.name.startswith("_"):
            loaded = importlib.import_module(f"{__name__}.{module.name}")
            apart = getattr(loaded, "IN_OWN_PROCESS", False)
            read = partial(read_apart, loaded.__name__) if apart else loaded.read
            found.append(Format(module.name, loaded.ORDER, loaded.recognises, read))
    return tuple(sorted(found, key=lambda each: each.order))


def read_raw(path: Path, given: Entry) -> RawTable:
    """Read a table of any format, without interpreting its columns.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read, or holds no table.
    """
    if path.exists() and not path.is_file():
        raise DataError(f"{path} must be a table in a file, but is a folder or a pipe: save it as a file first.")
    try:
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES)
    except FileNotFoundError:
        raise InputFileError(f"There is no table {path}.") from None
    except OSError as error:
        raise InputFileError(f"The table {path} could not be read ({error.strerror}).") from error
    if not head.strip(b"\x00 \t\r\n"):
        raise DataError(f"{path} must be a table, but is {'blank' if head else 'empty'}: export it again.")
    return next(each for each in formats() if each.recognises(path, head)).read(path, given)
