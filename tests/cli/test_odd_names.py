"""What people and shells hand over: odd names and closed streams; a sentence or the result."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.frame import Frame
from fingervision.rendering import Camera, render, two_fingers
from tests.clips import FFV1, write_clip

PATIENCE_S = 120.0
SCALE = ("--px-per-mm", "20")


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("clip") / "clip.mkv"
    rng = np.random.default_rng(0)
    scenes = [two_fingers(60.0 + k, below_tip_px=6.0, width_px=40.0, frame=(240, 200)) for k in range(3)]
    write_clip(path, (Frame(render(each, Camera(), rng), k, 0.04 * k) for k, each in enumerate(scenes)), FFV1)
    return path


def run(folder: Path, *arguments: str | bytes, shell: str = "") -> "subprocess.CompletedProcess[bytes]":
    """Run the command as a process of its own, through a shell where its streams are bent."""
    command: list[str | bytes] = [sys.executable, "-m", "fingervision", *arguments]
    if shell:
        command = ["/bin/sh", "-c", f'"$@" {shell}', "sh", *command]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        command,
        cwd=folder,
        capture_output=True,
        timeout=PATIENCE_S,
        env=environment,
        check=False,
        stdin=subprocess.DEVNULL,
    )
    assert b"Traceback" not in done.stderr, done.stderr.decode(errors="replace")
    assert b"Exception ignored" not in done.stderr
    return done


@pytest.mark.slow
@pytest.mark.parametrize("name", [b"12:30:05.mkv", b"a$b^c$.mkv", b"=1+1.mkv", b"caf\xe9.mkv", b"with 'quotes\".mkv"])
def test_a_recording_of_any_name_is_measured(tmp_path: Path, clip: Path, name: bytes) -> None:
    shutil.copy(clip, tmp_path / os.fsdecode(name))
    done = run(tmp_path, "measure", name, *SCALE)
    assert done.returncode == 0, done.stderr
    assert b"3 of 3 frames measured" in done.stdout
    assert len(list((tmp_path / "measured").glob("*/gaps.csv"))) == 1


@pytest.mark.slow
@pytest.mark.parametrize("closed", ["2>&-", ">&-", "<&- 2>&- >&-"])
def test_closed_streams_cost_no_result(tmp_path: Path, clip: Path, closed: str) -> None:
    done = run(tmp_path, "measure", str(clip), *SCALE, "--out", "out", shell=closed)
    assert done.returncode == 0
    assert (tmp_path / "out" / "summary.json").exists()


@pytest.mark.parametrize("closed", ["2>&-", "<&- 2>&- >&-"])
def test_no_file_takes_the_place_of_a_closed_stream(tmp_path: Path, closed: str) -> None:
    # FFmpeg writes to stream 2, whatever is open there.
    code = "import os; from fingervision.cli import _mend_streams; _mend_streams(); f = os.open('new', os.O_CREAT); "
    command = ["/bin/sh", "-c", f'"$@" {closed}', "sh", sys.executable, "-c", f"{code}raise SystemExit(f)"]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    assert subprocess.run(command, cwd=tmp_path, env=environment, timeout=PATIENCE_S, check=False).returncode > 2


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full.")
def test_a_full_output_is_a_sentence(tmp_path: Path, clip: Path) -> None:
    done = run(tmp_path, "measure", str(clip), *SCALE, "--out", "out", shell="> /dev/full")
    assert done.returncode == 1
    assert b"Standard output could not be written" in done.stderr
    assert (tmp_path / "out" / "summary.json").exists()
