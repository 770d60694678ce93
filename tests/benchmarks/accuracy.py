"""Error and coverage of the gap on rendered fingers, class by class.

    python -m tests.benchmarks.accuracy [--frames 200] [--seed 1] [--only NAME]

Every class draws its frames at random: sub-pixel positions uniform, everything else as the class says. `scores`
explains the columns; within one and two of the stated `u_gap_px` must be 68 and 95 % of the errors.
"""

import io
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from tempfile import NamedTemporaryFile

import av
import cv2
import numpy as np

from fingervision.domain.direction import Direction
from fingervision.domain.frame import Coding, Frame, Pixels
from fingervision.domain.quantiser import Quantiser
from fingervision.frames.video_file import VideoFile
from fingervision.rendering import Camera, Light, Scene, SquareTip, render, truth, two_fingers
from fingervision.vision.pipeline import Settings
from tests.benchmarks.frame import Namespace, benchmark
from tests.benchmarks.scores import Scores, print_classes

PX_PER_MM = 34.0
BELOW_PX = 0.3 * PX_PER_MM


@dataclass(frozen=True)
class Case:
    """One frame with its truth."""

    pixels: Pixels
    gap_px: float
    coding: Coding = Coding.LOSSLESS
    quantiser: Quantiser | None = None


def gap_of(scene: Scene, camera: Camera) -> float:
    found = truth(scene, camera, BELOW_PX)
    return found.gap_px  # type: ignore[union-attr]


def one(rng: np.random.Generator, camera: Camera, light: Light | None = None, **shape: object) -> Case:
    options: dict = {
        "gap_px": rng.uniform(60, 300),
        "centre_px": rng.uniform(-3, 3),
        "tip_at_px": rng.uniform(100, 160),
    }
    options.update(shape)
    scene = two_fingers(light=light or Light(), **options)
    return Case(render(scene, camera, rng), gap_of(scene, camera))


def straight(rng: np.random.Generator) -> Case:
    return one(rng, Camera(blur_px=0.9, noise_grey=2.0))


def rounded(rng: np.random.Generator) -> Case:
    return one(rng, Camera(blur_px=0.9, noise_grey=2.0), radius_px=rng.uniform(0.5, 1.4) * PX_PER_MM)


def rounded_blur_3(rng: np.random.Generator) -> Case:
    return one(rng, Camera(blur_px=3.0, noise_grey=2.0), radius_px=rng.uniform(0.5, 1.4) * PX_PER_MM)


def mixed_parts(rng: np.random.Generator) -> tuple[Camera, dict]:
    camera = Camera(blur_px=rng.uniform(0.7, 2.5), noise_grey=rng.uniform(1, 6))
    shape = {
        "tilt_deg": (rng.uniform(-8, 8), rng.uniform(-8, 8)),
        "radius_px": rng.uniform(0.3, 1.4) * PX_PER_MM,
        "light": Light(slope_x=rng.uniform(-0.4, 0.4), slope_y=rng.uniform(-0.4, 0.4)),
    }
    return camera, shape


def specks(pixels: Pixels, number: int, rng: np.random.Generator) -> Pixels:
    dusty = pixels.copy()
    height, width = pixels.shape[:2]
    for _ in range(number):
        x, y = rng.integers(0, width), rng.integers(0, height)
        cv2.circle(
            dusty, (int(x), int(y)), int(rng.integers(1, 4)), float(rng.choice([30, 60, 90, 230])), -1, cv2.LINE_AA
        )
    return dusty


def mixed(rng: np.random.Generator) -> Case:
    camera, shape = mixed_parts(rng)
    case = one(rng, camera, **shape)
    return replace(case, pixels=specks(case.pixels, int(rng.integers(0, 31)), rng))


def blur(rng: np.random.Generator) -> Case:
    return one(rng, Camera(blur_px=rng.uniform(0.5, 3.0), noise_grey=2.0), radius_px=rng.uniform(0.3, 1.4) * PX_PER_MM)


def noise(rng: np.random.Generator) -> Case:
    return one(rng, Camera(blur_px=0.9, noise_grey=rng.uniform(1, 10)), radius_px=rng.uniform(0.3, 1.4) * PX_PER_MM)


def tilt(rng: np.random.Generator) -> Case:
    return one(
        rng,
        Camera(blur_px=0.9, noise_grey=2.0),
        tilt_deg=(rng.uniform(-10, 10), rng.uniform(-10, 10)),
        radius_px=rng.uniform(0.3, 1.4) * PX_PER_MM,
    )


def small_radius(rng: np.random.Generator) -> Case:
    return one(rng, Camera(blur_px=rng.uniform(0.7, 1.5), noise_grey=2.0), radius_px=rng.uniform(0.0, 0.6) * PX_PER_MM)


