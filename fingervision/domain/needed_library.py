"""Import libraries of an extra when they are needed, with an error message if they are missing."""

import importlib
from typing import Any

from fingervision.domain.errors import MissingLibraryError


def needed_library(name: str, extra: str, what: str, instead: str = "") -> Any:
    """Import a library that only a part of fingervision needs.

    Parameters
    ----------
    name : str
        Name of the module to import.
    extra : str
        The extra of this project that installs it.
    what : str
        The part that needs the library, for the error message: it is followed by "needs".
    instead : str
        What to do without the library; empty if there is no alternative.

    Raises
    ------
    MissingLibraryError
        The library is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise MissingLibraryError(name.split(".")[0], extra, what, instead) from error
