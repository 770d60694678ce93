"""A run that is killed at any moment is valid, loses at most a second, and ends with the results of a complete run."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.errors import OutputError
from fingervision.storage.drive_csv import read_samples
from fingervision.storage.recipe_toml import read_recipe
from fingervision.storage.recorded_video import frames_in
from fingervision.testbed.run.run_folder import remains
from tests.testbed.simulated_beds import recipe_at, run, steps

PACE = ("--real-time",)
MOMENTS = 2
LOST_AT_MOST_S = 1.0
PATIENCE_S = 120.0


def killed(recipe: Path, out: Path, after_s: float) -> int:
    """Kill a run some time after its first frames; return the least number of frames that had been written by then."""
    words = [sys.executable, "-m", "fingervision", "bed", "run", str(recipe), "--out", str(out), *PACE]
    process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    until_s = time.monotonic() + PATIENCE_S
    while frames_in(out / "video.mp4") == 0 and process.poll() is None and time.monotonic() < until_s:
        time.sleep(0.05)
    time.sleep(after_s)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    return frames_in(out / "video.mp4")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    folder = tmp_path_factory.mktemp("whole")
    run(folder)
    return (folder / "run" / "samples.csv").read_bytes()


@pytest.mark.slow
def test_a_killed_run_is_gone_on_with_to_the_same_end(tmp_path: Path, whole: bytes) -> None:
    rng = np.random.default_rng(5)
    for k in range(MOMENTS):
        folder = tmp_path / str(k)
        folder.mkdir()
        in_video = killed(recipe_at(folder), folder / "run", float(rng.uniform(0.0, 2.0)))
        rows = read_samples(folder / "run" / "samples.csv")
        # Rows are written in groups every half second; their frames are in the video before.
        assert in_video - len(rows) <= LOST_AT_MOST_S * 25.0
        if not json.loads((folder / "run" / "run.json").read_text())[
            "complete"
        ]:  # on a loaded computer, the run may end before it is killed
            assert run(folder).resumed_after == min(len(rows), in_video)
        assert (folder / "run" / "samples.csv").read_bytes() == whole
        assert frames_in(folder / "run" / "video.mp4") == len(read_samples(folder / "run" / "samples.csv"))
        events = [json.loads(line) for line in (folder / "run" / "events.jsonl").read_text().splitlines()]
        numbered = [event["n"] for event in events if "n" in event]
        assert numbered == list(range(len(numbered)))
        assert json.loads((folder / "run" / "run.json").read_text())["complete"] is True


@pytest.mark.slow
def test_half_a_row_and_half_an_event_are_cut_off(tmp_path: Path, whole: bytes) -> None:
    run(tmp_path)
    folder = tmp_path / "run"
    lines = whole.splitlines(keepends=True)
    (folder / "samples.csv").write_bytes(b"".join(lines[:12]) + lines[12][:20])
    events = (folder / "events.jsonl").read_bytes().splitlines(keepends=True)
    (folder / "events.jsonl").write_bytes(b"".join(events[:3]) + events[3][:15])
    about = json.loads((folder / "run.json").read_text())
    (folder / "run.json").write_text(json.dumps({**about, "complete": False}))
    assert run(tmp_path).resumed_after == 11
    assert (folder / "samples.csv").read_bytes() == whole


def test_empty_files_after_a_power_failure_are_removed(tmp_path: Path) -> None:
    names = ("run.json", "video.mp4", "samples.csv", "events.jsonl", ".run.json.part")
    for name in (*names, "notes.txt"):
        (tmp_path / name).touch()
    with pytest.raises(OutputError, match=r"notes\.txt"):
        remains(tmp_path, read_recipe(recipe_at(tmp_path.parent)), "")
    assert [each.name for each in tmp_path.iterdir()] == ["notes.txt"]


def test_ctrl_c_ends_a_run_in_a_sentence(tmp_path: Path) -> None:
    # The run is so long that it does not end before a key is pressed.
    recipe = recipe_at(tmp_path, steps('kind = "hold"\nat_mm = 0.2\nseconds = 60.0'))
    words = [sys.executable, "-m", "fingervision", "bed", "run", str(recipe), "--out", str(tmp_path / "run"), *PACE]
    process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    until_s = time.monotonic() + PATIENCE_S
    while frames_in(tmp_path / "run" / "video.mp4") < 5 and time.monotonic() < until_s:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1
    assert "The run was stopped, and the motor is at rest. The same command continues the run." in errors
    assert "Traceback" not in errors
