"""After the warm-up, no frame is delayed by a one-time computation of a table or the loading of a library."""

import subprocess
import sys

CODE = """
import sys
import numpy as np
from fingervision.domain.frame import Frame
from fingervision.measuring.rehearsal import rehearse
from fingervision.rendering import Camera, render, two_fingers
from fingervision.vision.edge_filters import edge_filters
from fingervision.vision.pipeline import Settings, measure_frame

rehearse()
modules, tables = set(sys.modules), edge_filters.cache_info().misses
for blur_px in (0.4, 0.9, 2.0, 4.0):
    scene = two_fingers(50.0, below_tip_px=8.0, radius_px=8.0, frame=(300, 260))
    dark = render(scene, Camera(blur_px=blur_px, noise_grey=2.0), np.random.default_rng(1))
    for pixels in (dark, 255 - dark, dark[::-1].copy(), 16 * dark.astype(np.uint16)):
        measure_frame(Frame(pixels, 0, 0.0), Settings(8.0))
print(sorted(set(sys.modules) - modules), edge_filters.cache_info().misses - tables)
"""


def test_no_frame_makes_a_table_or_loads_a_library() -> None:
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "[] 0"
