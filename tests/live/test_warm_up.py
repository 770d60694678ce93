"""After the warm-up nothing is compiled any more, whatever is chosen: no frame waits for it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

CODE = """
import gc
import numpy as np
from numba.core.dispatcher import Dispatcher
from fingervision.domain.direction import Direction
from fingervision.domain.frame import Coding, Frame
from fingervision.domain.region import Region
from fingervision.measuring.rehearsal import rehearse
from fingervision.rendering import Camera, render, two_fingers
from fingervision.vision.pipeline import Settings, measure_frame

def compiled():
    return {(d.py_func.__module__, d.py_func.__name__, s) for d in gc.get_objects() if isinstance(d, Dispatcher)
            for s in map(str, d.signatures)}

rehearse(lambda name, words: None)
before = compiled()
assert len(before) > 3, before
for direction in Direction:
    scene = two_fingers(50.0, below_tip_px=8.0, radius_px=8.0, frame=(300, 260), direction=direction)
    dark = render(scene, Camera(blur_px=0.9, noise_grey=2.0), np.random.default_rng(1))
    for pixels in (dark, 255 - dark):
        for region in (None, Region(6, 4, 280, 250)):
            for known in (None, direction):
                for is_dark in (None, True, False):
                    measure_frame(Frame(pixels, 0, 0.0, Coding.INTERFRAME),
                                  Settings(8.0, known, region, fingers_are_dark=is_dark))
print(sorted(compiled() - before))
"""


@pytest.mark.slow
def test_region_tips_and_polarity_are_warmed_up() -> None:
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", CODE], capture_output=True, text=True, check=False, env=environment, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "[]"
