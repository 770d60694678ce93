"""Films of a gripper whose simulation is a straight line: what the drive did, and what the picture shows of it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.frame import Frame
from fingervision.rendering import Camera, render, two_fingers
from tests.clips import FFV1, write_clip

Array = NDArray[np.float64]

PX_PER_MM = 20.0
BELOW_TIP_PX = 0.3 * PX_PER_MM
FRAME = (320, 72)
MIDDLE_PX = (FRAME[1] - 1) / 2
RATE_HZ, DRIVE_RATE_HZ = 25, 100
REST_GAP_MM, MM_PER_MM = 4.0, 7.7212
LEAN_DEG_PER_MM = 0.6
PLAIN = Camera(blur_px=0.9, noise_grey=2.0)
# Corners of the input over time, a run each: slow, with holds and a turn half-way; then twice as fast. Every corner is
# at a frame: where a stage turned between two frames, no row of the table knows how far it had come.
SLOW = ((0.0, 0.0), (0.4, 0.0), (2.4, 1.0), (3.0, 1.0), (4.6, -0.4), (5.0, -0.4), (5.88, 0.4), (6.48, 0.0), (6.88, 0.0))
FAST = ((8.0, -0.4), (9.2, 1.0), (10.6, -0.4), (11.2, 0.3), (11.8, -0.4), (13.0, 1.0))


@dataclass(frozen=True, slots=True)
class Film:
    """What is hidden in the pictures.

    Parameters
    ----------
    received : callable
        Recorded input over time to what the mechanism received, both at the drive's rate.
    gap : callable
        Simulated gap to the true one.
    camera : Camera
        That takes the pictures.
    late_s : float
        How late the frames are stamped.
    """

    received: Callable[[Array], Array] = lambda input_mm: input_mm
    gap: Callable[[Array], Array] = lambda gap_mm: gap_mm
    camera: Camera = PLAIN
    late_s: float = 0.0


def shoot(film: Film, folder: Path, seed: int) -> None:
    """Write film.mkv (lossless), drive.csv and simulation.csv."""
    rng = np.random.default_rng(seed)
    drive = ["time_s,input_mm,run"]
    moments: list[tuple[float, float, float]] = []
    for name, corners in (("slow", SLOW), ("fast", FAST)):
        at_s, at_mm = np.array(corners).T
        time_s = at_s[0] + np.arange(round((at_s[-1] - at_s[0]) * DRIVE_RATE_HZ) + 1) / DRIVE_RATE_HZ
        input_mm = np.interp(time_s, at_s, at_mm)
        gap_mm = film.gap(REST_GAP_MM + MM_PER_MM * film.received(input_mm))
        drive += [f"{t:.2f},{u:.6f},{name}" for t, u in zip(time_s, input_mm, strict=True)]
        every = DRIVE_RATE_HZ // RATE_HZ
        moments += zip(time_s[::every].tolist(), input_mm[::every].tolist(), gap_mm[::every].tolist(), strict=True)
    (folder / "drive.csv").write_text("\n".join(drive) + "\n", encoding="utf-8")
    ends = (f"{u},{REST_GAP_MM + MM_PER_MM * u:.6f}" for u in (-0.5, 1.1))
    (folder / "simulation.csv").write_text("\n".join(["input_mm,gap_mm", *ends]) + "\n", encoding="utf-8")

    def frames() -> Iterator[Frame]:
        for index, (time_s, input_mm, gap_mm) in enumerate(moments):
            lean_deg = LEAN_DEG_PER_MM * input_mm
            scene = two_fingers(
                gap_mm * PX_PER_MM,
                below_tip_px=BELOW_TIP_PX,
                width_px=2.0 * PX_PER_MM,
                radius_px=0.2 * PX_PER_MM,
                tip_at_px=MIDDLE_PX - BELOW_TIP_PX,
                centre_px=0.4,
                tilt_deg=(-lean_deg, lean_deg),
                frame=FRAME,
            )
            yield Frame(render(scene, film.camera, rng), index, time_s + film.late_s)

    write_clip(folder / "film.mkv", frames(), FFV1)
