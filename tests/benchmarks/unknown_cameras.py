"""Error and coverage of the gap over recordings of cameras about which nothing is stated, class by class.

    python -m tests.benchmarks.unknown_cameras [--recordings 8] [--frames 20] [--seed 1] [--only NAME...]

Every recording is measured as `measure --px-per-mm` does, without any option. Fingers, optics and cameras are drawn
here and in `camera_artefacts`, and share nothing with the product. The light of a recording is the same for all
classes, so that classes differ by their cameras alone. Columns: RMS of the error of `gap_px`; RMS of the recordings'
mean errors; median expanded uncertainty (k = 2) from both parts; its ratio to the RMS error; share of errors within
2 u; share beyond 0.25 px and beyond 2 u (wrong and not said); frames without a gap; responses that the recordings were
measured with.
"""

import io
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import av
import cv2
import numpy as np
from numpy.typing import NDArray

from calib.calibration import BareScale
from fingervision.domain.direction import Direction
from fingervision.domain.frame import Coding, Frame
from fingervision.frames.source import Description
from fingervision.measuring.in_memory import measure_in_memory
from fingervision.measuring.task import Task
from tests.benchmarks.camera_artefacts.classes import BELOW_PX, SIZE_PX, gripper
from tests.benchmarks.camera_artefacts.optics import Surface, light_on_sensor
from tests.benchmarks.camera_artefacts.scene import true_gap
from tests.benchmarks.frame import Namespace, benchmark
from tests.benchmarks.scores import Scores, percent, rms

Floats = NDArray[np.float64]
Pictures = list[NDArray[np.uint8]]
Curve = Callable[[Floats], Floats]

PX_PER_MM = 34.0


def srgb(light: Floats) -> Floats:
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055)


def bt709(light: Floats) -> Floats:
    return np.where(light < 0.018, 4.5 * light, 1.099 * np.maximum(light, 1e-9) ** 0.45 - 0.099)


def log_profile(light: Floats) -> Floats:
    """Curve of a camera's log profile: logarithm of the light above an offset."""
    return np.asarray(0.09 + 0.85 * np.log1p(60.0 * light) / np.log1p(60.0))


def shoulder(light: Floats) -> Floats:
    """Filmic tone curve (Hable 2010, the film curve of Uncharted 2), with a display's gamma."""

    def film(x: Floats | float) -> Floats:
        a, b, c, d, e, f = 0.22, 0.30, 0.10, 0.20, 0.01, 0.30
        return np.asarray((x * (a * x + c * b) + d * e) / (x * (a * x + b) + d * f) - e / f)

    return np.asarray((film(4.0 * light) / film(4.0)) ** (1.0 / 2.2))


def s_curve(light: Floats) -> Floats:
    """A phone's contrast curve: sRGB levels, mixed half and half with a smooth step."""
    v = srgb(light)
    return np.asarray(0.5 * v + 0.5 * v * v * (3.0 - 2.0 * v))


CURVES: dict[str, Curve] = {
    "linear": lambda light: light,
    "srgb": srgb,
    "bt709": bt709,
    "power-2.2": lambda light: np.asarray(light ** (1 / 2.2)),
    "power-1.5": lambda light: np.asarray(light ** (1 / 1.5)),
    "log": log_profile,
    "shoulder": shoulder,
    "s-curve": s_curve,
}


@dataclass(frozen=True)
class Recording:
    """Light on the sensor in every frame, with the true gap."""

    light: tuple[Floats, ...]
    gap_px: tuple[float, ...]
    seed: int


@dataclass(frozen=True)
class Film:
    """Pictures with their coding, as a frame source."""

    pictures: tuple[NDArray[np.uint8], ...]
    coding: Coding

    @property
    def description(self) -> Description:
        height, width = self.pictures[0].shape[:2]
        return Description("drawn", "images", "raw", self.coding, width, height, 25.0, True, len(self.pictures))

    def __iter__(self) -> Iterator[Frame]:
        for index, picture in enumerate(self.pictures):
            yield Frame(picture, index, 0.04 * index, self.coding)


