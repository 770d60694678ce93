"""A run contains all live measurements to the last digit, however the run ends."""

import json
import shutil
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fingervision.storage.row_file import FLUSH_EVERY_S

SCALE = ("--px-per-mm", "34")
LOST_AT_MOST_S = 1.0
# A disk for more frames than wait until the camera is learnt, so that there are rows before it is full.
DISK_MB = 24
Start = Callable[..., Any]


@pytest.mark.slow
def test_measuring_the_recording_again_gives_the_same_table(live: Start, measured: Callable[..., str]) -> None:
    view = live("simulated", "--no-page", "--json")
    view.until(lambda seen: len(seen.lines()) > 40)
    assert view.stop() == 0
    (run,) = view.runs()
    table = (run / "gaps.csv").read_text()
    assert len(table.splitlines()) > 40
    assert measured(run / "video.mp4", *SCALE) == table
    about = json.loads((run / "run.json").read_text())
    assert about["complete"] is True
    assert about["device"]["camera"] == {}  # the simulated one has no settings
    assert about["frames"] == len(table.splitlines()) - 1
    events = [json.loads(line)["event"] for line in (run / "events.jsonl").read_text().splitlines()]
    assert events[0] == "recording"
    assert events[-1] == "stopped"


@pytest.mark.slow
def test_a_killed_recording_loses_a_second_at_most(
    live: Start, measured: Callable[..., str], rows: Callable[[Path], list[dict[str, str]]]
) -> None:
    view = live("simulated", "--no-page", "--json")
    last = view.until(lambda seen: len(seen.lines()) > 60 and seen.lines()[-1])
    # While it goes on, rows reach the file; how soon is the file's own period, whatever the machine does beside it.
    view.until(lambda seen: last["frame"] in [int(row["frame"]) for row in whole_rows(seen.runs(), rows)])
    assert 2 * FLUSH_EVERY_S <= LOST_AT_MOST_S
    view.stop(signal.SIGKILL)
    (run,) = view.runs()
    kept = rows(run / "gaps.csv")
    assert int(kept[-1]["frame"]) >= last["frame"]
    again = measured(run / "video.mp4", *SCALE).splitlines()
    written = (run / "gaps.csv").read_text().splitlines()
    common = min(len(again), len(written))
    assert again[:common] == written[:common]
    assert len(again) > len(written) - 25 * LOST_AT_MOST_S
    assert json.loads((run / "run.json").read_text())["complete"] is False


def whole_rows(runs: list[Path], rows: Callable[[Path], list[dict[str, str]]]) -> list[dict[str, str]]:
    return rows(runs[0] / "gaps.csv") if runs else []


@pytest.mark.slow
def test_a_full_disk_ends_the_recording_and_not_the_measuring(
    live: Start, measured: Callable[..., str], tmp_path: Path
) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={DISK_MB}m", "tmpfs", str(disk)]
    mounted = subprocess.run(command, capture_output=True, text=True, check=False)
    if mounted.returncode:
        pytest.skip(f"a small disk cannot be mounted here: {mounted.stderr.strip()}")
    try:
        view = live("simulated", "--no-page", "--json", out=disk / "runs")
        view.until(lambda seen: "could not be written any further (No space left on device)" in seen.text())
        count = len(view.lines())
        view.until(lambda seen: len(seen.lines()) > count + 10)
        assert view.stop() == 1
        run = tmp_path / "run"
        shutil.copytree(view.runs()[0], run)
        written = (run / "gaps.csv").read_text().splitlines()
        again = measured(run / "video.mp4", *SCALE).splitlines()
        common = min(len(again), len(written)) - 1
        assert common > 5
        assert again[:common] == written[:common]
    finally:
        subprocess.run(["umount", str(disk)], check=True)
