"""Draw the reference objects again: six bars and a slot of known size.

Run as `python sample_frames/make_reference.py [FOLDER]`; without a folder the pictures beside this script are replaced.
"""

import sys
from pathlib import Path

import cv2
import numpy as np

from fingervision.rendering import Camera, Patch, Scene, render
from fingervision.rendering.targets import bar, slot

HERE = Path(__file__).parent
PX_PER_MM = 34.0
BARS_MM = (2.0, 5.0, 8.0, 11.0, 14.0, 17.0)
SLOT_MM = 3.0
# The bars run through the frame from top to bottom; the slot ends in view.
BAR_LENGTH_PX = 800.0
SLOT_LENGTH_PX = 340.0
DARK = 40.0
CAMERA = Camera(blur_px=0.9, noise_grey=2.0)
SEED = 3


def main(folder: Path) -> None:
    """Write the pictures and their true sizes."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(SEED)
    with (folder / "sizes.csv").open("w", encoding="utf-8", newline="\n") as sizes:
        print("file,kind,size_mm,size_px,turn_deg", file=sizes)
        for kind, size_mm in [("bar", size_mm) for size_mm in BARS_MM] + [("slot", SLOT_MM)]:
            # Nobody lays a bar down quite straight, or always on the same pixels.
            x_px, y_px, turn_deg = (
                319.5 + rng.uniform(-2.0, 2.0),
                239.5 + rng.uniform(-2.0, 2.0),
                rng.uniform(-0.4, 0.4),
            )
            size_px = size_mm * PX_PER_MM
            length_px = BAR_LENGTH_PX if kind == "bar" else SLOT_LENGTH_PX
            shape = bar if kind == "bar" else slot
            outlines = shape(size_px, length_px, x_px=x_px, y_px=y_px, turn_deg=turn_deg)
            picture = render(Scene(behind=(Patch(outlines, DARK),)), CAMERA, rng)
            name = f"{kind}_{size_mm:02.0f}mm.png"
            cv2.imwrite(str(folder / name), picture, [cv2.IMWRITE_PNG_COMPRESSION, 9])
            print(f"{name},{kind},{size_mm:.3f},{size_px:.3f},{turn_deg:.4f}", file=sizes)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "reference")
