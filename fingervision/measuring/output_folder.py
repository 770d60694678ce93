"""The folder for results: it is created if needed, and files of other programs in it are never overwritten."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from fingervision.domain.errors import OutputError, UsageError
from fingervision.storage.gaps_csv import COLUMNS
from fingervision.storage.out_folder import FolderLock, make_out_folder, out_folder
from fingervision.storage.summary_json import recording_of

GAPS, SUMMARY, FIGURE, OVERLAY, STEPS = "gaps.csv", "summary.json", "gap.png", "overlay.mp4", "steps"
GAUGES = "gauges.csv"


@dataclass(frozen=True, slots=True)
class OutputFolder:
    """Paths of the files that one measurement writes."""

    path: Path

    @property
    def gaps(self) -> Path:
        """Path of the table of gaps, gaps.csv."""
        return self.path / GAPS

    @property
    def gauges(self) -> Path:
        """Path of the table of the gauges."""
        return self.path / GAUGES

    @property
    def summary(self) -> Path:
        """Path of summary.json."""
        return self.path / SUMMARY

    @property
    def figure(self) -> Path:
        """Path of the figure of the gap over time."""
        return self.path / FIGURE

    @property
    def overlay(self) -> Path:
        """Path of the overlay video."""
        return self.path / OVERLAY

    @property
    def steps(self) -> Path:
        """Folder of the pictures of every step."""
        return self.path / STEPS


def claimed(path: Path, recording_files: tuple[Path, ...]) -> OutputFolder:
    """Create the folder for results, or take over that of an earlier measurement and remove its files.

    Parameters
    ----------
    path : Path
        The folder.
    recording_files : tuple of Path
        Files of the recording; none of them may be overwritten, and results may not lie among a recording's images.

    Raises
    ------
    OutputError
        The folder cannot be made or written, or holds files of these names that no measurement wrote.
    UsageError
        The folder is where the recording's images are, or the recording would be replaced.
    """
    names = (GAPS, GAUGES, SUMMARY, FIGURE, OVERLAY, STEPS)
    for file in recording_files:
        same = file.resolve().parent == path.resolve()
        if same and (len(recording_files) > 1 or file.name in names):
            raise UsageError(f"--out must not be the folder of the recording, but {path} is: name another folder.")
    with out_folder(path):
        present = [name for name in names if (path / name).exists()]
        if present and not _is_ours(path / GAPS):
            raise OutputError(
                f"{path} already contains {present[0]}, which was not written by an earlier measurement of "
                "fingervision: name another folder with --out."
            )
        for name in present:
            if name == STEPS:
                shutil.rmtree(path / name)
            else:
                (path / name).unlink()
        trial = path / ".fingervision.part"
        trial.touch()
        trial.unlink()
    return OutputFolder(path)


def _is_ours(table: Path) -> bool:
    """Whether a table starts with the header that only this program writes."""
    if not table.is_file():
        return False
    with table.open("rb") as file:
        return file.read(len(COLUMNS)) == COLUMNS.encode()


@contextmanager
def held(out: Path) -> Iterator[None]:
    """Lock the folder while a measurement runs, because two measurements would overwrite each other's files."""
    make_out_folder(out)
    lock = FolderLock(out)
    try:
        yield
    finally:
        lock.remove()


def usual_folder(recording: str) -> Path:
    """Return measured/NAME, with NAME from the file or folder (for a glob, its folder), made unique by its path."""
    path = Path(recording)
    named = path.resolve() if path.exists() else path.parent.resolve()
    parts = [part for part in named.parts if part != named.anchor] or ["images"]
    for depth in range(1, len(parts) + 1):
        out = Path("measured") / "__".join(parts[-depth:])
        of = recording_of(out)
        if of is None or Path(of).resolve() == path.resolve():
            return out
    return out
