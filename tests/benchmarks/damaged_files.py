"""Files with faults: what is read as `ok` is what the undamaged file says at that time, or it is no number.

Run as `python -m tests.benchmarks.damaged_files [--files 600] [--minutes 30] [--seed 1] [--only ffv1.mkv] [--verbose]`
from the top. A film of two moving fingers is coded in 26 kinds of file (codec and container). Every file then gets 1 to
20 faults of one kind: flipped bits, bytes missing, bytes zeroed, bursts of random bytes, memory pages of 4 kB that hold
an earlier page of the file (stale) or another page's content (swapped), MPEG-TS packets lost; or its end is cut off, or
1 to 12 of its coded pictures are left out whole, in a container without a fault. Each is measured, and every `ok` row
is held against the undamaged file's gap at the row's own time (linear between its frames): wrong is what differs by
more than three standard uncertainties and 0.05 px. Printed for each kind of file and for each kind of damage: files,
refused files, rows, `ok` rows, and wrong ones. With `--films N`, as many undamaged films of fast true motions (steps,
30 Hz, contact and opening, a part put in, a push at the camera) are measured instead: printed is how many of their
frames are called damaged, and why.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import av
import numpy as np

from calib.calibration import BareScale
from fingervision.domain.errors import FingervisionError
from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.domain.status import Status
from fingervision.frames.source_kinds import open_source
from fingervision.measuring.in_memory import measure_in_memory
from fingervision.measuring.task import Task
from fingervision.rendering import Camera, render, two_fingers
from tests.benchmarks.frame import Namespace, Tally, benchmark, in_turn
from tests.clips import Codec, coded, h264

RATE_HZ, FRAMES, SIZE_PX = 25.0, 75, (320, 240)
GREATEST_PX, BELOW_TIP_PX = 60.0, 6.0
# The fingers of the damaged films open and close by half a pixel a frame.
GAPS_PX = GREATEST_PX - np.abs(np.arange(FRAMES) % 50 - 25) / 2.0
FFV1 = Codec("ffv1", "gray", {"level": "3", "slicecrc": "1", "g": "12"})
MJPEG = Codec("mjpeg", "yuvj420p", {"qmin": "3", "qmax": "3"})
H264 = Codec("libx264", "yuv420p", {"g": "25", **h264(18).options})
HEVC = Codec("libx265", "yuv420p", {"crf": "18", "x265-params": "keyint=25:log-level=none"})
MPEG4 = Codec("mpeg4", "yuv420p", {"qmin": "3", "qmax": "3", "g": "25", "bf": "0"})
REALTIME = {"g": "25", "b": "2M", "deadline": "realtime", "cpu-used": "-8", "threads": "1"}
KINDS = {
    "ffv1.mkv": FFV1,
    "ffv1.avi": FFV1,
    "ffv1.mp4": Codec("ffv1", "gray", {"level": "3", "slicecrc": "1", "g": "1"}),
    "utvideo.avi": Codec("utvideo", "yuv420p"),
    "utvideo.nut": Codec("utvideo", "yuv420p"),
    "rawvideo.avi": Codec("rawvideo", "yuv420p"),
    "rawvideo.mkv": Codec("rawvideo", "gray"),
    "huffyuv.avi": Codec("huffyuv", "yuv422p"),
    "ffvhuff.avi": Codec("ffvhuff", "yuv420p"),
    "magicyuv.avi": Codec("magicyuv", "gray"),
    "png.mov": Codec("png", "gray"),
    "mjpeg.mkv": MJPEG,
    "mjpeg.avi": MJPEG,
    "mjpeg.mp4": MJPEG,
    "prores.mov": Codec("prores_ks", "yuv422p10le"),
    "h264.mp4": H264,
    "h264.mkv": H264,
    "h264.avi": Codec("libx264", "yuv420p", {**H264.options, "bf": "0"}),
    "h264.ts": H264,
    "hevc.mp4": HEVC,
    "mpeg2.ts": Codec("mpeg2video", "yuv420p", {"qmin": "3", "qmax": "3", "g": "25"}),
    "mpeg4.mp4": MPEG4,
    "mpeg4.avi": MPEG4,
    "vp8.webm": Codec("libvpx", "yuv420p", {**REALTIME, "lag-in-frames": "0"}),
    "vp9.mkv": Codec("libvpx-vp9", "yuv420p", {**REALTIME, "error-resilient": "1"}),
    "av1.mp4": Codec("libsvtav1", "yuv420p", {"crf": "30", "g": "25", "preset": "10"}),
}
"""Coder, format of the pixels and options; the suffix names the container. AVI holds no frames out of order."""
PAGE = 4096
MOTIONS = ("steps", "30 Hz", "shock", "contact", "part", "push", "light")
PX_PER_MM = 20.0
TASK = Task(BareScale(PX_PER_MM), below_tip_mm=BELOW_TIP_PX / PX_PER_MM)
FLOOR_PX = 0.05
"""Difference that is no fault: two lossy pictures of one scene differ by more than their noise."""


@dataclass(frozen=True, slots=True)
class Row:
    """What one frame gave."""

    time_s: float | None
    gap_px: float | None
    u_px: float


def film(gaps_px: np.ndarray, seed: int = 5) -> list[Frame]:
    """Two fingers in front of a camera with noise."""
    rng = np.random.default_rng(seed)
    camera = Camera(noise_grey=1.0)
    frames = []
    for k, gap_px in enumerate(gaps_px):
        scene = two_fingers(float(gap_px), below_tip_px=BELOW_TIP_PX, width_px=60.0, frame=SIZE_PX)
        frames.append(Frame(render(scene, camera, rng), k, k / RATE_HZ))
    return frames


def sound_film(what: str, rng: np.random.Generator) -> list[Frame]:
    """A film of a fast true motion, as the words of `MOTIONS` name it."""
    k = np.arange(FRAMES)
    gaps_px = film_gaps_px(what, k, rng)
    frames = film(gaps_px, int(rng.integers(1 << 30)))
    at, length = int(rng.integers(20, 55)), int(rng.integers(1, 4))
    for frame in frames:
        levels = frame.pixels
        if what == "push" and at <= frame.index < at + length:
            levels[:] = np.roll(levels, rng.integers(-9, 10, 2), axis=(0, 1))
        elif what == "part" and frame.index >= at:
            left = int(160 - gaps_px[frame.index] / 2)
            levels[120:, left : 320 - left] = 60
        elif what == "light" and at <= frame.index < at + length:
            levels[:] = np.asarray(levels * 0.6, dtype=np.uint8)
    return frames


def film_gaps_px(what: str, k: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Gap in each frame of a sound film."""
    size_px, first = rng.uniform(0.5, 40.0), int(rng.integers(15, 50))
    if what == "steps":
        return 20.0 + size_px * (k // int(rng.integers(5, 15)) % 3)
    if what == "30 Hz":
        return 20.0 + size_px / 2.0 * (1.0 + np.sin(2.0 * np.pi * 30.0 * k / RATE_HZ + rng.uniform(0.0, 6.0)))
    if what == "shock":
        return 20.0 + size_px * np.exp(-np.maximum(k - first, 0) / 0.4) * (k >= first)
    if what == "contact":
        return np.abs(30.0 - 1.7 * (k % 40)) + 1.0
    return 45.0 + 0.2 * np.sin(k / 5.0)


def written(path: Path, frames: list[Frame]) -> None:
    """Write a film as a camera's program does, in the kind of file that its name says."""
    levels = [frame.pixels for frame in frames]
    coded(path, levels, KINDS[path.name], rate_hz=int(RATE_HZ), src_color_range="JPEG", dst_color_range="JPEG")


def rows(path: Path) -> list[Row]:
    """Measure a file."""
    found = []
    for each in measure_in_memory(open_source(str(path)), TASK).results:
        if isinstance(each.outcome, GapMeasurement):
            u_px = float(np.hypot(each.outcome.u_gap_px, each.outcome.u_picture_px))
            found.append(Row(each.time_s, each.outcome.gap_px, u_px))
        else:
            found.append(Row(each.time_s, None, 0.0))
    return found


def without_pictures(path: Path, rng: np.random.Generator) -> tuple[bytes, str]:
    """Leave 1 to 12 coded pictures out, as a program does that did not get them; the first and the last stay."""
    fewer = path.with_name(f"fewer{path.suffix}")
    with av.open(str(path)) as whole, av.open(str(fewer), "w") as container:
        packets = [packet for packet in whole.demux(video=0) if packet.size]
        copied = container.add_stream_from_template(whole.streams.video[0], opaque=True)
        between = np.arange(1, len(packets) - 1)
        gone = set(rng.choice(between, int(rng.integers(1, 13)), replace=False).tolist())
        for number, packet in enumerate(packets):
            if number not in gone:
                packet.stream = copied
                container.mux(packet)
    return fewer.read_bytes(), f"{len(gone)} pictures"


def damaged(path: Path, content: bytes, kind: str, rng: np.random.Generator) -> tuple[bytes, str, str]:
    """Put 1 to 20 faults of one kind somewhere behind the head, cut the end off, or leave coded pictures out."""
    kinds = ["flips", "missing", "zeros", "burst", "stale", "swapped", "truncated"]
    kinds += ["packets"] if kind.endswith(".ts") else []
    # AVI counts its frames: what is not there was never taken.
    kinds += [] if kind.endswith(".avi") or kind == "rawvideo.mkv" else ["pictures"]
    what = str(rng.choice(kinds))
    if what == "pictures":
        return *without_pictures(path, rng), what
    if what == "truncated":
        return content[: int(rng.integers(len(content) // 4, len(content)))], what, what
    faults = int(rng.integers(1, 21))
    changed = bytearray(content)
    head = min(2000, len(content) // 4)
    for _ in range(faults):
        at = int(rng.integers(head, len(changed) - 1))
        if what == "flips":
            changed[at] ^= 1 << int(rng.integers(0, 8))
        elif what == "packets":
            at -= at % 188
            del changed[at : at + 188]
        elif what == "missing":
            del changed[at : at + int(rng.choice([1, 100, 4096]))]
        elif what in ("stale", "swapped"):
            _mix_pages(changed, rng, is_swapped=what == "swapped")
        else:
            length = min(int(rng.choice([16, 300, 4096])), len(changed) - at)
            changed[at : at + length] = bytes(length) if what == "zeros" else rng.bytes(length)
        if len(changed) < head + 2:
            break
    return bytes(changed), f"{faults} {what}", what


def _mix_pages(changed: bytearray, rng: np.random.Generator, *, is_swapped: bool) -> None:
    """Let a page of the file hold what stands in an earlier page, or exchange the two."""
    pages = len(changed) // PAGE
    if pages < 3:
        return
    late = int(rng.integers(2, pages)) * PAGE
    # Memory that was not written again holds what it held a little earlier.
    early = max(1, late // PAGE - int(rng.integers(1, 60))) * PAGE
    old, new = bytes(changed[early : early + PAGE]), bytes(changed[late : late + PAGE])
    changed[late : late + PAGE] = old
    if is_swapped:
        changed[early : early + PAGE] = new


def wrong(found: list[Row], times_s: np.ndarray, gaps_px: np.ndarray) -> list[tuple[int, float, float]]:
    """Rows that say something else than the undamaged file at their time: index, error, allowed."""
    bad = []
    for k, row in enumerate(found):
        if row.gap_px is None or row.time_s is None:
            continue
        error_px = row.gap_px - float(np.interp(row.time_s, times_s, gaps_px))
        allowed_px = 3.0 * row.u_px + FLOOR_PX
        if not abs(error_px) <= allowed_px:
            bad.append((k, error_px, allowed_px))
    return bad


def measure_sound(folder: Path, kinds: list[str], films: int, seed: int, minutes: float) -> None:
    """Print how many frames of undamaged films are refused as damaged."""
    tally = Tally("films", "frames", "ok", "called damaged")
    for number in in_turn(range(films), minutes):
        kind, motion = kinds[number % len(kinds)], MOTIONS[number // 2 % len(MOTIONS)]
        path = folder / kind
        written(path, sound_film(motion, np.random.default_rng([seed, number])))
        results = measure_in_memory(open_source(str(path)), TASK).results
        bad = [each for each in results if each.outcome.status is Status.DAMAGED]
        measured = sum(each.outcome.status is Status.OK for each in results)
        tally.add([motion], {"films": 1, "frames": len(results), "ok": measured, "called damaged": len(bad)})
        for each in bad[:3]:
            print(f"{number} {kind} {motion}: frame {each.index}: {each.outcome.words}", flush=True)
    tally.show()


def measure_damaged(folder: Path, kinds: list[str], chosen: Namespace) -> None:
    """Print what damaged files give."""
    tally = Tally("files", "refused", "rows", "ok", "wrong", "files with wrong")
    frames, originals = film(GAPS_PX), {}
    for kind in kinds:
        path = folder / kind
        written(path, frames)
        whole = [row for row in rows(path) if row.gap_px is not None]
        originals[kind] = (
            path.read_bytes(),
            np.array([row.time_s for row in whole], dtype=float),
            np.array([row.gap_px for row in whole], dtype=float),
        )
    for number in in_turn(range(chosen.first, chosen.files), chosen.minutes):
        kind = kinds[number % len(kinds)]
        content, times_s, gaps_px = originals[kind]
        changed, words, what = damaged(folder / kind, content, kind, np.random.default_rng([chosen.seed, number]))
        path = folder / f"damaged{Path(kind).suffix}"
        path.write_bytes(changed)
        found, is_refused = [], 0
        try:
            found = rows(path)
        except FingervisionError:
            is_refused = 1
        bad = wrong(found, times_s, gaps_px)
        counts = {"files": 1, "refused": is_refused, "rows": len(found), "wrong": len(bad)}
        counts |= {"ok": sum(row.gap_px is not None for row in found), "files with wrong": bool(bad)}
        tally.add([kind, f"({what})"], counts)
        if bad and chosen.verbose:
            told = ", ".join(f"{k}: {error:+.3f} ({allowed:.3f})" for k, error, allowed in bad[:6])
            print(f"{number} {kind} {words}: {len(bad)} wrong of {len(found)}: {told}", flush=True)
        if bad and chosen.keep:
            Path("build").mkdir(exist_ok=True)
            Path("build", f"{number}-{kind}").write_bytes(changed)
    print(f"{tally.of['all']['files']} of {chosen.files - chosen.first} files ran")
    tally.show()


@benchmark(
    files=600,
    first={"type": int, "default": 0, "help": "number of the first file, to go on where a run ended"},
    minutes=float("inf"),
    seed=1,
    only={"choices": KINDS},
    films={"type": int, "default": 0, "help": "measure this number of undamaged films instead"},
    verbose=False,
    keep={"action": "store_true", "help": "keep the files with wrong rows in build/"},
)
def main(chosen: Namespace) -> None:
    """Print the tables."""
    kinds = [chosen.only] if chosen.only else list(KINDS)
    with tempfile.TemporaryDirectory() as folder:
        if chosen.films:
            measure_sound(Path(folder), kinds, chosen.films, chosen.seed, chosen.minutes)
        else:
            measure_damaged(Path(folder), kinds, chosen)
