"""Provenance of a result: its input files with their hashes, the command, the versions, and the time."""

import hashlib
import platform
import shlex
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

AUTHORS, RELEASED = "The fingervision contributors", 2026
"""Authors and year of the release, as in CITATION.cff."""
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
        Input files of the result.
    command : str
        The command line.
    versions : mapping of str to str
        Versions of fingervision, Python and the numerical libraries.
    made_at : str
        Time of creation in ISO 8601 format, UTC.
    """

    files: tuple[SourceFile, ...]
    command: str
    versions: Mapping[str, str]
    made_at: str

    @property
    def citation(self) -> str:
        """Reference to the software, as CITATION.cff has it."""
        return (
            f"{AUTHORS} ({RELEASED}). fingervision, version {self.versions.get('fingervision', 'unknown')}. Software."
        )

    def document(self) -> dict[str, object]:
        """Return the provenance as a mapping for JSON."""
        return asdict(self)


def provenance(files: Mapping[str, Path], command: str | None = None) -> Provenance:
    """Collect the provenance of a result.

    Parameters
    ----------
    files : mapping of str to Path
        Paths by role; paths that are not files are omitted.
    command : str or None
        The command line; None for that of the running command.
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
