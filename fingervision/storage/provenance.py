"""Origin of a result: its files with their hashes, the command, the versions, the time."""

import hashlib
import platform
import shlex
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

LIBRARIES = ("numpy", "scipy", "opencv-python-headless", "av")


@dataclass(frozen=True, slots=True)
class SourceFile:
    """A file from which a result was made: its role, name, size and SHA-256."""

    role: str
    name: str
    size_bytes: int
    sha256: str


@dataclass(frozen=True, slots=True)
class Provenance:
    """Files, command, versions and time of a result.

    Parameters
    ----------
    files : tuple of SourceFile
        What went in.
    command : str
        As it was called.
    versions : mapping of str to str
        Of fingervision, Python and the libraries that compute.
    made_at : str
        ISO 8601, UTC.
    """

    files: tuple[SourceFile, ...]
    command: str
    versions: Mapping[str, str]
    made_at: str

    def document(self) -> dict[str, object]:
        """The origin as a document for programs."""
        return asdict(self)


def provenance(files: Mapping[str, Path], command: str | None = None) -> Provenance:
    """Collect the origin of a result.

    Parameters
    ----------
    files : mapping of str to Path
        By what they are used as; those that are no files are left out.
    command : str or None
        As it was called; None for the command that is running.
    """
    read = tuple(
        SourceFile(role, path.name, path.stat().st_size, _sha256(path))
        for role, path in files.items()
        if path.is_file()
    )
    command = shlex.join(["fingervision", *sys.argv[1:]]) if command is None else command
    versions = {"Python": platform.python_version()}
    for name in ("fingervision", *LIBRARIES):
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            continue
    return Provenance(read, command, versions, datetime.now(UTC).isoformat(timespec="seconds"))


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
