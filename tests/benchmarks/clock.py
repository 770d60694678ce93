"""How well the clock offset is found: drawn recordings with a known offset, rate, play and noise.

`python -m tests.benchmarks.clock --series 500 --seed 1` prints the table of tests/benchmarks/README.md.
"""

from collections import Counter
from dataclasses import asdict, replace
from time import process_time

import numpy as np

from fingervision.domain.direction import Direction
from fingervision.domain.drive import DriveHistory
from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.motion.clock.alignment import find_clock_offset
from fingervision.motion.clock.clock_offset import NoClockOffset
from fingervision.rendering import Camera, render, two_fingers
from fingervision.vision.pipeline import Settings, measure_frame
from tests.benchmarks.drawn_recordings import Drawn, draw
from tests.benchmarks.frame import Namespace, benchmark, in_turn

WIDEST_PX, FRAME_PX, BELOW_PX = 230.0, (360, 120), 10.2
"""Largest gap of a rendered recording, its frame, and where it is measured: small frames are measured fast,
and the noise of the gap depends on neither."""
SLOWEST_HZ, FASTEST_HZ = 5.0, 120.0


def of_any_rate(seed):
    """Draw a recording with creep, slow logs, missing rows, set-points and further motions, at any rate of frames."""
    return draw(seed, frame_hz=float(np.exp(np.random.default_rng(seed).uniform(*np.log([SLOWEST_HZ, FASTEST_HZ])))))


def of_pictures(seed):
    """Draw a short recording of 25 frames per second, render its frames, and measure the gap in them."""
    one = draw(seed, noise_mm=0.0, duration_s=12.0 + seed % 9)
    rng = np.random.default_rng(seed)
    px_per_mm = WIDEST_PX / one.gap_mm.max()
    camera = Camera(blur_px=rng.uniform(0.7, 1.5), noise_grey=rng.uniform(1.0, 4.0))
    radius_px = rng.uniform(0.0, 12.0)
    times, gaps = [], []
    for number, (time_s, gap_mm) in enumerate(zip(one.time_s, one.gap_mm, strict=True)):
        scene = two_fingers(gap_mm * px_per_mm, radius_px=radius_px, width_px=40.0, frame=FRAME_PX)
        found = measure_frame(Frame(render(scene, camera, rng), number), Settings(BELOW_PX, Direction.UP))
        if isinstance(found, GapMeasurement):
            times.append(time_s)
            gaps.append(found.gap_px / px_per_mm)
    return replace(one, time_s=np.array(times), gap_mm=np.array(gaps))


def words_of(one: Drawn) -> str:
    """What was drawn."""
    return ", ".join(f"{name} {value}" for name, value in asdict(one.kind).items())


@benchmark(
    series=50,
    seed=1,
    laboratory={"action": "store_true", "help": "draw 25 frames per second"},
    rendered={"action": "store_true", "help": "render these frames, and measure the gap in them"},
    minutes=10.0,
    verbose=False,
)
def main(asked: Namespace) -> None:
    of_seed = of_pictures if asked.rendered else draw if asked.laboratory else of_any_rate
    tally = Counter()
    scores, seconds = [], []
    for number in in_turn(range(asked.series), asked.minutes):
        case = of_seed(1000 * asked.seed + number)
        words = words_of(case)
        begin = process_time()
        found = find_clock_offset(case.time_s, case.gap_mm, DriveHistory(case.log_s, case.input_mm))
        seconds.append(process_time() - begin)
        tally["drawn"] += 1
        if isinstance(found, NoClockOffset):
            tally["refused, one period" if case.kind.motion.startswith("ISO") else "refused, other motion"] += 1
            if asked.verbose:
                print(number, "REFUSED", words, found.words, flush=True)
            continue
        score = (found.offset_s - case.kind.offset_s) / found.u_offset_s
        middle_s = case.time_s.mean()
        off_s = abs(found.log_time_s(middle_s) - case.log_time_s(middle_s))
        scores.append(score)
        tally["within 2u"] += abs(score) < 2.0
        said = any(word in note for note in found.notes for word in ("one frame", "set-points"))
        tally["within 2u in the middle"] += off_s < 2.0 * found.u_time_s
        tally["off by more than a frame"] += off_s * case.kind.frame_hz > 1.0
        tally["of these said"] += off_s * case.kind.frame_hz > 1.0 and said
        if asked.verbose and (abs(score) > 2.0 or off_s * case.kind.frame_hz > 1.0):
            print(
                f"{number} z {score:.2f} off {off_s:.4f} s u {found.u_offset_s:.5f} play {1e3 * found.play_mm:.1f} "
                f"rate {1e6 * found.rate:.0f}+-{1e6 * found.u_rate:.0f} {'SAID' if said else ''} {words}",
                flush=True,
            )
    for name, count in tally.items():
        print(f"{name}: {count}")
    share = tally["within 2u"] / max(len(scores), 1)
    print(f"answered: {len(scores)}, within 2u: {share:.3f}, RMS score {np.sqrt(np.mean(np.square(scores))):.2f}")
    print(f"seconds of processor time: median {np.median(seconds):.2f}, largest {max(seconds):.2f}")
