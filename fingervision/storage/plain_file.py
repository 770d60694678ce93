"""Refuse pipes and devices as input files, because reading them could wait for ever or never end."""

import errno
from pathlib import Path

from fingervision.domain.errors import OutputError


def plain(path: Path) -> Path:
    """Return a path if it is a file that can be read to its end; refuse pipes and devices.

    Parameters
    ----------
    path : Path
        Path of a file that is to be read.

    Returns
    -------
    Path
        The same path; also for a missing file or a folder, which cause an error when they are opened.

    Raises
    ------
    OSError
        The path is a pipe, a socket or a device.
    """
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise OSError(errno.ESPIPE, "it is a pipe or a device: save it as a file first", str(path))
    return path


def why(error: Exception) -> str:
    """Reason stated by a system error, without error number and path, for a message that names the file separately."""
    return (error.strerror or str(error)) if isinstance(error, OSError) else str(error)


def in_utf8(path: Path, text: str) -> str:
    """Return a text unchanged if UTF-8 can encode it; file names may contain characters that UTF-8 cannot encode.

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
