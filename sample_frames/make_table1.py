"""Draw the paper's experiment again: 17 frames whose true gaps are Table 1's experiment column.

Run as `python sample_frames/make_table1.py [FOLDER]`; without a folder the frames beside this script are replaced.
"""

import csv
import sys
from pathlib import Path

import cv2
import numpy as np

from fingervision.domain.gap import NoGap
from fingervision.rendering import Camera, render, truth, two_fingers

HERE = Path(__file__).parent
PX_PER_MM = 34.0
BELOW_TIP_MM = 0.3
WIDTH_MM = 3.0
RADIUS_MM = 0.9
CAMERA = Camera(blur_px=0.9, noise_grey=2.0)
SEED = 1


def main(folder: Path) -> None:
    """Write the frames and their true gaps."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(SEED)
    with (HERE / "paper" / "table1.csv").open(encoding="utf-8") as source:
        rows = list(csv.DictReader(source))
    with (folder / "expected_gaps.csv").open("w", encoding="utf-8", newline="\n") as expected:
        print("frame,file,input_mm,gap_mm,gap_px", file=expected)
        for i, row in enumerate(rows):
            gap_mm = float(row["experiment_mm"])
            scene = two_fingers(
                gap_mm * PX_PER_MM,
                below_tip_px=BELOW_TIP_MM * PX_PER_MM,
                width_px=WIDTH_MM * PX_PER_MM,
                radius_px=RADIUS_MM * PX_PER_MM,
                # Every frame has its own place on the pixels.
                tip_at_px=120.0 + rng.uniform(-0.5, 0.5),
                centre_px=rng.uniform(-0.5, 0.5),
            )
            true = truth(scene, CAMERA, BELOW_TIP_MM * PX_PER_MM)
            if isinstance(true, NoGap):
                sys.exit(f"{row} gives no gap: {true.words}")
            name = f"frame_{i:02d}.png"
            cv2.imwrite(str(folder / name), render(scene, CAMERA, rng), [cv2.IMWRITE_PNG_COMPRESSION, 9])
            input_mm = 1000.0 * float(row["input_m"])
            print(f"{i},{name},{input_mm:.2f},{true.gap_px / PX_PER_MM:.6f},{true.gap_px:.6f}", file=expected)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "table1")
