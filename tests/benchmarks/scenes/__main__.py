"""What the measuring makes of a lab's scenes, kind by kind.

    python -m tests.benchmarks.scenes [gripped|whole|clutter|things|empty]... [--each 10] [--seed 1] [--only KIND...]
        [--save FOLDER]

Every frame is measured without options (any direction, dark or light fingers). Columns: frames; with a value; refused
as `gripping`; values off by more than 0.25 px and by more than 3 u (all parts of the uncertainty together); median
absolute error; parts whose width is given, off by more than 3 u; milliseconds a frame; statuses of the others. --save
writes the pictures of values that are wrong and of refusals.
"""

import time
import zlib
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.vision.pipeline import Settings
from fingervision.vision.single_picture import measure_picture
from tests.benchmarks.frame import Namespace, benchmark
from tests.benchmarks.scenes.bench_things import THINGS
from tests.benchmarks.scenes.canvas import Rng
from tests.benchmarks.scenes.clutter import CLUTTER
from tests.benchmarks.scenes.empty import EMPTY
from tests.benchmarks.scenes.gripped import GRIPPED
from tests.benchmarks.scenes.gripper import BELOW_PX, Shot
from tests.benchmarks.scenes.whole import whole

SETS: dict[str, dict[str, Callable[[Rng], Shot]]] = {
    "gripped": GRIPPED,
    "whole": {"whole": whole},
    "clutter": CLUTTER,
    "things": THINGS,
    "empty": EMPTY,
}


class Tally:
    """Counts of one kind, or of all."""

    def __init__(self) -> None:
        self.frames = self.valued = self.gripping = self.off = self.wrong = self.held = self.held_wrong = 0
        self.unsaid = 0
        self.errors: list[float] = []
        self.seconds = 0.0
        self.lost: Counter[str] = Counter()

    def line(self, name: str) -> str:
        median = f"{np.median(self.errors):7.4f}" if self.errors else "      -"
        counts = (self.frames, self.valued, self.gripping, self.off, self.wrong, self.unsaid)
        columns = " ".join(f"{count:{width}d}" for count, width in zip(counts, (5, 6, 6, 5, 5, 5), strict=True))
        milliseconds = 1e3 * self.seconds / max(self.frames, 1)
        return (
            f"{name:24s} {columns} {median}  {self.held:5d} {self.held_wrong:5d} {milliseconds:6.1f}  "
            f"{dict(self.lost) or ''}"
        )


def _take(shot: Shot, tallies: tuple[Tally, Tally]) -> str:
    start = time.perf_counter()
    found = measure_picture(Frame(shot.picture, 0), Settings(BELOW_PX))
    seconds = time.perf_counter() - start
    words = ""
    for tally in tallies:
        tally.frames += 1
        tally.seconds += seconds
        held = getattr(found, "held", None)
        if held is not None and shot.held_px is not None:
            tally.held += 1
            if abs(held.width_px - shot.held_px) > 3.0 * np.hypot(held.u_width_px, 0.05):
                tally.held_wrong += 1
                words = f"held {held.width_px:.2f} +- {held.u_width_px:.2f} px, truth {shot.held_px:.2f}"
        if not isinstance(found, GapMeasurement):
            if found.status.value == "gripping":
                tally.gripping += 1
                if not shot.is_hidden:
                    words = f"{found.status.value}: {found.words}"
            else:
                tally.lost[found.status.value] += 1
                if shot.gap_px is not None:
                    words = f"{found.status.value}: {found.words}"
            continue
        tally.valued += 1
        error = np.inf if shot.gap_px is None else abs(found.gap_px - shot.gap_px)
        u = np.hypot(found.u_gap_px, found.u_picture_px)
        if np.isfinite(error):
            tally.errors.append(error)
        tally.off += error > 0.25
        tally.wrong += error > 3.0 * u
        tally.unsaid += error > max(0.25, 2.0 * u)
        if error > max(0.25, 2.0 * u) or error > 3.0 * u:
            truth = "none" if shot.gap_px is None else f"{shot.gap_px:.2f}"
            points = " ".join(f"{edge.x_px:.1f},{edge.y_px:.1f}" for edge in (found.left, found.right))
            words = f"gap {found.gap_px:.2f} +- {u:.3f} px, truth {truth}; points {points}"
    return words


@benchmark(
    sets=tuple(SETS),
    each=10,
    seed=1,
    only={"nargs": "*"},
    save={"type": Path},
)
def main(options: Namespace) -> None:
    for chosen in options.sets:
        print(f"{chosen:24s} frames  value gripng >.25   >3u both   median   held  >3u     ms")
        every = Tally()
        for name, draw in SETS[chosen].items():
            if options.only and not any(word in name for word in options.only):
                continue
            rng = np.random.default_rng([options.seed, zlib.crc32(name.encode())])
            tally = Tally()
            for number in range(options.each):
                shot = draw(rng)
                words = _take(shot, (tally, every))
                if words and options.save:
                    options.save.mkdir(parents=True, exist_ok=True)
                    cv2.imwrite(str(options.save / f"{name}-{number}.png"), shot.picture)
                    with (options.save / "why.txt").open("a") as file:
                        file.write(f"{name}-{number}: {words}\n")
            print(tally.line(name), flush=True)
        print(every.line("all"), flush=True)
