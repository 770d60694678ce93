"""Recordings with variable rate and jitter, in which nothing is hidden: neither damage nor an effect may be seen.

Run as `python -m tests.benchmarks.uneven_times [--recordings 100] [--minutes 30] [--seed 1] [--first 0] [--only phone]
[--verbose]` from the top. The frames of a moving gripper are rendered at uneven instants (a phone with +-4 ms of
jitter, a camera that halves its rate in the dark, one that leaves frames out, one whose rate wanders, and 120 Hz with
stamps of a millisecond), coded as H.264 in MP4, FFV1 or Motion JPEG in Matroska, measured with a log of the stage on
another clock, and diagnosed with the model from which the frames were drawn. Printed for each kind: recordings, frames,
frames called damaged (must be 0), clocks that are not determined, and verdicts; `agrees` or `unknown` must be 95 %.
"""

import tempfile
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

import fingervision as fv
from fingervision.domain.errors import FingervisionError
from fingervision.rendering import Camera, render, two_fingers
from tests.benchmarks.frame import Namespace, Tally, benchmark, in_turn

Values = NDArray[np.float64]
PX_PER_MM, FRAME_PX, BELOW_TIP_MM, DURATION_S = 30.0, (320, 96), 0.3, 9.0
REST_MM, RATIO = 1.0, 7.72
"""Gap at rest, and gap per input; the model is this line."""
LOG_HZ, LOG_NOISE_MM = 200.0, 5e-5
CODERS = {
    "clip.mp4": ("libx264", "yuv420p", {"crf": "16", "threads": "1", "x264-params": "threads=1:cpu-independent=1"}),
    "clip.mkv": ("ffv1", "gray", {"level": "3", "slicecrc": "1"}),
    "jpeg.mkv": ("mjpeg", "yuvj420p", {"qmin": "2", "qmax": "2"}),
}
KINDS = ("phone", "dark", "left out", "wandering", "120 Hz, 1 ms")
VERDICTS = ("agrees", "unknown", "ambiguous", "named", "no input", "error")


def instants(kind: str, rng: Generator) -> Values:
    """Times (s) at which the camera takes its frames."""
    if kind == "120 Hz, 1 ms":
        return np.arange(0.3 * DURATION_S * 120.0) / 120.0
    rate_hz = float(rng.choice([24.0, 25.0, 30.0]))
    times = np.arange(DURATION_S * rate_hz) / rate_hz
    if kind == "phone":
        times = times + rng.uniform(-4e-3, 4e-3, times.size)
    elif kind == "dark":
        begin, end = np.sort(rng.uniform(0.0, DURATION_S, 2))
        is_dark = (times > begin) & (times < end)
        times = times[~is_dark | (np.arange(times.size) % 2 == 0)] + 0.0
        times = times + rng.uniform(-1e-3, 1e-3, times.size)
    elif kind == "left out":
        times = times[rng.random(times.size) > 0.05]
    else:
        steps = (1.0 + 0.3 * np.sin(np.linspace(0.0, 9.0, times.size))) / rate_hz
        times = np.cumsum(steps) + rng.uniform(-2e-3, 2e-3, times.size)
    return times - times[0]


def path(kind: str, rng: Generator, time_s: Values) -> Values:
    """Input (mm) at given times: strokes, a slow or a fast sine, or a staircase."""
    is_fast = kind == "120 Hz, 1 ms"
    period_s = 1.0 / rng.uniform(1.0, 5.0) if is_fast else rng.uniform(2.5, 4.0)
    motion = "sine" if is_fast else rng.choice(["strokes", "sine", "staircase"])
    turns = np.maximum(time_s - 0.4, 0.0) / period_s
    # A rest before, and strokes of different lengths: a periodic motion does not tell the offset of the clocks.
    stroke_mm = rng.uniform(0.2, 0.4, 20)[turns.astype(int)]
    turn = turns % 1.0
    if motion == "sine":
        return 0.5 * stroke_mm * (1.0 - np.cos(2.0 * np.pi * turn))
    up = 1.0 - np.abs(2.0 * turn - 1.0)
    if motion == "strokes":
        return stroke_mm * up
    level = up * 6.0
    return stroke_mm * (np.floor(level) + np.clip(3.0 * (level % 1.0) - 1.0, 0.0, 1.0)) / 6.0


