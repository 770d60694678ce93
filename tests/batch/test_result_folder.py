"""Folders of results: what a worker left behind is recognised."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from fingervision.batch.result_folder import new_part, remove_left_parts


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="this system has no /proc")
def test_the_part_of_a_killed_worker_is_removed_before_anybody_asked_how_it_ended(tmp_path: Path) -> None:
    worker = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    own = new_part(tmp_path / "film.mkv")
    left = own.with_name(own.name.replace(f"~{os.getpid()}~", f"~{worker.pid}~"))
    for folder in (own, left):
        folder.mkdir()
    remove_left_parts(tmp_path)
    assert left.exists(), "its worker lives"
    worker.kill()
    os.waitid(os.P_PID, worker.pid, os.WEXITED | os.WNOWAIT)
    remove_left_parts(tmp_path)
    assert (own.exists(), left.exists()) == (True, False)
    worker.wait()
