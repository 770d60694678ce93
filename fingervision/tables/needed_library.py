"""Import libraries of the extra `formats` when a file needs them, with an error message if they are missing."""

import importlib
from pathlib import Path
from typing import Any

from fingervision.domain.errors import MissingLibraryError


def needed_library(name: str, path: Path, what: str) -> Any:
    """Import a library that a file format needs.

    Parameters
    ----------
    name : str
        Name of the module to import.
    path : Path
        File that needs the library.
    what : str
        Kind of the file, for the error message.

    Raises
    ------
    MissingLibraryError
        The library is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        who = f"{path} is {what}, which"
        raise MissingLibraryError(name.split(".")[0], "formats", who, "save the table as CSV") from error
