"""File formats of tables, one module per format, with functions to recognise a file and to read its raw table."""

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

from fingervision.domain.errors import DataError, InputFileError
from fingervision.tables.formats._apart import read_apart, read_guarded
from fingervision.tables.mapping import Entry
from fingervision.tables.raw_table import RawTable, check_columns

HEAD_BYTES = 1024


@dataclass(frozen=True, slots=True)
class Format:
    """A file format of tables.

    Parameters
    ----------
    name : str
        Name of the format's module.
    order : int
        Position in the order in which formats are tried; the format that accepts any file comes last.
    recognises : callable
        Function that decides from path and first bytes whether a file has this format.
    read : callable
        Function that reads the file, using the decisions of the user.
    """

    name: str
    order: int
    recognises: Callable[[Path, bytes], bool]
    read: Callable[[Path, Entry], RawTable]


@cache
def formats() -> tuple[Format, ...]:
    """List all formats: every module of this package with `ORDER`, `recognises` and `read`.

    A module with `IN_OWN_PROCESS` uses libraries that may crash, and therefore runs in a separate process.
    """
    found = []
    for module in pkgutil.iter_modules(__path__):
        if not module.name.startswith("_"):
            loaded = importlib.import_module(f"{__name__}.{module.name}")
            apart = getattr(loaded, "IN_OWN_PROCESS", False)
            read = partial(read_apart if apart else read_guarded, loaded.__name__)
            found.append(Format(module.name, loaded.ORDER, loaded.recognises, read))
    return tuple(sorted(found, key=lambda each: each.order))


def read_raw(path: Path, given: Entry) -> RawTable:
    """Read a table of any format, without interpreting its columns.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read, or contains no table.
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
    found = next(each for each in formats() if each.recognises(path, head)).read(path, given)
    check_columns(path, len(found.columns))
    return found
