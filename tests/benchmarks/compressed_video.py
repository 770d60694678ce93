"""Error and coverage of the gap in compressed recordings of fingers that stand upright or lean a little.

    python -m tests.benchmarks.compressed_video [--clips 40] [--seed 1] [--only CLASS...]

An edge that runs along a codec's blocks gets one error in all its rows. The recordings are drawn by code of their own
(exact integrals of blurred bars, nothing of the product's renderer), coded and decoded, and four pictures of each are
measured, far apart. A class is a codec with its bit rate and how far the fingers lean; motion, preset, blur, noise,
contrast and scale are random. `scores` explains the columns; within one and two u of both parts together must be 68 and
95 % of the errors.
"""

import io
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import cos, sin, tan
from tempfile import NamedTemporaryFile

import av
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from fingervision.domain.direction import Direction
from fingervision.domain.frame import Coding, Frame
from fingervision.frames.video_file import VideoFile
from fingervision.vision.pipeline import LINEAR_CAMERA, Settings
from tests.benchmarks.frame import Namespace, benchmark
from tests.benchmarks.scores import Scores, print_classes
from tests.clips import opened_to_write

Floats = NDArray[np.float64]
WIDTH, HEIGHT, FRAMES = 640, 480, 16
MEASURED = (1, 5, 10, 15)
# Gauss-Legendre nodes and weights over a pixel.
NODES, WEIGHTS = np.array([-0.5, 0.0, 0.5]) * 0.6**0.5, np.array([5.0, 8.0, 5.0]) / 18.0


@dataclass(frozen=True)
class Bar:
    """A half-infinite finger with square corners: middle of its end, width, and how far it leans (radians)."""

    x_px: float
    y_px: float
    width_px: float
    lean_rad: float

    def covered(self, sigma: float) -> Floats:
        """Share of every pixel that the bar covers, blurred by a Gaussian."""
        c, s = cos(self.lean_rad), sin(self.lean_rad)
        x, y = np.arange(WIDTH) - self.x_px, np.arange(HEIGHT)[:, None] - self.y_px
        u, v = c * x + s * y, c * y - s * x
        reach, away = 6.0 * sigma + 1.0, np.abs(u) - 0.5 * self.width_px
        near = (np.minimum(np.abs(away), np.abs(v)) < reach) & (away < reach) & (v > -reach)
        share = ((away < 0.0) & (v > 0.0)).astype(np.float64)
        u, v = u[near], v[near]
        total = np.zeros(u.size)
        for i, wi in zip(NODES, WEIGHTS, strict=True):
            for j, wj in zip(NODES, WEIGHTS, strict=True):
                uu, vv = u + c * i + s * j, v + c * j - s * i
                along = ndtr((uu + 0.5 * self.width_px) / sigma) - ndtr((uu - 0.5 * self.width_px) / sigma)
                total += wi * wj * along * ndtr(vv / sigma)
        share[near] = total
        return share

    def tip(self) -> float:
        return self.y_px - abs(sin(self.lean_rad)) * 0.5 * self.width_px

    def inner(self, height: float, side: float) -> float:
        """Where the flank towards `side` crosses a row."""
        return self.x_px + side * 0.5 * self.width_px / cos(self.lean_rad) - tan(self.lean_rad) * (height - self.y_px)


def gap_between(left: Bar, right: Bar, below_px: float) -> tuple[float, float, float]:
    """Distance of the inner edges, and where each is across."""
    heights = left.tip() + below_px, right.tip() + below_px
    inner = left.inner(heights[0], 1.0), right.inner(heights[1], -1.0)
    return (float(np.hypot(inner[1] - inner[0], heights[1] - heights[0])), *inner)


@dataclass(frozen=True)
class Kind:
    """A codec with its options; `speed` names the option that holds its effort, and the efforts to choose from."""

    codec: str
    container: str
    coding: Coding
    speed: tuple[str, tuple[str, ...]] = ("preset", ())
    options: tuple[tuple[str, str], ...] = ()
    pix_fmt: str = "yuv420p"


PRESETS = ("preset", ("ultrafast", "veryfast", "medium", "slow"))
KINDS = {
    "h264": Kind("libx264", "matroska", Coding.INTERFRAME, PRESETS),
    "hevc": Kind("libx265", "matroska", Coding.INTERFRAME, PRESETS, (("x265-params", "log-level=none"),)),
    "mpeg4": Kind("mpeg4", "matroska", Coding.INTERFRAME),
    "vp9": Kind("libvpx-vp9", "matroska", Coding.INTERFRAME, ("cpu-used", ("4", "8")), (("deadline", "realtime"),)),
    "av1": Kind("libsvtav1", "matroska", Coding.INTERFRAME, ("preset", ("8", "12"))),
    "mjpeg": Kind("mjpeg", "matroska", Coding.INTRAFRAME, pix_fmt="yuvj420p"),
    "lossless": Kind("ffv1", "matroska", Coding.LOSSLESS, pix_fmt="gray"),
}


@dataclass(frozen=True)
class Shot:
    """One decoded picture with its truth."""

    frame: Frame
    truth: tuple[float, float, float]
    below_px: float
    about: str

    @property
    def gap_px(self) -> float:
        """How far the inner edges truly are apart."""
        return self.truth[0]


