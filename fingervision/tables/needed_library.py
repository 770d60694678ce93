"""Libraries of the extra `formats`: imported when a file needs them, with an error message where they are missing."""

import importlib
from pathlib import Path
from typing import Any

from fingervision.domain.errors import MissingLibraryError


def needed_library(name: str, path: Path, what: str) -> Any:
    """Import a library that a format needs.

    Parameters
    ----------
    name : str
        Module to import.
    path : Path
        File that needs it.
    what : str
        What the file is.

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
