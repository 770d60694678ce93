"""Speed and memory of `measure`.

    python -m tests.benchmarks.speed [--frames 1500] [--runs 5] [--only rate|kinds|memory] [--sizes 1920x1080]
        [--coders ffv1.mkv] [--lengths 60 2000]

Rate: frames per second of decoding alone and of measuring, in turn on the same file, medians; and milliseconds of one
core for everything after decoding, beside the same steps written plainly with OpenCV and with scikit-image. Kinds:
the same milliseconds for a picture of 3840x2160 and for each kind of picture without two fingers, which is refused.
Memory: peak of `measure` at 60 and 2000 frames (`--lengths`), for four codecs (`--coders`) and three sizes of the
picture (`--sizes`). Every figure is that of the machine it runs on; the clip of the rates is 640x480, H.264 of about 5
Mbit/s. `first_run` times the start of the program.
"""

import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable
from itertools import islice
from pathlib import Path

import av
import cv2
import numpy as np
from skimage import filters
from skimage import measure as shapes

from calib.calibration import BareScale
from fingervision.domain.direction import Direction
from fingervision.domain.frame import Coding, Frame, Pixels
from fingervision.domain.gap import NoGap
from fingervision.frames.source_kinds import open_source
from fingervision.measuring.measure import measure
from fingervision.measuring.task import Task
from fingervision.rendering import Camera, render, two_fingers
from fingervision.vision.pipeline import Settings, measure_frame

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from tests.benchmarks.damaged_files import KINDS
from tests.benchmarks.frame import Namespace, benchmark, spent_s
from tests.benchmarks.scenes.empty import EMPTY
from tests.clips import coded, h264, write_clip

PX_PER_MM = 34.0
BELOW_PX = 0.3 * PX_PER_MM
# Noise of this size takes x264 to about 5 Mbit/s at this quality.
NOISE_GREY, CRF = 4.0, 20.0
RENDERED = 100
# Pictures of the clip that is repeated for the lengths (frames) at which memory is read.
RENDERED_FOR_MEMORY, LENGTHS, RATE_HZ = 20, (60, 2000), 25
CODERS = ("h264.mp4", "hevc.mp4", "mjpeg.mkv", "ffv1.mkv")
SIZES = ("640x480", "1920x1080", "3840x2160")


def pictures() -> list[Pixels]:
    """An opening and closing gripper; rendered once and repeated, because rendering is slow."""
    rng = np.random.default_rng(0)
    camera = Camera(blur_px=0.9, noise_grey=NOISE_GREY)
    gaps = 120.0 + 80.0 * np.sin(np.linspace(0.0, 2.0 * np.pi, RENDERED, endpoint=False))
    return [render(two_fingers(float(gap), radius_px=34.0), camera, rng) for gap in gaps]


def write(path: Path, count: int, levels: list[Pixels]) -> None:
    write_clip(path, (Frame(levels[k % len(levels)], k, k / 25.0) for k in range(count)), h264(CRF))


def decode(path: Path) -> int:
    with av.open(str(path)) as container:
        return sum(1 for _ in container.decode(video=0))


def run(path: Path, out: Path, direction: Direction | None) -> int:
    task = Task(BareScale(PX_PER_MM), direction=direction)
    return measure(open_source(str(path)), task, out).series.frames