def drawn(seed: int, frames: int, surface: Surface = Surface(), blur_px: float | None = None) -> Recording:  # noqa: B008
    rng = np.random.default_rng([seed, 7])
    left, right = gripper(rng)
    surface = replace(surface, ground=rng.uniform(0.55, 0.8), finger=rng.uniform(0.02, 0.12))
    sigma = blur_px or rng.uniform(0.8, 1.4)
    rates = rng.uniform(-0.3, 0.3, 2)
    light, gaps = [], []
    for k in range(frames):
        pair = tuple(
            replace(finger, across_px=finger.across_px + rate * k)
            for finger, rate in zip((left, right), rates, strict=True)
        )
        light.append(light_on_sensor(pair, surface, sigma, SIZE_PX, rng))
        gaps.append(true_gap(*pair, BELOW_PX))
    return Recording(tuple(light), tuple(gaps), seed)


def exposed(light: Floats, rng: np.random.Generator) -> Floats:
    """Shot noise of 8000 electrons at full scale, and read noise of 12 electrons."""
    sigma = np.sqrt(np.maximum(light, 0.0) / 8000.0 + (12.0 / 8000.0) ** 2)
    return np.asarray(np.clip(light + sigma * rng.standard_normal(light.shape), 0.0, 1.0))


def stored(levels: Floats) -> NDArray[np.uint8]:
    return np.clip(np.rint(255.0 * levels), 0, 255).astype(np.uint8)


def lossless(recording: Recording, curve: Curve) -> Film:
    rng = np.random.default_rng([recording.seed, 11])
    return Film(tuple(stored(curve(exposed(light, rng))) for light in recording.light), Coding.LOSSLESS)


def jpeg(recording: Recording, curve: Curve, quality: int = 85, amount: float = 0.0) -> Film:
    rng = np.random.default_rng([recording.seed, 11])
    pictures = []
    for light in recording.light:
        levels = curve(exposed(light, rng))
        if amount:
            levels = levels + amount * (levels - cv2.GaussianBlur(levels, (0, 0), 1.0))
        _, coded = cv2.imencode(".jpg", stored(levels), [cv2.IMWRITE_JPEG_QUALITY, quality])
        pictures.append(cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE))
    return Film(tuple(pictures), Coding.INTRAFRAME)


def h264(recording: Recording, curve: Curve, crf: int = 20) -> Film:
    pictures = lossless(recording, curve).pictures
    buffer = io.BytesIO()
    with av.open(buffer, "w", format="matroska") as container:
        stream = container.add_stream("libx264", rate=25, options={"crf": str(crf), "preset": "medium", "threads": "1"})
        stream.height, stream.width = pictures[0].shape
        stream.pix_fmt = "yuv420p"
        for picture in pictures:
            frame = av.VideoFrame.from_ndarray(picture, format="gray").reformat(
                format="yuv420p", src_color_range=2, dst_color_range=2
            )
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    buffer.seek(0)
    with av.open(buffer) as container:
        seen = tuple(frame.to_ndarray()[: pictures[0].shape[0]] for frame in container.decode(video=0))
    return Film(tuple(np.ascontiguousarray(picture) for picture in seen), Coding.INTERFRAME)


def coma(recording: Recording, curve: Curve) -> Film:
    """Light that a lens smears to the right."""
    kernel = np.array([[0.0, 0.0, 0.0, 0.72, 0.18, 0.07, 0.03]])
    smeared = tuple(
        cv2.filter2D(light, -1, kernel[:, ::-1], borderType=cv2.BORDER_REPLICATE) for light in recording.light
    )
    centre = float((kernel[0] * np.arange(-3, 4)).sum())
    moved = np.array([[1.0, 0.0, -centre], [0.0, 1.0, 0.0]])
    size = recording.light[0].shape[::-1]
    back = tuple(
        cv2.warpAffine(light, moved, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE) for light in smeared
    )
    return lossless(replace(recording, light=back), curve)


def defocused(recording: Recording, curve: Curve) -> Film:
    """Disc of 2.5 px radius."""
    y, x = np.mgrid[-3:4, -3:4]
    disc = np.clip(3.0 - np.hypot(x, y), 0.0, 1.0)
    blurred = tuple(
        cv2.filter2D(light, -1, disc / disc.sum(), borderType=cv2.BORDER_REPLICATE) for light in recording.light
    )
    return lossless(replace(recording, light=blurred), curve)


