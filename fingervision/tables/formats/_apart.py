"""Reading of a file in a separate process: if a C library crashes on a damaged file, the user gets an error message.

For example, scipy 1.17 ends with a segmentation fault on some MATLAB files with a few wrong bytes
(tests/tables/test_bad_files.py).
"""

import importlib
import pickle
import subprocess
import sys
from pathlib import Path

from fingervision.domain.errors import DataError, FingervisionError
from fingervision.tables.mapping import Entry
from fingervision.tables.questions import OpenQuestionError
from fingervision.tables.raw_table import RawTable

PROGRAM = "import sys; sys.path[:] = {path!r}; from fingervision.tables.formats._apart import serve; serve()"
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
    # Only the result of this program's own reader is unpickled, from a private pipe; content of the file never is.
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(path=sys.path)],
        input=pickle.dumps((name, path, given)),
        capture_output=True,
        check=False,
    )
    if done.returncode != 0 or not done.stdout:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        why = f"signal {-done.returncode}" if done.returncode < 0 else (said[-1][:SHOWN] if said else "no answer")
        raise DataError(
            f"{path} is damaged: the library that reads files of this format crashed ({why}). Save the table again, "
            f"or as CSV."
        )
    kind, *answer = pickle.loads(done.stdout)
    if kind == "question":
        raise OpenQuestionError(*answer)
    if kind == "error":
        raise DataError(*answer)
    table: RawTable = answer[0]
    return table


def serve() -> None:
    """In the separate process: read one request from standard input and write the result to standard output."""
    name, path, given = pickle.load(sys.stdin.buffer)
    answer: tuple[object, ...]
    try:
        answer = ("table", read_guarded(name, path, given))
    except OpenQuestionError as error:
        answer = ("question", error.path, error.kind, error.questions)
    except FingervisionError as error:
        answer = ("error", str(error))
    sys.stdout.buffer.write(pickle.dumps(answer))
