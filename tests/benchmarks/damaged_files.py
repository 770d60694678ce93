"""Files with faults: what is read as `ok` is what the undamaged file says at that time, or it is no number.

Run as `python tests/benchmarks/damaged_files.py [--files 500] [--seed 1] [--only ffv1.mkv] [--verbose]` from the top.
A film of two moving fingers is coded with FFV1, Motion JPEG, H.264, MPEG-4 part 2, VP8, VP9 and AV1 into MP4, Matroska,
AVI and MPEG-TS. Every file then gets 1 to 20 faults of one kind: flipped bits, bytes missing, bytes zeroed, bursts of
random bytes, MPEG-TS packets lost; or 1 to 12 of its coded pictures are left out whole, in a container without a fault.
Each is measured, and every `ok` row is held against the undamaged file's gap at the row's own time (linear
between its frames): wrong is what differs by more than three standard uncertainties beyond what the undamaged
neighbours do. Printed for each kind of file: files, refused files, rows, `ok` rows, and wrong ones.
"""

import argparse
import tempfile
from collections import defaultdict
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

from fingervision.domain.errors import FingervisionError
from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.frames.source import open_source
from fingervision.measuring.sound_picture import SoundPictures
from fingervision.rendering import Camera, render, two_fingers
from fingervision.vision.pipeline import Settings, measure_frame

RATE_HZ, FRAMES, SIZE_PX = 25.0, 75, (320, 240)
GREATEST_PX, BELOW_TIP_PX = 60.0, 6.0
FFV1 = ("ffv1", "gray", {"level": "3", "slicecrc": "1", "g": "12"})
EVERY_FFV1 = ("ffv1", "gray", {"level": "3", "slicecrc": "1", "g": "1"})
MJPEG = ("mjpeg", "yuvj420p", {"qmin": "3", "qmax": "3"})
H264 = ("libx264", "yuv420p", {"crf": "18", "g": "25"})
MPEG4 = ("mpeg4", "yuv420p", {"qmin": "3", "qmax": "3", "g": "25", "bf": "0"})
REALTIME = {"g": "25", "b": "2M", "deadline": "realtime", "cpu-used": "8"}
KINDS = {
    "ffv1.mkv": FFV1,
    "ffv1.avi": FFV1,
    "ffv1.mp4": EVERY_FFV1,
    "mjpeg.mkv": MJPEG,
    "mjpeg.avi": MJPEG,
    "mjpeg.mp4": MJPEG,
    "h264.mp4": H264,
    "h264.mkv": H264,
    "h264.avi": (*H264[:2], {**H264[2], "bf": "0"}),
    "h264.ts": H264,
    "mpeg4.mp4": MPEG4,
    "vp8.webm": ("libvpx", "yuv420p", {**REALTIME, "lag-in-frames": "0"}),
    "vp9.mkv": ("libvpx-vp9", "yuv420p", {**REALTIME, "error-resilient": "1"}),
    "av1.mp4": ("libsvtav1", "yuv420p", {"crf": "30", "g": "25", "preset": "10"}),
}
"""Coder, format of the pixels and options; the suffix names the container. AVI holds no frames out of order."""
SETTINGS = Settings(BELOW_TIP_PX)
FLOOR_PX = 0.01
"""Two measurements of one picture differ by nothing; linear interpolation of the film's motion by less than this."""


@dataclass(frozen=True, slots=True)
class Row:
    """What one frame gave."""

    time_s: float | None
    gap_px: float | None
    u_px: float


def film() -> list[Frame]:
    """Fingers that open and close by half a pixel a frame, with a camera's noise."""
    rng = np.random.default_rng(5)
    camera = Camera(noise_grey=1.0)
    frames = []
    for k in range(FRAMES):
        scene = two_fingers(
            GREATEST_PX - abs(k % 50 - 25) / 2.0, below_tip_px=BELOW_TIP_PX, width_px=60.0, frame=SIZE_PX
        )
        frames.append(Frame(render(scene, camera, rng), k, k / RATE_HZ))
    return frames