def noise_reduced(recording: Recording, curve: Curve, share: float) -> Film:
    """Recursive noise reduction over time: each picture has this share of the one before; the fingers were at rest."""
    rng = np.random.default_rng([recording.seed, 11])
    kept, pictures = curve(exposed(recording.light[0], rng)), []
    for light in (*[recording.light[0]] * 20, *recording.light):
        kept = share * kept + (1.0 - share) * curve(exposed(light, rng))
        pictures.append(stored(kept))
    return Film(tuple(pictures[20:]), Coding.LOSSLESS)


def with_column(recording: Recording, curve: Curve, level: int) -> Film:
    """A dead or hot column of the sensor, across the left finger's inner edge in the first frame."""
    film = lossless(recording, curve)
    row = recording.light[0][int(0.6 * recording.light[0].shape[0])]
    is_dark = row < 0.5 * (row.min() + row.max())
    column = int(np.flatnonzero(np.diff(is_dark.astype(int)) < 0)[0])
    for picture in film.pictures:
        picture[:, column] = level
    return film


CLASSES: dict[str, Callable[[Recording], Film]] = {
    **{name: partial(lossless, curve=curve) for name, curve in CURVES.items()},
    "linear-coma": partial(coma, curve=CURVES["linear"]),
    "srgb-coma": partial(coma, curve=srgb),
    "linear-defocus": partial(defocused, curve=CURVES["linear"]),
    "srgb-defocus": partial(defocused, curve=srgb),
    "linear-h264": partial(h264, curve=CURVES["linear"]),
    "srgb-h264": partial(h264, curve=srgb),
    "bt709-h264": partial(h264, curve=bt709),
    "linear-jpeg": partial(jpeg, curve=CURVES["linear"]),
    "srgb-jpeg": partial(jpeg, curve=srgb),
    "linear-noise-reduced": partial(noise_reduced, curve=CURVES["linear"], share=0.8),
    "linear-dead-column": partial(with_column, curve=CURVES["linear"], level=0),
    "linear-hot-column": partial(with_column, curve=CURVES["linear"], level=255),
    "srgb-hot-column": partial(with_column, curve=srgb, level=255),
    "phone": partial(jpeg, curve=s_curve, amount=0.5),
}
SURFACES = {
    "": Surface(),
    "shadow": Surface(shadow=0.2),
    "narrow-wall": Surface(wall_px=1.0),
    "wall": Surface(wall_px=2.0),
    "glare": Surface(glare=0.4),
}


def row(name: str, recordings: Sequence[Recording], camera: Callable[[Recording], Film]) -> str:
    of, means, responses = Scores(), [], Counter[str]()
    task = Task(BareScale(PX_PER_MM), below_tip_mm=BELOW_PX / PX_PER_MM, direction=Direction.UP)
    for recording in recordings:
        found, before = measure_in_memory(camera(recording), task), len(of.found)
        responses[str(found.summary["settings"]["response"])] += 1
        for result, gap_px in zip(found.results, recording.gap_px, strict=True):
            of.take(result.outcome, gap_px)
        means += [np.mean([each[0] for each in of.found[before:]])] if len(of.found) > before else []
    lost = sum(of.lost.values())
    if not of.found:
        return f"{name:16s} {lost} refused"
    twice = 2.0 * of.u
    return (
        f"{name:16s} {rms(of.error):7.4f} {rms(np.array(means)):8.4f} {np.median(twice):7.4f} "
        f"{np.median(twice) / rms(of.error):6.1f} {percent(np.abs(of.error) < twice):6.1f} {of.unsaid:7.1f} {lost:5d}  "
        f"{dict(responses)}"
    )


@benchmark(
    recordings=8,
    frames=20,
    seed=1,
    only={"nargs": "*", "choices": list(CLASSES)},
    surface={"choices": list(SURFACES), "default": "", "help": "what lies beside the edges"},
)
def main(options: Namespace) -> None:
    recordings = [
        drawn(1000 * options.seed + k, options.frames, SURFACES[options.surface]) for k in range(options.recordings)
    ]
    print("class             RMS px  of means   U px  U/RMS   <2u %  silent%  lost  responses")
    for name in options.only or CLASSES:
        print(row(name, recordings, CLASSES[name]), flush=True)