def plain_opencv(pixels: Pixels) -> float | None:
    """The paper's steps, written plainly: Otsu, contours, tips, and the inner edges by parabola on the gradient."""
    _, black = cv2.threshold(cv2.GaussianBlur(pixels, (5, 5), 0), 0, 255, cv2.THRESH_BINARY_INV + cv2.THRESH_OTSU)
    outlines, _ = cv2.findContours(black, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    two = sorted(outlines, key=cv2.contourArea)[-2:]
    if len(two) < 2:
        return None
    boxes = sorted(cv2.boundingRect(outline) for outline in two)
    inner = [boxes[0][0] + boxes[0][2] - 1, boxes[1][0]]
    row = round(max(box[1] for box in boxes) + BELOW_PX)
    slope = np.abs(cv2.Sobel(pixels[row - 10 : row + 10], cv2.CV_32F, 1, 0)).mean(axis=0)
    places = []
    for at in inner:
        low = max(at - 8, 1)
        k = low + int(np.argmax(slope[low : at + 9]))
        a, b, c = slope[k - 1 : k + 2]
        places.append(k + 0.5 * (a - c) / (a - 2 * b + c))
    return float(places[1] - places[0])


def plain_skimage(pixels: Pixels) -> float | None:
    """The same with scikit-image: Otsu, labels, and the half-level by `find_contours`."""
    smooth = filters.gaussian(pixels, 1.0, preserve_range=True)
    level = filters.threshold_otsu(smooth)
    regions = sorted(shapes.regionprops(shapes.label(smooth < level)), key=lambda region: region.area)[-2:]
    if len(regions) < 2:
        return None
    regions.sort(key=lambda region: region.bbox[1])
    row = max(region.bbox[0] for region in regions) + BELOW_PX
    lines = shapes.find_contours(pixels[round(row) - 10 : round(row) + 10].astype(float), level)
    across = sorted(float(np.median(line[:, 1])) for line in lines if len(line) > 10)
    return across[-2] - across[1] if len(across) >= 4 else None


def rate(folder: Path, levels: list[Pixels], frames: int, runs: int) -> None:
    path = folder / "clip.mp4"
    write(path, frames, levels)
    bits = path.stat().st_size * 8 / (frames / 25.0) / 1e6
    print(f"\nRate, 640x480 H.264 of {bits:.1f} Mbit/s, {frames} frames, medians of {runs} runs in turn")
    run(path, folder / "out", None)  # imports and tables that are made once
    print(f"{'':34}{'frames/s':>10}{'of decoding':>13}")
    alone: list[float] = []
    by_tips: dict[str, list[float]] = {"measure --tips up": [], "measure --tips auto": []}
    for _ in range(runs):
        alone.append(frames / spent_s(lambda: decode(path))[0])
        for name, direction in (("measure --tips up", Direction.UP), ("measure --tips auto", None)):
            by_tips[name].append(frames / spent_s(lambda way=direction: run(path, folder / "out", way))[0])
    reference = statistics.median(alone)
    print(f"{'decoding alone':34}{reference:10.0f}{1.0:13.2f}")
    for name, rates in by_tips.items():
        print(f"{name:34}{statistics.median(rates):10.0f}{statistics.median(rates) / reference:13.2f}")

    settings = {"up": Settings(BELOW_PX, Direction.UP), "auto": Settings(BELOW_PX)}
    steps: dict[str, Callable[[Pixels], object]] = {
        "fingervision, tips up": lambda p: measure_frame(Frame(p, 0, None, Coding.INTERFRAME), settings["up"]),
        "fingervision, tips auto": lambda p: measure_frame(Frame(p, 0, None, Coding.INTERFRAME), settings["auto"]),
        "plain OpenCV": plain_opencv,
        "plain scikit-image": plain_skimage,
    }
    cv2.setNumThreads(1)  # for plain OpenCV as for ours: the figure is of one core
    with av.open(str(path)) as container:
        decoded = [picture.to_ndarray()[:480].copy() for picture in islice(container.decode(video=0), 100)]
    print(f"\n{'After decoding, ms of one core':34}{'ms/frame':>10}")
    for name, step in steps.items():
        used_s = spent_s(lambda step=step: [step(pixels) for pixels in decoded], runs)[1]
        print(f"{name:34}{1e3 * used_s / len(decoded):10.2f}")


def kinds(runs: int) -> None:
    """Milliseconds of one core for a large picture, and for those that are refused."""
    rng = np.random.default_rng(2)
    large = two_fingers(700.0, below_tip_px=6.0 * BELOW_PX, width_px=500.0, radius_px=200.0, frame=(3840, 2160))
    shown = [("3840x2160", render(large, Camera(blur_px=1.2, noise_grey=2.0), rng), 6.0 * BELOW_PX)]
    shown += [(f"refused: {name}", draw(rng).picture, BELOW_PX) for name, draw in EMPTY.items()]
    print(f"\n{'After decoding, ms of one core':34}{'ms/frame':>10}   what came out")
    for name, pixels, below_px in shown:
        shot = Frame(pixels, 0), Settings(below_px)
        used_s = spent_s(lambda shot=shot: measure_frame(*shot), runs)[1]
        outcome = measure_frame(*shot)
        words = outcome.status.value if isinstance(outcome, NoGap) else f"{outcome.gap_px:.2f} px"
        print(f"{name:34}{1e3 * used_s:10.2f}   {words}", flush=True)


def peak_mb(path: Path, out: Path) -> float:
    """Largest resident memory of a whole `measure`."""
    command = [sys.executable, "-m", "fingervision", "measure", str(path), "--px-per-mm", "34", "--out", str(out)]
    watched = (
        "import resource,subprocess,sys\n"
        "subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL)\n"
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    )
    done = subprocess.run([sys.executable, "-c", watched, *command], capture_output=True, text=True, check=True)
    return int(done.stdout) / (1024.0 if sys.platform == "linux" else 1024.0**2)


def repeat(clip: Path, path: Path, times: int) -> None:
    """The packets of a clip again and again, each time later by its length: a clip begins with a key frame."""
    with av.open(str(clip)) as source, av.open(str(path), "w") as target:
        stream = source.streams.video[0]
        copy = target.add_stream_from_template(stream)
        packets = [packet for packet in source.demux(stream) if packet.dts is not None]
        stamps = [(packet.pts, packet.dts) for packet in packets]
        length = round(RENDERED_FOR_MEMORY / (RATE_HZ * stream.time_base))
        for k in range(times):
            for packet, (pts, dts) in zip(packets, stamps, strict=True):
                packet.stream, packet.time_base = copy, stream.time_base
                packet.pts, packet.dts = pts + k * length, dts + k * length
                target.mux(packet)


def memory(folder: Path, sizes: list[str], coders: list[str], lengths: list[int]) -> None:
    """Largest resident memory of `measure` at two lengths, and what the longer file needs of the shorter's."""
    rng = np.random.default_rng(4)
    short, long = lengths
    print(f"\n{f'Peak memory of measure, {short} and {long} frames':46}{'MB':>7}{'MB':>7}{'ratio':>7}")
    for size in sizes:
        width_px, height_px = (int(part) for part in size.split("x"))
        zoom = height_px / 480.0
        scene = [two_fingers((90.0 + k) * zoom, radius_px=34.0, frame=(width_px, height_px)) for k in range(5)]
        shown = [render(each, Camera(blur_px=0.9, noise_grey=NOISE_GREY), rng) for each in scene]
        clip = [Frame(shown[k % len(shown)], k, k / RATE_HZ) for k in range(RENDERED_FOR_MEMORY)]
        for kind in coders:
            drawn = folder / kind
            coded(drawn, (frame.pixels for frame in clip), KINDS[kind], src_color_range="JPEG", dst_color_range="JPEG")
            peaks = []
            for count in lengths:
                path = folder / f"{count}-{kind}"
                repeat(drawn, path, count // RENDERED_FOR_MEMORY)
                if (frames := decode(path)) != count:
                    raise RuntimeError(f"{path.name} must hold as many frames as its name says, but holds {frames}.")
                if size == sizes[0] and not peaks:
                    peak_mb(path, folder / f"{kind}.built")  # the very first run of a source tree builds its loops
                peaks.append(peak_mb(path, folder / f"{size}-{path.name}.out"))
                path.unlink()
            print(f"{f'{size}, {kind}':46}{peaks[0]:7.0f}{peaks[1]:7.0f}{peaks[1] / peaks[0]:7.2f}", flush=True)


@benchmark(
    frames=1500,
    runs=5,
    only={"choices": ["rate", "kinds", "memory"]},
    sizes={"nargs": "+", "default": SIZES},
    coders={"nargs": "+", "default": CODERS, "choices": CODERS},
    lengths={"nargs": 2, "type": int, "default": LENGTHS},
)
def main(asked: Namespace) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder, levels = Path(name), pictures() if asked.only in (None, "rate") else []
        if asked.only in (None, "rate"):
            rate(folder, levels, asked.frames, asked.runs)
        if asked.only in (None, "kinds"):
            kinds(asked.runs)
        if asked.only in (None, "memory"):
            memory(folder, asked.sizes, asked.coders, asked.lengths)
