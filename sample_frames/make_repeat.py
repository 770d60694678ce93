"""Write the tables of `fingervision example calibrate`: the same gap recorded on three days, and two runs over inputs.

    python -m sample_frames.make_repeat

Frames are rendered with known truth and measured; on every day the camera stands a little differently.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import fingervision as fv
from fingervision.rendering import Camera, render, two_fingers

OUT = Path(__file__).parents[1] / "fingervision" / "examples" / "repeat"
PX_PER_MM = 34.0
FRAMES, SETTING_UP_MM = 12, 0.0008


def recording(rng: np.random.Generator, gaps_mm: np.ndarray) -> np.ndarray:
    """Pictures of these gaps, set up anew: all of them off by the same little."""
    gaps_mm = gaps_mm + SETTING_UP_MM * rng.standard_normal()
    scenes = [two_fingers(gap * PX_PER_MM, below_tip_px=10.2, radius_px=12.0) for gap in gaps_mm]
    return np.stack([render(scene, Camera(blur_px=0.9, noise_grey=2.0), rng) for scene in scenes])


def main() -> None:
    """Write all five tables."""
    rng = np.random.default_rng(3)
    inputs = np.repeat([0.0, 0.2, 0.4], 4)
    times = np.arange(FRAMES) / 25.0
    drive = {"time_s": times, "input_mm": inputs}
    tables = {day: fv.measure(recording(rng, np.full(FRAMES, 2.0)), px_per_mm=PX_PER_MM, times_s=times)
              for day in ("monday", "tuesday", "wednesday")}  # fmt: skip
    for run in ("a", "b"):
        frames = recording(rng, 1.5 + 3.0 * inputs)
        tables[run] = fv.measure(frames, px_per_mm=PX_PER_MM, times_s=times, drive=drive, drive_offset_s=0.0)
    OUT.mkdir(parents=True, exist_ok=True)
    for name, measured in tables.items():
        with TemporaryDirectory() as folder:
            saved = measured.save(Path(folder) / "out") / "gaps.csv"
            (OUT / f"{name}.csv").write_bytes(saved.read_bytes())
    print(f"Written: {OUT}")


if __name__ == "__main__":
    main()
