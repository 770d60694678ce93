"""The memory that `measure` needs is constant in the length of the recording."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fingervision.rendering import Camera, render, two_fingers
from tests.clips import Codec, coded

# Largest ratio of the peaks for 1500 and 60 frames (design: 10 minutes within 1.1 times the peak of 10 seconds).
LENGTHS, MOST_GROWTH = (60, 1500), 1.1
WATCHED = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


def recording(path: Path, coder: str, options: dict[str, str], count: int) -> Path:
    """Fingers that jump from frame to frame, with noise that no codec can leave out."""
    scenes = [two_fingers(60.0 + 6.0 * k, below_tip_px=6.0, width_px=60.0, frame=(320, 240)) for k in range(5)]
    shown = [render(scene, Camera(noise_grey=4.0), np.random.default_rng(k)) for k, scene in enumerate(scenes)]
    levels = (shown[k % len(shown)] for k in range(count))
    coded(path, levels, Codec(coder, "yuvj420p" if coder == "mjpeg" else "yuv420p", options))
    return path


def peak_kb(path: Path) -> int:
    """Largest resident memory of `fingervision measure`."""
    command = [sys.executable, "-m", "fingervision", "measure", str(path), "--px-per-mm", "20", "--out", f"{path}.out"]
    done = subprocess.run([sys.executable, "-c", WATCHED, *command], capture_output=True, text=True, check=True)
    return int(done.stdout)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows does not tell the peak of a child in this way.")
@pytest.mark.parametrize(
    ("name", "coder", "options"),
    [
        ("clip.mp4", "libx264", {"preset": "ultrafast", "crf": "20"}),
        ("clip.mkv", "ffv1", {"level": "3", "slicecrc": "1"}),
        ("clip.mkv", "mjpeg", {"qmin": "3", "qmax": "3"}),
    ],
)
def test_the_peak_does_not_grow_with_the_recording(
    tmp_path: Path, name: str, coder: str, options: dict[str, str]
) -> None:
    short, long = (peak_kb(recording(tmp_path / f"{count}-{name}", coder, options, count)) for count in LENGTHS)
    assert long <= MOST_GROWTH * short, (
        f"{short / 1024:.0f} MB for {LENGTHS[0]} frames, {long / 1024:.0f} for {LENGTHS[1]}"
    )