def record(file: Path, times_s: Values, gaps_mm: Values, rng: Generator) -> None:
    """Render and code the frames, each with the time at which it was taken."""
    coder, pixel_format, options = CODERS[file.name]
    camera = Camera(blur_px=0.9, noise_grey=1.5)
    with av.open(str(file), "w") as container:
        stream = container.add_stream(coder, rate=30, options=options)
        stream.width, stream.height, stream.pix_fmt = *FRAME_PX, pixel_format
        stream.codec_context.time_base = tick_s = Fraction(1, 90_000 if file.suffix == ".mp4" else 1000)
        for time_s, gap_mm in zip(times_s, gaps_mm, strict=True):
            scene = two_fingers(
                PX_PER_MM * gap_mm, below_tip_px=PX_PER_MM * BELOW_TIP_MM, width_px=50.0, frame=FRAME_PX
            )
            picture = av.VideoFrame.from_ndarray(render(scene, camera, rng), format="gray").reformat(
                format=pixel_format, src_color_range="JPEG", dst_color_range="JPEG"
            )
            picture.pts, picture.time_base = round(time_s / tick_s), tick_s
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))


def examined(folder: Path, kind: str, rng: Generator) -> tuple[int, int, str, str]:
    """Frames, frames called damaged, verdict, and words about one recording."""
    file = folder / list(CODERS)[1 + int(rng.integers(2)) if "1 ms" in kind else int(rng.integers(len(CODERS)))]
    times_s = instants(kind, rng)
    log_s = np.arange(-0.3, times_s[-1] + 0.3, 1.0 / LOG_HZ)
    inputs_mm = path(kind, rng, np.concatenate((times_s, log_s)))
    record(file, times_s, REST_MM + RATIO * inputs_mm[: times_s.size], rng)
    logged_mm = inputs_mm[times_s.size :] + rng.normal(0.0, LOG_NOISE_MM, log_s.size)
    drive = {"time_s": log_s + rng.uniform(-5.0, 5.0), "input_mm": logged_mm}
    measured = fv.measure(
        file, px_per_mm=PX_PER_MM, below_tip_mm=BELOW_TIP_MM, tips="up", response="linear", drive=drive
    )
    damaged = measured.summary["counts"]["damaged"]
    if measured.no_input:
        return times_s.size, damaged, "no input", f"{file.name}: {measured.no_input}"
    line = {"input_mm": np.array([-0.1, 0.6]), "gap_mm": REST_MM + RATIO * np.array([-0.1, 0.6])}
    found = fv.diagnose(measured, line)
    return times_s.size, damaged, found.verdict, f"{file.name}: {', '.join(each.name for each in found.effects)}"


@benchmark(
    recordings=100,
    first={"type": int, "default": 0, "help": "number of the first recording, to go on where a run ended"},
    only={"choices": KINDS},
    minutes=float("inf"),
    seed=1,
    verbose=False,
)
def main(chosen: Namespace) -> None:
    """Print the table."""
    tally = Tally("recordings", "frames", "damaged", *VERDICTS)
    with tempfile.TemporaryDirectory() as folder:
        for number in in_turn(range(chosen.first, chosen.recordings), chosen.minutes):
            kind = KINDS[number % len(KINDS)]
            if chosen.only not in (None, kind):
                continue
            try:
                frames, damaged, verdict, words = examined(
                    Path(folder), kind, np.random.default_rng([chosen.seed, number])
                )
            except FingervisionError as error:
                frames, damaged, verdict, words = 0, 0, "error", str(error)
            tally.add([kind], {"recordings": 1, "frames": frames, "damaged": damaged, verdict: 1})
            if chosen.verbose:
                print(f"{number} {kind}: {damaged} of {frames} damaged; {verdict}; {words}", flush=True)
    tally.show()
