"""One program a folder: a lock that the system lets go of when the program ends, however it does."""

import os
from pathlib import Path
from typing import Any

from fingervision.domain.errors import FingervisionError

LOCK = ".lock"
fcntl: Any
try:
    import fcntl
except ImportError:  # not on Windows, where an open file is locked as it is
    fcntl = None


class FolderLock:
    """Holds a folder.

    Parameters
    ----------
    path : Path
        The folder.

    Raises
    ------
    FingervisionError
        Another program holds it, or it cannot be written.
    """

    def __init__(self, path: Path) -> None:
        try:
            self._file = os.open(path / LOCK, os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as error:
            raise FingervisionError(
                f"The folder {path} cannot be written ({error.strerror}): name another with --out."
            ) from error
        try:
            if fcntl is not None:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._file)
            raise FingervisionError(
                f"The folder {path} is in use by another run: wait for its end, or name another with --out."
            ) from None

    def release(self) -> None:
        """Let go of it."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1
