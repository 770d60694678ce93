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
from fingervision.vision.pipeline import Settings
from tests.benchmarks.camera_artefacts.classes import BELOW_PX, CLASSES
from tests.benchmarks.frame import Namespace, benchmark
from tests.benchmarks.scores import Scores, percent, rms

LEVELS = np.linspace(0.0, 1.0, 256)
RESPONSES = {
    "linear": CameraResponse("linear", LEVELS, LEVELS),
    "power": CameraResponse("power of 2.2", LEVELS, LEVELS**2.2),
}


def line(name: str, frames: int, seed: int, told: bool) -> str:
    rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
    of = Scores()
    for _ in range(frames):
        shot = CLASSES[name](rng)
        settings = Settings(BELOW_PX, Direction.UP)
        if told:
            settings = replace(settings, camera=stated_camera(RESPONSES[shot.transfer]))
        coding = Coding.INTRAFRAME if shot.is_jpeg else Coding.LOSSLESS
        of.measure(Frame(shot.picture, 0, coding=coding), settings, shot.gap_px)
    if not of.found:
        return f"{name:18s}     0 {of.refused}"
    error, u, shift = of.columns
    off = np.abs(error)
    return (
        f"{name:18s} {len(error):5d} {rms(error):8.4f} {error.mean():+8.4f} {off.max():8.3f} {np.median(u):8.4f} "
        f"{np.median(shift):8.4f} {percent(off < 2 * u):6.1f} {percent(off < 2 * of.u):6.1f} {of.unsaid:6.1f} "
        f"{of.refused}"
    )


@benchmark(
    frames=400,
    seed=1,
    only={"nargs": "*", "choices": list(CLASSES)},
    told={"action": "store_true", "help": "the measuring knows the camera's transfer curve"},
)
def main(options: Namespace) -> None:
    print("class              frames   RMS px   mean px   max px median u  u shift  <2u %  both % unsaid%  refused")
    for name in options.only or CLASSES:
        print(line(name, options.frames, options.seed, options.told), flush=True)
