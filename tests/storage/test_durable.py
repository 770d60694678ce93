"""What a power failure must not take is flushed to the disk: before it replaces a file, and while a file grows."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.frame import Frame
from fingervision.domain.status import Status
from fingervision.storage.calibration_json import read_calibration, write_calibration
from fingervision.storage.durable import replaced
from fingervision.storage.gaps_csv import GapRow
from fingervision.storage.recorded_video import RecordedVideo
from fingervision.storage.row_file import RowFile
from fingervision.storage.run_files import RunFiles
from fingervision.storage.summary_json import write_summary

SAMPLE = Path(__file__).parents[2] / "sample_frames" / "reference" / "calibration.json"


@pytest.fixture
def flushed(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int]]:
    """Inode and size of each file at the time at which it was flushed."""
    found: list[tuple[int, int]] = []
    fsync = os.fsync

    def noted(number: int) -> None:
        fsync(number)
        found.append((os.fstat(number).st_ino, os.fstat(number).st_size))

    monkeypatch.setattr(os, "fsync", noted)
    return found


def _about(folder: Path) -> None:
    files = RunFiles(folder)
    files.close()
    files.write_about({}, complete=True)


WRITERS: dict[str, Callable[[Path], None]] = {
    "run.json": _about,
    "summary.json": lambda folder: write_summary(folder / "summary.json", {}),
    "calibration.json": lambda folder: write_calibration(read_calibration(SAMPLE), folder / "calibration.json"),
}


@pytest.mark.parametrize("name", WRITERS)
def test_a_complete_file_is_on_the_disk_and_so_is_its_name(
    tmp_path: Path, flushed: list[tuple[int, int]], name: str
) -> None:
    WRITERS[name](tmp_path)
    stat = (tmp_path / name).stat()
    assert flushed[-2:] == [(stat.st_ino, stat.st_size), (tmp_path.stat().st_ino, tmp_path.stat().st_size)]
    assert not list(tmp_path.glob(".*.part"))


def test_a_file_that_cannot_be_flushed_keeps_its_former_content(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    path = tmp_path / "a.txt"
    path.write_text("before")
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"), replaced(path) as part:
        part.write_text("after")
    assert [(each.name, each.read_text()) for each in tmp_path.iterdir()] == [("a.txt", "before")]


def test_a_growing_table_and_video_are_on_the_disk_within_a_second(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, flushed: list[tuple[int, int]]
) -> None:
    clock = [100.0]
    for module in ("row_file", "durable"):
        monkeypatch.setattr(f"fingervision.storage.{module}.monotonic", lambda: clock[0])
    table, video = tmp_path / "gaps.csv", tmp_path / "video.mp4"
    lines, film = RowFile(table, GapRow, ("frame",)), RecordedVideo(video, None)
    sizes: dict[Path, list[tuple[float, int]]] = {table: [], video: []}
    pixels = np.random.default_rng(1).integers(0, 255, (48, 64), np.uint8)
    for k in range(50):
        clock[0] += 0.04
        lines.add([GapRow(k, None, Status.OK)])
        film.add(Frame(pixels, k, 0.04 * k), ())
        for path, seen in sizes.items():
            on_disk = max((size for inode, size in flushed if inode == path.stat().st_ino), default=0)
            seen.append((clock[0], on_disk))
    for path, seen in sizes.items():
        grown = [at for k, (at, size) in enumerate(seen) if size > (seen[k - 1][1] if k else 0)]
        assert len(grown) >= 3
        assert max(np.diff([100.0, *grown, clock[0]])) < 0.6, path.name
    lines.close()
    film.close()
    assert {(path.stat().st_ino, path.stat().st_size) for path in sizes} <= set(flushed)