def slanted(rng: np.random.Generator) -> Case:
    tip = SquareTip(rng.uniform(0, 0.6) * PX_PER_MM, rng.uniform(-20, 20))
    return one(rng, Camera(blur_px=0.9, noise_grey=2.0), tip=tip)


def tilted_sharp(rng: np.random.Generator) -> Case:
    return one(
        rng, Camera(blur_px=rng.uniform(0.7, 2), noise_grey=2.0), tilt_deg=(rng.uniform(-10, 10), rng.uniform(-10, 10))
    )


def dust(rng: np.random.Generator) -> Case:
    case = one(rng, Camera(blur_px=0.9, noise_grey=2.0), radius_px=rng.uniform(0.3, 1.4) * PX_PER_MM)
    return replace(case, pixels=specks(case.pixels, 30, rng))


def small_gap(rng: np.random.Generator) -> Case:
    return one(
        rng, Camera(blur_px=0.9, noise_grey=2.0), radius_px=rng.uniform(0.3, 1.4) * PX_PER_MM, gap_px=rng.uniform(4, 25)
    )


def turned(rng: np.random.Generator) -> Case:
    direction = list(Direction)[rng.integers(4)]
    shape = {"tip_at_px": None, "direction": direction, "gap_px": rng.uniform(20, 200)}
    return one(rng, Camera(blur_px=0.9, noise_grey=2.0), radius_px=rng.uniform(0.3, 1.4) * PX_PER_MM, **shape)


def jpeg(rng: np.random.Generator) -> Case:
    camera = Camera(blur_px=rng.uniform(0.7, 1.5), noise_grey=rng.uniform(1, 4))
    case = one(rng, camera, radius_px=rng.uniform(0.3, 1.4) * PX_PER_MM)
    _, coded = cv2.imencode(".jpg", case.pixels, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(70, 96))])
    return Case(cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE), case.gap_px, Coding.INTRAFRAME)


def h264_clips(rng: np.random.Generator) -> Iterator[Case]:
    """Clips of a gripper that moves."""
    while True:
        radius, bit_rate = rng.uniform(0.3, 1.4) * PX_PER_MM, int(rng.choice([1, 2, 5, 8])) * 1_000_000
        camera = Camera(blur_px=rng.uniform(0.7, 1.5), noise_grey=rng.uniform(1, 4))
        start, speed = rng.uniform(60, 200), rng.uniform(-3, 3)
        gaps, buffer = [], io.BytesIO()
        with av.open(buffer, "w", format="matroska") as container:
            stream = container.add_stream("libx264", rate=25)
            stream.width, stream.height, stream.pix_fmt, stream.bit_rate = 640, 480, "yuv420p", bit_rate
            for k in range(25):
                scene = two_fingers(gap_px=start + speed * k, radius_px=radius, centre_px=0.1 * k, tip_at_px=130.3)
                gaps.append(getattr(truth(scene, camera, BELOW_PX), "gap_px", None))
                pixels = render(scene, camera, rng)
                container.mux(
                    stream.encode(av.VideoFrame.from_ndarray(pixels, format="gray").reformat(format="yuv420p"))
                )
            container.mux(stream.encode(None))
        with NamedTemporaryFile(suffix=".mkv") as file:
            file.write(buffer.getbuffer())
            file.flush()
            for frame, gap in zip(VideoFile(file.name), gaps, strict=True):
                if gap is not None and isinstance(frame, Frame):
                    yield Case(frame.pixels.copy(), gap, frame.coding, frame.quantiser)


SINGLE: dict[str, Callable[[np.random.Generator], Case]] = {
    f.__name__: f
    for f in (
        straight, rounded, rounded_blur_3, mixed, blur, noise, tilt, small_radius, slanted, tilted_sharp, dust,
        small_gap, turned, jpeg,
    )
}  # fmt: skip


def cases(name: str, rng: np.random.Generator) -> Iterator[Case]:
    if name == "h264":
        yield from h264_clips(rng)
    while True:
        yield SINGLE[name](rng)


def scored(name: str, frames: int, seed: int) -> Scores:
    source, scores = cases(name, np.random.default_rng([seed, sum(map(ord, name))])), Scores()
    settings = Settings(BELOW_PX, None if name == "turned" else Direction.UP)
    for number, case in zip(range(frames), source, strict=False):
        frame = Frame(case.pixels, number, coding=case.coding, quantiser=case.quantiser)
        scores.measure(frame, settings, case.gap_px)
    return scores


@benchmark(frames=200, seed=1, only={"nargs": "*"})
def main(options: Namespace) -> None:
    """Print the table."""
    print_classes(options.only or [*SINGLE, "h264"], lambda name: scored(name, options.frames, options.seed))
