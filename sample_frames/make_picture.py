"""Make the README's picture: a measured frame of the opening clip, and the gap over the whole clip.

python sample_frames/make_picture.py
"""

from itertools import islice
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np

from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.frames.video_file import VideoFile
from fingervision.vision.overlay import draw_overlay
from fingervision.vision.pipeline import Settings, measure_frames

mpl.use("Agg")

CASE = Path(__file__).parent / "opening"
PX_PER_MM = 34.0
SHOWN_FRAME = 75


def main() -> None:
    """Measure the clip and draw."""
    frames = [item for item in islice(VideoFile(str(CASE / "opening.mp4")), 300) if isinstance(item, Frame)]
    outcomes = measure_frames(frames, Settings(below_tip_px=0.3 * PX_PER_MM))
    ok = [(f, m) for f, m in zip(frames, outcomes, strict=True) if isinstance(m, GapMeasurement)]
    time_s = np.array([f.time_s for f, _ in ok])
    gap_mm = np.array([m.gap_px for _, m in ok]) / PX_PER_MM
    u_mm = np.array([m.u_gap_px for _, m in ok]) / PX_PER_MM
    frame, measured = ok[SHOWN_FRAME]
    words = f"{gap_mm[SHOWN_FRAME]:.4f} mm, u = {1e3 * u_mm[SHOWN_FRAME]:.1f} um from frame to frame"

    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4), width_ratios=(4, 5), layout="constrained")
    left.imshow(draw_overlay(frame, measured, words))
    left.set_axis_off()
    right.plot(time_s, gap_mm, lw=1.2, color="#1f6fb2")
    right.plot(time_s[SHOWN_FRAME], gap_mm[SHOWN_FRAME], "o", color="#d62728")
    right.set(xlabel="time / s", ylabel="gap / mm", title="Distance of the fingers, 0.3 mm below their tips")
    right.grid(alpha=0.3)
    figure.savefig(CASE / "measured.png", dpi=100)


if __name__ == "__main__":
    main()