def coded(path: Path, frames: list[Frame], coder: str, pixel_format: str, options: dict[str, str]) -> None:
    """Write a film as a camera's program does."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(coder, rate=int(RATE_HZ), options=options)
        stream.width, stream.height, stream.pix_fmt = *SIZE_PX, pixel_format
        for frame in frames:
            picture = av.VideoFrame.from_ndarray(frame.pixels, format="gray").reformat(
                format=pixel_format, src_color_range="JPEG", dst_color_range="JPEG"
            )
            picture.pts, picture.time_base = frame.index, Fraction(1, int(RATE_HZ))
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))


def rows(path: Path) -> list[Row]:
    """Measure a file."""
    found, pictures = [], SoundPictures()
    for item in open_source(str(path)):
        outcome = pictures.judged(item, measure_frame(item, SETTINGS)) if isinstance(item, Frame) else None
        if isinstance(outcome, GapMeasurement):
            found.append(Row(item.time_s, outcome.gap_px, float(np.hypot(outcome.u_gap_px, outcome.u_shift_px))))
        else:
            found.append(Row(item.time_s, None, 0.0))
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


def damaged(path: Path, content: bytes, kind: str, rng: np.random.Generator) -> tuple[bytes, str]:
    """Put 1 to 20 faults of one kind somewhere behind the head, or leave coded pictures out."""
    kinds = ["flips", "missing", "zeros", "burst"] + (["packets"] if kind.endswith(".ts") else [])
    # AVI counts its frames: what is not there was never taken.
    kinds += [] if kind.endswith(".avi") else ["pictures"]
    what = str(rng.choice(kinds))
    if what == "pictures":
        return without_pictures(path, rng)
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
        else:
            length = min(int(rng.choice([16, 300, 4096])), len(changed) - at)
            changed[at : at + length] = bytes(length) if what == "zeros" else rng.bytes(length)
        if len(changed) < head + 2:
            break
    return bytes(changed), f"{faults} {what}"


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


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--files", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=KINDS)
    parser.add_argument("--verbose", action="store_true")
    parser.add_argument("--one", type=int, help="measure this file alone and keep it in build/")
    chosen = parser.parse_args()
    kinds = [chosen.only] if chosen.only else list(KINDS)
    rng = np.random.default_rng(chosen.seed)
    totals: dict[str, list[int]] = defaultdict(lambda: [0] * 6)
    with tempfile.TemporaryDirectory() as folder:
        frames, originals = film(), {}
        for kind in kinds:
            path = Path(folder) / kind
            coded(path, frames, *KINDS[kind])
            whole = [row for row in rows(path) if row.gap_px is not None]

            originals[kind] = (
                path.read_bytes(),
                np.array([row.time_s for row in whole], dtype=float),
                np.array([row.gap_px for row in whole], dtype=float),
            )
        for number in range(chosen.files):
            kind = kinds[number % len(kinds)]
            path_suffix = Path(kind).suffix
            content, times_s, gaps_px = originals[kind]
            changed, words = damaged(Path(folder) / kind, content, kind, rng)
            path = Path(folder) / f"damaged{path_suffix}"
            if chosen.one is not None:
                if number != chosen.one:
                    continue
                path = Path("build") / path.name
                path.parent.mkdir(exist_ok=True)
            path.write_bytes(changed)
            total = totals[kind]
            total[0] += 1
            try:
                found = rows(path)
            except FingervisionError:
                total[1] += 1
                continue
            bad = wrong(found, times_s, gaps_px)
            total[2] += len(found)
            total[3] += sum(row.gap_px is not None for row in found)
            total[4] += len(bad)
            total[5] += bool(bad)
            if bad and chosen.verbose:
                told = ", ".join(f"{k}: {error:+.3f} ({allowed:.3f})" for k, error, allowed in bad[:6])
                print(f"{number} {kind} {words}: {len(bad)} wrong of {len(found)}: {told}", flush=True)
    print(f"{'kind':10} {'files':>6} {'refused':>8} {'rows':>7} {'ok':>7} {'wrong':>6} {'files with wrong':>17}")
    for kind, total in (*totals.items(), ("all", [sum(column) for column in zip(*totals.values(), strict=True)])):
        print(f"{kind:10} {total[0]:6} {total[1]:8} {total[2]:7} {total[3]:7} {total[4]:6} {total[5]:17}")


if __name__ == "__main__":
    main()
