"""Lock that reserves a folder for one program; the operating system releases it when the program ends in any way."""

import os
from contextlib import suppress
from pathlib import Path
from typing import Any

from fingervision.domain.errors import OutputError

LOCK = ".lock"
fcntl: Any
try:
    import fcntl
except ImportError:  # not on Windows, where an open file is always locked
    fcntl = None


class FolderLock:
    """Exclusive lock of a folder.

    Parameters
    ----------
    path : Path
        The folder to lock.

    Raises
    ------
    FingervisionError
        Another program uses the folder, or the folder cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._path = path / LOCK
        while True:
            try:
                self._file = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o644)
            except OSError as error:
                raise OutputError(
                    f"The folder {path} cannot be written ({error.strerror}): name another folder with --out."
                ) from error
            try:
                if fcntl is not None:
                    fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                os.close(self._file)
                raise OutputError(
                    f"The folder {path} is in use by another run: wait for its end, or name another folder with --out."
                ) from None
            if self._is_there():
                return
            os.close(self._file)  # its holder removed it between opening and locking

    def _is_there(self) -> bool:
        try:
            return os.path.samestat(os.fstat(self._file), self._path.stat())
        except OSError:
            return False

    def remove(self) -> None:
        """Release the lock, and delete the lock file."""
        if self._file >= 0:
            with suppress(OSError):
                self._path.unlink()
        self.release()

    def release(self) -> None:
        """Release the lock."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1
