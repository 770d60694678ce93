"""Token in the address of the browser page, stored in the output folder for reconnecting after a restart."""

import os
import re
import secrets
from contextlib import suppress
from pathlib import Path

from fingervision.storage.out_folder import out_folder

FILE, VIEWER_FILE = ".live_token", ".live_viewer_token"
BYTES = 18


def kept_token(out: Path, file_name: str = FILE) -> str:
    """Read the token from a folder, or create a token file that only this user can read.

    Parameters
    ----------
    out : Path
        The folder.
    file_name : str
        `FILE` for users who control the live view, `VIEWER_FILE` for users who only watch.

    Raises
    ------
    OutputError
        The folder cannot be written.
    """
    path = out / file_name
    with out_folder(out):
        with suppress(FileNotFoundError, UnicodeDecodeError):
            found = path.read_text(encoding="ascii").strip()
            if re.fullmatch(r"[A-Za-z0-9_-]{24,}", found) and path.stat().st_mode & 0o077 == 0:
                return found
        path.unlink(missing_ok=True)
        token = secrets.token_urlsafe(BYTES)
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="ascii") as file:
            file.write(token + "\n")
    return token