def clip(
    rng: np.random.Generator, kind: Kind, bit_rate: int, lean_deg: float, is_resaved: bool = False
) -> Iterator[Shot]:
    """Draw, code and decode one recording."""
    scale = float(rng.choice([34.0, 34.0, 20.0, 60.0]))
    below, sigma, noise = 0.3 * scale, rng.uniform(0.7, 1.5), rng.uniform(0.7, 3.0)
    # Not whole multiples of the quarter pixel by which codecs shift blocks: those would be copied without an error.
    speed = float(rng.choice([0.0, 0.1, 0.5, 1.0, 3.0]) * rng.choice([-1.0, 1.0]) * rng.uniform(0.7, 1.3))
    ground, finger = rng.uniform(150.0, 215.0), rng.uniform(20.0, 60.0)
    start, width = rng.uniform(100.0, 240.0), rng.uniform(70.0, 120.0)
    middle, tips = rng.uniform(300.0, 340.0), rng.uniform(110.0, 190.0)
    # Fingers that lean apart have their inner corners on top, so that the measuring height meets the inner flanks.
    leans = -np.radians(lean_deg), np.radians(lean_deg)
    if lean_deg < 1.5:
        leans = leans[int(rng.integers(2))], leans[int(rng.integers(2))]
    slope = rng.uniform(-0.05, 0.05, 2)
    light = 1.0 + slope[0] * (np.arange(WIDTH) / WIDTH - 0.5) + slope[1] * (np.arange(HEIGHT)[:, None] / HEIGHT - 0.5)
    truth, buffer, options = [], io.BytesIO(), dict(kind.options)
    if kind.speed[1]:
        options[kind.speed[0]] = str(rng.choice(kind.speed[1]))
    with opened_to_write(buffer, kind.container) as container:
        stream = container.add_stream(kind.codec, rate=25, options=options)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, kind.pix_fmt
        if bit_rate:
            stream.bit_rate = bit_rate
        for k in range(FRAMES):
            gap = start + speed * k
            left = Bar(middle - 0.5 * (gap + width), tips, width, leans[0])
            right = Bar(middle + 0.5 * (gap + width), tips + 0.7, width, leans[1])
            truth.append(gap_between(left, right, below))
            covered = np.minimum(left.covered(sigma) + right.covered(sigma), 1.0)
            seen = (ground + (finger - ground) * covered) * light
            seen += noise * rng.standard_normal((HEIGHT, WIDTH), dtype=np.float32)
            pixels = np.clip(np.rint(seen), 0, 255).astype(np.uint8)
            # The grey levels are the luma, as a camera's are: no change of range.
            picture = av.VideoFrame(WIDTH, HEIGHT, kind.pix_fmt)
            for number, plane in enumerate(picture.planes):
                rows = np.full((plane.height, plane.line_size), 128, dtype=np.uint8)
                if number == 0:
                    rows[:, :WIDTH] = pixels
                plane.update(rows.tobytes())
            picture.pts = k
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))
    effort = options.get(kind.speed[0], "")
    about = f"{kind.codec} {effort} {speed:+.3f} px a frame, blur {sigma:.2f}, noise {noise:.1f}, {scale:.0f} px/mm"
    with NamedTemporaryFile(suffix=".mkv") as file:
        file.write(buffer.getbuffer())
        file.flush()
        for k, frame in enumerate(VideoFile(file.name)):
            if k in MEASURED and isinstance(frame, Frame):
                if is_resaved:
                    frame = Frame(frame.pixels, k)
                yield Shot(replace(frame, pixels=frame.pixels.copy()), truth[k], below, about)


LEANS = {"upright": (0.0, 0.0), "lean-1": (0.3, 1.5), "lean-3": (1.5, 4.0), "lean-10": (4.0, 10.0)}
MBIT = 1_000_000
BOTH = ("upright", "lean-3")
# Codec, bits a second, how the fingers lean; and whether the pictures are given without what the stream says of them.
CLASSES: dict[str, tuple[str, int, str, bool]] = {
    f"{name}-{rate / MBIT:g}-{lean}": (name.removesuffix("-resaved"), round(rate), lean, name.endswith("-resaved"))
    for name, rates, leans in (
        ("h264", (0.5 * MBIT, 1 * MBIT, 2 * MBIT, 4 * MBIT, 8 * MBIT), tuple(LEANS)),
        ("hevc", (1 * MBIT, 4 * MBIT), BOTH),
        ("mpeg4", (1 * MBIT, 4 * MBIT), BOTH),
        ("vp9", (1 * MBIT, 4 * MBIT), BOTH),
        ("av1", (1 * MBIT, 4 * MBIT), BOTH),
        ("mjpeg", (8 * MBIT, 25 * MBIT), BOTH),
        ("h264-resaved", (1 * MBIT, 4 * MBIT), BOTH),
        ("lossless", (0,), BOTH),
    )
    for rate in rates
    for lean in leans
}


def shots(name: str, clips: int, seed: int) -> Iterator[Shot]:
    kind, rate, lean, is_resaved = CLASSES[name]
    rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
    for _ in range(clips):
        yield from clip(rng, KINDS[kind], rate, float(rng.uniform(*LEANS[lean])), is_resaved)


def scored(name: str, clips: int, seed: int) -> Scores:
    scores = Scores()
    for shot in shots(name, clips, seed):
        scores.measure(shot.frame, Settings(shot.below_px, Direction.UP, camera=LINEAR_CAMERA), shot.gap_px)
    return scores


@benchmark(clips=40, seed=1, only={"nargs": "*", "choices": list(CLASSES)})
def main(options: Namespace) -> None:
    """Print the table."""
    print_classes(options.only or CLASSES, lambda name: scored(name, options.clips, options.seed))
