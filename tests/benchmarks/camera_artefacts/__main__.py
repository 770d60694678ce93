"""Error and coverage of the gap on what real cameras deliver, class by class.

    python -m tests.benchmarks.camera_artefacts [--frames 400] [--seed 1] [--only NAME...] [--told]

`tests.benchmarks.scores` explains the columns. With --told the measuring is given the camera's transfer curve, as
`--response` does.
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
from tests.benchmarks.scores import Scores, print_classes

LEVELS = np.linspace(0.0, 1.0, 256)
RESPONSES = {
    "linear": CameraResponse("linear", LEVELS, LEVELS),
    "power": CameraResponse("power of 2.2", LEVELS, LEVELS**2.2),
}


def scored(name: str, frames: int, seed: int, told: bool) -> Scores:
    """Measure frames of a class."""
    rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
    of = Scores()
    for _ in range(frames):
        shot = CLASSES[name](rng)
        settings = Settings(BELOW_PX, Direction.UP)
        if told:
            settings = replace(settings, camera=stated_camera(RESPONSES[shot.transfer]))
        coding = Coding.INTRAFRAME if shot.is_jpeg else Coding.LOSSLESS
        of.measure(Frame(shot.picture, 0, coding=coding), settings, shot.gap_px)
    return of


@benchmark(
    frames=400,
    seed=1,
    only={"nargs": "*", "choices": list(CLASSES)},
    told={"action": "store_true", "help": "the measuring knows the camera's transfer curve"},
)
def main(options: Namespace) -> None:
    """Print the table."""
    print_classes(options.only or CLASSES, lambda name: scored(name, options.frames, options.seed, options.told))
