"""Reading of a file in a separate process: if a C library crashes on a damaged file, the user gets an error message.

For example, scipy 1.17 ends with a segmentation fault on some MATLAB files with a few wrong bytes
(tests/tables/test_bad_files.py).
"""

import importlib
from pathlib import Path
from subprocess import CalledProcessError

from fingervision.domain.errors import DataError, FingervisionError
from fingervision.domain.own_process import called_apart
from fingervision.tables.mapping import Entry
from fingervision.tables.raw_table import RawTable

SHOWN = 300
"""Number of characters of the output of a failed process that the error message shows."""


def read_guarded(name: str, path: Path, given: Entry) -> RawTable:
    """Read a file with the format's module; whatever its libraries raise becomes one sentence.

    Raises
    ------
    DataError
        The file cannot be read.
    OpenQuestionError
        The table can be interpreted in more than one way.
    """
    try:
        table: RawTable = importlib.import_module(name).read(path, given)
    except FingervisionError:
        raise
    except Exception as error:
        raise DataError(
            f"{path} could not be read as a table of the format {name.rpartition('.')[2]} ({type(error).__name__}: "
            f"{error}): save it again, or the table as CSV."
        ) from error
    return table


def read_apart(name: str, path: Path, given: Entry) -> RawTable:
    """Read a file with the format's module in a separate process.

    Parameters
    ----------
    name : str
        Full name of the format's module.
    path : Path
        The file.
    given : Entry
        Decisions of the user.

    Raises
    ------
    DataError
        The file cannot be read, or its reader crashed.
    OpenQuestionError
        The table can be interpreted in more than one way.
    """
    try:
        found = called_apart(_tried, name, path, given)
    except CalledProcessError as error:
        said = error.stderr.decode(errors="replace").strip().splitlines() or ["no answer"]
        why = f"signal {-error.returncode}" if error.returncode < 0 else said[-1][:SHOWN]
        raise DataError(
            f"{path} is damaged: the library that reads files of this format crashed ({why}). Save the table again, "
            f"or as CSV."
        ) from error
    if isinstance(found, FingervisionError):
        raise found
    return found


def _tried(name: str, path: Path, given: Entry) -> RawTable | FingervisionError:
    """Read a file; an error is a result, too, and so comes back from the separate process."""
    try:
        return read_guarded(name, path, given)
    except FingervisionError as error:
        return error
