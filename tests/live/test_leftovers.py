"""Empty files that a power failure left are removed at the next start; those of a running program stay."""

import os
from pathlib import Path

from fingervision.live.run_folder import remove_leftovers


def test_only_empty_files_from_before_the_start_of_the_computer_go(tmp_path: Path) -> None:
    cut, running = (tmp_path / f"2026-05-04T10-11-{second}Z" for second in (12, 13))
    for run in (cut, running):
        run.mkdir()
        for name, text in (("run.json", ""), ("video.mp4", ""), ("gaps.csv", "frame\n"), ("note.txt", "")):
            (run / name).write_text(text)
    for name in ("calibration_a.json", "snapshot_b.png", "my.toml"):
        (tmp_path / name).touch()
    (tmp_path / "calibration_c.json").write_text("{}")
    new = tmp_path / "calibration_new.json"
    for file in [*cut.iterdir(), *tmp_path.glob("*.*"), running / "run.json"]:
        if file.is_file():
            os.utime(file, (0, 0))
    new.touch()
    remove_leftovers(tmp_path)
    assert sorted(file.name for file in cut.iterdir()) == ["gaps.csv", "note.txt"]
    assert len(list(running.iterdir())) == 4
    assert sorted(file.name for file in tmp_path.iterdir() if file.is_file()) == [
        "calibration_c.json", "calibration_new.json", "my.toml",
    ]  # fmt: skip
    remove_leftovers(tmp_path / "missing")
