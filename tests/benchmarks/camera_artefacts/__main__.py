"""Error and coverage of the gap on what real cameras deliver, class by class.

    python -m tests.benchmarks.camera_artefacts [--frames 400] [--seed 1] [--only NAME...] [--told]

Columns: RMS and mean of the error of `gap_px`, its largest; median stated `u_gap_px`; median `u_shift_px` (the
picture's own systematic part); share of errors within 2 u by the random part alone, and by both parts together; share
beyond 0.25 px and beyond 2 u (wrong and not said); refused frames with their statuses. With --told the measuring is
given the camera's transfer curve, as `--response` does.
"""

import zlib
from dataclasses import replace

import numpy as np

from calib.camera_response import CameraResponse
from fingervision.domain.camera import stated_camera
from fingervision.domain.direction import Direction
from fingervision.domain.frame import Coding, Frame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.vision.pipeline import Settings, measure_frame
from tests.benchmarks.camera_artefacts.classes import BELOW_PX, CLASSES, Shot
from tests.benchmarks.options import options_of

LEVELS = np.linspace(0.0, 1.0, 256)
RESPONSES = {
    "linear": CameraResponse("linear", LEVELS, LEVELS),
    "power": CameraResponse("power of 2.2", LEVELS, LEVELS**2.2),
}


def measured(shot: Shot, told: bool) -> GapMeasurement | NoGap:
    coding = Coding.INTRAFRAME if shot.is_jpeg else Coding.LOSSLESS
    settings = Settings(BELOW_PX, Direction.UP)
    if told:
        settings = replace(settings, camera=stated_camera(RESPONSES[shot.transfer]))
    return measure_frame(Frame(shot.picture, 0, coding=coding), settings)


def line(name: str, frames: int, seed: int, told: bool) -> str:
    rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
    found, lost = [], {}
    for _ in range(frames):
        shot = CLASSES[name](rng)
        outcome = measured(shot, told)
        if isinstance(outcome, GapMeasurement):
            found.append((outcome.gap_px - shot.gap_px, outcome.u_gap_px, outcome.u_picture_px))
        else:
            lost[str(outcome.status)] = lost.get(str(outcome.status), 0) + 1
    if not found:
        return f"{name:18s}     0 {lost}"
    error, u, shift = np.array(found).T
    both = np.hypot(u, shift)
    unsaid = (np.abs(error) > 0.25) & (np.abs(error) > 2.0 * both)
    return (
        f"{name:18s} {len(error):5d} {np.sqrt(np.mean(error**2)):8.4f} {error.mean():+8.4f} {np.abs(error).max():8.3f} "
        f"{np.median(u):8.4f} {np.median(shift):8.4f} {100 * np.mean(np.abs(error) < 2 * u):6.1f} "
        f"{100 * np.mean(np.abs(error) < 2 * both):6.1f} {100 * np.mean(unsaid):6.1f} {lost or ''}"
    )


def main() -> None:
    options = options_of(
        __doc__,
        frames=400,
        seed=1,
        only={"nargs": "*", "choices": list(CLASSES)},
        told={"action": "store_true", "help": "the measuring knows the camera's transfer curve"},
    )
    print("class              frames   RMS px   mean px   max px median u  u shift  <2u %  both % unsaid%  refused")
    for name in options.only or CLASSES:
        print(line(name, options.frames, options.seed, options.told), flush=True)


if __name__ == "__main__":
    main()
