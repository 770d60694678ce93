"""Streams with losses, recorded as live does: whether the recording measures to the live table, row by row.

Run as `python -m tests.benchmarks.lossy_streams [--runs 50] [--seed 1]` from the top. Every second stream is H.264 in
MPEG-TS that lost 1 to 12 of its packets, the others are Motion JPEG with 1 to 12 pictures spoilt. Printed: runs that
agree to the last digit, rows, damaged ones, and rows of the live table that are `ok` and wrong (by more than three
standard uncertainties and 0.1 px against the stream without losses).
"""

import csv
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from calib.calibration import BareScale
from fingervision.frames.source_kinds import open_source
from fingervision.measuring.measure import measure
from fingervision.measuring.task import Task
from fingervision.rendering import Camera, render, two_fingers
from tests.benchmarks.frame import Namespace, benchmark
from tests.live.test_damaged_stream import COUNT, SCALE, SIZE_PX, coded, recorded

TASK = Task(BareScale(SCALE))


def table(path: Path) -> list[dict[str, str]]:
    """Rows of a gaps.csv."""
    with (path / "gaps.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def wrong_rows(live: list[dict[str, str]], times_s: NDArray[np.float64], gaps_px: NDArray[np.float64]) -> int:
    """Count rows that are `ok` and differ from the stream without losses."""
    numbers = [(float(row["time_s"]), float(row["gap_px"]), float(row["u_gap_px"])) for row in live if row["gap_px"]]
    return sum(abs(gap - np.interp(time, times_s, gaps_px)) > 3.0 * u + 0.1 for time, gap, u in numbers)


@benchmark(runs=50, seed=1)
def main(chosen: Namespace) -> None:
    """Print the counts."""
    rng = np.random.default_rng(chosen.seed)
    camera = Camera(noise_grey=1.0)
    film = [
        render(two_fingers(50.0 + 0.5 * k, below_tip_px=5.1, width_px=25.0, frame=SIZE_PX), camera, rng)
        for k in range(COUNT)
    ]
    agree = rows = damaged = wrong = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for number in range(chosen.runs):
            coder, suffix = (("h264", ".ts"), ("mjpeg", ".mkv"))[number % 2]
            stream = folder / f"stream{number}{suffix}"
            begins = coded(stream, film, coder)
            measure(open_source(str(stream)), TASK, folder / f"whole{number}")
            whole = [row for row in table(folder / f"whole{number}") if row["gap_px"]]
            content = bytearray(stream.read_bytes())
            for frame in sorted(rng.choice(np.arange(1, COUNT - 1), rng.integers(1, 13), replace=False), reverse=True):
                at = begins[frame]
                if coder == "h264":
                    at += 188 * int(rng.integers(0, max(1, (begins[frame + 1] - at) // 188)))
                    del content[at : at + 188]
                else:
                    content[at + 700 : at + 760] = bytes(60)
            stream.write_bytes(content)
            run = recorded(stream, folder / f"runs{number}", TASK)
            measure(open_source(str(run / "video.mp4")), TASK, folder / f"again{number}")
            live, again = table(run), table(folder / f"again{number}")
            agree += live == again
            if live != again:
                differ = [k for k, (one, other) in enumerate(zip(live, again, strict=False)) if one != other]
                print(f"run {number} ({coder}): {len(live)} rows live, {len(again)} of the recording; {differ[:9]}")
            rows += len(live)
            damaged += sum(row["status"] == "damaged" for row in live)
            # Which of the stream's frames the recording began with is not said: the one that fits best.
            times_s, gaps_px = (np.array([float(row[key]) for row in whole]) for key in ("time_s", "gap_px"))
            wrong += min(wrong_rows(live, times_s - first_s, gaps_px) for first_s in times_s[:5])
    print(f"{agree} of {chosen.runs} runs agree; {rows} rows live, {damaged} damaged, {wrong} ok and wrong")
