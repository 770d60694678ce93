"""Refuse pipes and devices as documents: reading them would wait for a writer, or never end."""

import errno
from pathlib import Path

from fingervision.domain.errors import OutputError


def plain(path: Path) -> Path:
    """Return the path if it can be read to its end.

    Parameters
    ----------
    path : Path
        Of a document that shall be read.

    Returns
    -------
    Path
        The same; also where there is nothing, or a folder, which the system says when it is opened.

    Raises
    ------
    OSError
        The path is a pipe, a socket or a device.
    """
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise OSError(errno.ESPIPE, "it is a pipe or a device: save it as a file first", str(path))
    return path


def why(error: Exception) -> str:
    """Reason of a system error, without its number and path, for a sentence that names the file itself."""
    return (error.strerror or str(error)) if isinstance(error, OSError) else str(error)


def in_utf8(path: Path, text: str) -> str:
    """Return a document's text if it can be written in UTF-8; names of files need not be.

    Raises
    ------
    OutputError
        It holds a name that is not.
    """
    try:
        text.encode()
    except UnicodeEncodeError as error:
        line = next(each for each in text.splitlines() if error.object[error.start] in each)
        raise OutputError(
            f"{path.name} must be in UTF-8, but would name a file that is not ({line.strip()[:200]!a}): rename that "
            "file and run again."
        ) from error
    return text
