"""Draw the clip again: the gripper opening and closing at 25 frames per second, with the input that drove it.

Run as `PYTHONPATH=. python sample_frames/make_opening.py [FOLDER]` from the top; without a folder the files beside this
script are replaced.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.frame import Frame
from fingervision.domain.gap import NoGap
from fingervision.rendering import Camera, Scene, render, truth, two_fingers
from tests.clips import h264, write_clip

HERE = Path(__file__).parent
PX_PER_MM = 34.0
BELOW_TIP_PX = 0.3 * PX_PER_MM
WIDTH_MM = 3.0
RADIUS_MM = 0.9
RATE_HZ = 25
DRIVE_RATE_HZ = 100
# Corners of the input over time: rest, open, close past rest, back to rest. Steady motion at 0.375 mm/s.
CORNER_TIMES_S = (0.0, 0.6, 4.6, 9.8, 11.0, 12.0)
CORNER_INPUTS_MM = (0.0, 0.0, 1.5, -0.45, 0.0, 0.0)
# The simulation is the straight line that the paper's Comsol model is, to 1e-5 mm (Table 1).
REST_GAP_MM = 4.0
MM_PER_MM = 7.7212
# What the simulation does not know: after a reversal nothing moves for this stretch of the input.
PLAY_MM = 0.03
# Each finger leans outwards by this angle per millimetre of input.
LEAN_DEG_PER_MM = 0.6
CAMERA = Camera(blur_px=0.9, noise_grey=2.0)
SEED = 2


def after_play(input_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Find what the mechanism receives behind a play, centred at the start."""
    received = np.zeros_like(input_mm)
    at_mm = float(input_mm[0])
    for i, driven_mm in enumerate(input_mm.tolist()):
        at_mm = min(max(at_mm, driven_mm - PLAY_MM / 2), driven_mm + PLAY_MM / 2)
        received[i] = at_mm
    return received


def scene_at(gap_mm: float, input_mm: float) -> Scene:
    """Place the fingers as they stand at one moment."""
    lean_deg = LEAN_DEG_PER_MM * input_mm
    return two_fingers(
        gap_mm * PX_PER_MM,
        below_tip_px=BELOW_TIP_PX,
        width_px=WIDTH_MM * PX_PER_MM,
        radius_px=RADIUS_MM * PX_PER_MM,
        tip_at_px=120.3,
        centre_px=0.4,
        tilt_deg=(-lean_deg, lean_deg),
    )


def main(folder: Path) -> None:
    """Write the clip, the drive's record, the simulation and the true gaps."""
    folder.mkdir(parents=True, exist_ok=True)
    drive_s = np.arange(round(CORNER_TIMES_S[-1] * DRIVE_RATE_HZ) + 1) / DRIVE_RATE_HZ
    drive_mm = np.interp(drive_s, CORNER_TIMES_S, CORNER_INPUTS_MM)
    with (folder / "drive.csv").open("w", encoding="utf-8", newline="\n") as drive:
        print("time_s,input_mm,run", file=drive)
        for time_s, input_mm in zip(drive_s.tolist(), drive_mm.tolist(), strict=True):
            print(f"{time_s:.2f},{input_mm:.6f},opening", file=drive)
    with (folder / "simulation.csv").open("w", encoding="utf-8", newline="\n") as simulation:
        print("input_mm,gap_mm", file=simulation)
        for input_mm in (-0.5, 1.6):
            print(f"{input_mm:.1f},{REST_GAP_MM + MM_PER_MM * input_mm:.6f}", file=simulation)

    every = DRIVE_RATE_HZ // RATE_HZ
    times_s, inputs_mm, received_mm = drive_s[:-1:every], drive_mm[:-1:every], after_play(drive_mm)[:-1:every]
    scenes = [
        scene_at(REST_GAP_MM + MM_PER_MM * received, driven)
        for received, driven in zip(received_mm.tolist(), inputs_mm.tolist(), strict=True)
    ]
    with (folder / "expected_gaps.csv").open("w", encoding="utf-8", newline="\n") as expected:
        print("frame,time_s,input_mm,gap_mm,gap_px", file=expected)
        for i, scene in enumerate(scenes):
            true = truth(scene, CAMERA, BELOW_TIP_PX)
            if isinstance(true, NoGap):
                sys.exit(f"Frame {i} has no gap: {true.words}")
            gap_mm = true.gap_px / PX_PER_MM
            print(f"{i},{times_s[i]:.2f},{inputs_mm[i]:.6f},{gap_mm:.6f},{true.gap_px:.6f}", file=expected)

    def frames() -> Iterator[Frame]:
        rng = np.random.default_rng(SEED)
        for i, scene in enumerate(scenes):
            yield Frame(render(scene, CAMERA, rng), i, float(times_s[i]))

    write_clip(folder / "opening.mp4", frames(), h264(crf=19.0))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "opening")
