"""The driver's time stamps of a camera, through OpenCV's own V4L2 backend and an emulated driver."""

import json
import os
import shutil
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

SOURCE = Path(__file__).with_name("emulated_camera.c")
READ = """
import json
from itertools import islice
from fingervision.frames import camera
from fingervision.frames.source import Wish
camera._check_device = lambda name: None
frames = camera.open_frames("/dev/video77", Wish())
got = [(each.item.time_s, each.arrived_s) for each in islice(frames.received(), 30)]
print(json.dumps([frames.has_own_clock, frames.description.width_px, got]))
"""


@pytest.mark.skipif(sys.platform != "linux" or shutil.which("gcc") is None, reason="needs Linux and a C compiler")
def test_the_stamps_of_the_driver_are_the_times_of_the_frames(tmp_path: Path) -> None:
    library = tmp_path / "camera.so"
    subprocess.run(["gcc", "-shared", "-fPIC", "-O1", "-o", library, SOURCE, "-ldl"], check=True)
    done = subprocess.run(
        [sys.executable, "-c", READ], env={**os.environ, "LD_PRELOAD": str(library)}, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    has_own_clock, width_px, got = json.loads(done.stdout)
    assert has_own_clock
    assert width_px == 320
    stamps_s, arrived_s = np.array(got).T
    # Frames that came late are lost by no one: whole periods apart, however late they were read.
    periods = np.diff(stamps_s) / 0.01
    assert np.abs(periods - np.round(periods)).max() < 1e-3
    assert all(before < after for before, after in pairwise(stamps_s))
    assert np.ptp(arrived_s - stamps_s) > 0.002
    assert (arrived_s > stamps_s).all()
