"""Refuse pipes and devices as documents: reading them would wait for a writer, or never end."""

import errno
from pathlib import Path


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
