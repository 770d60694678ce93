"""How well the clock offset is found: drawn recordings with a known offset, rate, play and noise.

`python -m tests.benchmarks.clock --series 500 --seed 1` prints the table of tests/benchmarks/README.md.
"""

from collections import Counter
from dataclasses import asdict, dataclass
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
from tests.benchmarks import drawn_recordings
from tests.benchmarks.frame import Namespace, benchmark, in_turn

FINE_HZ = 2000.0
WIDEST_PX, FRAME_PX, BELOW_PX = 230.0, (360, 120), 10.2
"""Largest gap of a rendered recording, its frame, and where it is measured: small frames are measured fast,
and the noise of the gap depends on neither."""
KINDS = ("triangles", "staircase", "strokes", "sine", "wander")


@dataclass(frozen=True)
class Drawn:
    """A recording and a log with their truth; times in s, lengths in mm."""

    time_s: np.ndarray
    gap_mm: np.ndarray
    drive: DriveHistory
    offset_s: float
    rate: float
    frame_s: float
    words: str

    def true_log_time_s(self, time_s):
        return (time_s - self.offset_s - self.drive.time_s[0]) / (1.0 + self.rate) + self.drive.time_s[0]


def positions(rng, kind, duration_s, range_mm):
    """Move a stage for a while: position on a grid of FINE_HZ."""
    n = int(duration_s * FINE_HZ)
    t = np.arange(n) / FINE_HZ
    if kind == "sine":
        whole = np.zeros(n)
        begin, end = 0.1 * duration_s, duration_s * rng.uniform(0.7, 0.9)
        inside = (t > begin) & (t < end)
        whole[inside] = 0.5 * range_mm * (1 - np.cos(2 * np.pi * rng.uniform(0.1, 0.5) * (t[inside] - begin)))
        return whole
    if kind == "wander":
        knots = np.arange(0.0, duration_s + 3.0, rng.uniform(0.8, 3.0))
        return np.interp(t, knots, rng.uniform(0.0, range_mm, knots.size))
    speed = rng.uniform(0.05, 1.0) * range_mm
    at, clock, times, places = 0.0, 0.0, [0.0], [0.0]
    low, high = 0.0, range_mm
    while clock < duration_s:
        dwell = rng.uniform(0.3, 2.0) if kind != "triangles" or clock == 0.0 else 0.0
        clock += dwell
        times.append(clock)
        places.append(at)
        if kind == "staircase":
            target = at + rng.choice([-1, 1]) * range_mm / 8
            target = min(max(target, low), high)
        elif kind == "strokes":
            target = rng.uniform(low, high)
        else:
            target = high if at == low else low
        clock += max(abs(target - at) / speed, 0.02)
        at = target
        times.append(clock)
        places.append(at)
    return np.interp(t, times, places)


def backlash(x, width, state):
    """Play of full width, sample by sample; the state in half widths above the first position."""
    out = np.empty_like(x)
    p = x[0] + state * width / 2
    for i, v in enumerate(x):
        if p < v - width / 2:
            p = v - width / 2
        elif p > v + width / 2:
            p = v + width / 2
        out[i] = p
    return out


def draw(rng):
    """Draw one recording with its log."""
    kind = KINDS[rng.integers(len(KINDS))]
    duration_s = rng.uniform(12.0, 60.0)
    range_mm = rng.uniform(0.3, 2.0)
    fine = positions(rng, kind, duration_s, range_mm)
    width = 0.0 if rng.random() < 0.15 else rng.uniform(0.0, 0.1)
    moved = backlash(fine, width, rng.uniform(-1, 1))
    rate_hz, log_hz = np.exp(rng.uniform(np.log(5), np.log(120))), np.exp(rng.uniform(np.log(20), np.log(200)))
    clock_rate = 0.0 if rng.random() < 0.3 else rng.uniform(-1e-3, 1e-3)
    offset_s = rng.uniform(-60, 60)
    # On the true clock: the recording begins up to 15 % later or earlier than the log, and ends so.
    edge = 0.15 * duration_s
    log_from, log_to = max(0.0, rng.uniform(-edge, edge)), duration_s - max(0.0, rng.uniform(-edge, edge))
    rec_from, rec_to = max(0.0, rng.uniform(-edge, edge)), duration_s - max(0.0, rng.uniform(-edge, edge))
    log_true = np.arange(log_from, log_to, 1 / log_hz)
    rec_true = np.arange(rec_from, rec_to, 1 / rate_hz)
    grid = np.arange(fine.size) / FINE_HZ
    inputs = np.interp(log_true, grid, fine)
    quantum = 0.0 if rng.random() < 0.6 else 10 ** rng.uniform(-4, -2.3)
    inputs = np.round(inputs / quantum) * quantum if quantum else inputs + rng.normal(0, 1e-4, inputs.size)
    u = np.interp(rec_true, grid, moved)
    bend = rng.uniform(-0.03, 0.03)
    gap = 1.2 + 7.72 * (u + bend * u * (u / range_mm - 1))
    noise_mm, rho = 10 ** rng.uniform(-3.7, -2.3), rng.choice([0.0, 0.3, 0.7])
    white = rng.normal(0, noise_mm, gap.size)
    coloured = white.copy()
    for i in range(1, gap.size):
        coloured[i] = rho * coloured[i - 1] + np.sqrt(1 - rho**2) * white[i]
    gap = gap + coloured
    log_clock = log_true - log_from  # the log counts from its own first row
    # recording = log + offset + rate * log, exactly as ClockOffset states it
    rec_clock = (rec_true - log_from) * (1 + clock_rate) + offset_s
    words = (
        f"{kind} {duration_s:.0f} s, {rate_hz:.0f} Hz, log {log_hz:.0f} Hz, play {1e3 * width:.0f} um, encoder "
        f"{1e3 * quantum:.1f} um, noise {1e3 * noise_mm:.1f} um rho {rho}, rate {1e6 * clock_rate:.0f} ppm"
    )
    return Drawn(rec_clock, gap, DriveHistory(log_clock, inputs), offset_s, clock_rate, 1 / rate_hz, words)


def of_laboratory(seed):
    """Draw a recording with creep, slow logs, missing rows, set-points and further motions."""
    one = drawn_recordings.draw(seed)
    kind = one.kind
    words = ", ".join(f"{name} {value}" for name, value in asdict(kind).items())
    drive = DriveHistory(one.log_s, one.input_mm)
    return Drawn(one.time_s, one.gap_mm, drive, kind.offset_s, kind.rate, 1.0 / kind.frame_hz, words)


def of_pictures(seed):
    """Draw a short recording as `of_laboratory`, render its frames, and measure the gap in them."""
    one = drawn_recordings.draw(seed, noise_mm=0.0, duration_s=12.0 + seed % 9)
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
    kind = one.kind
    words = ", ".join(f"{name} {value}" for name, value in asdict(kind).items())
    drive = DriveHistory(one.log_s, one.input_mm)
    return Drawn(np.array(times), np.array(gaps), drive, kind.offset_s, kind.rate, 1.0 / kind.frame_hz, words)


@benchmark(
    series=50,
    seed=1,
    laboratory={"action": "store_true", "help": "draw the recordings of drawn_recordings.py"},
    rendered={"action": "store_true", "help": "render their frames, and measure the gap in these"},
    minutes=10.0,
    verbose=False,
)
def main(asked: Namespace) -> None:
    rng = np.random.default_rng(asked.seed)
    tally = Counter()
    scores, seconds = [], []
    for number in in_turn(range(asked.series), asked.minutes):
        of_seed = of_pictures if asked.rendered else of_laboratory
        case = of_seed(1000 * asked.seed + number) if asked.laboratory or asked.rendered else draw(rng)
        begin = process_time()
        found = find_clock_offset(case.time_s, case.gap_mm, case.drive)
        seconds.append(process_time() - begin)
        periodic = case.words.startswith(("triangles", "motion ISO"))
        tally["drawn"] += 1
        if isinstance(found, NoClockOffset):
            tally["refused, one period" if periodic else "refused, other motion"] += 1
            if asked.verbose:
                print(number, "REFUSED", case.words, found.words, flush=True)
            continue
        score = (found.offset_s - case.offset_s) / found.u_offset_s
        middle_s = case.time_s.mean()
        off_s = abs(found.log_time_s(middle_s) - case.true_log_time_s(middle_s))
        scores.append(score)
        tally["within 2u"] += abs(score) < 2.0
        said = any(word in note for note in found.notes for word in ("one frame", "set-points"))
        tally["within 2u in the middle"] += off_s < 2.0 * found.u_time_s
        tally["off by more than a frame"] += off_s > case.frame_s
        tally["of these said"] += off_s > case.frame_s and said
        if asked.verbose and (abs(score) > 2.0 or off_s > case.frame_s):
            print(
                f"{number} z {score:.2f} off {off_s:.4f} s u {found.u_offset_s:.5f} play {1e3 * found.play_mm:.1f} "
                f"rate {1e6 * found.rate:.0f}+-{1e6 * found.u_rate:.0f} {'SAID' if said else ''} {case.words}",
                flush=True,
            )
    for name, count in tally.items():
        print(f"{name}: {count}")
    share = tally["within 2u"] / max(len(scores), 1)
    print(f"answered: {len(scores)}, within 2u: {share:.3f}, RMS score {np.sqrt(np.mean(np.square(scores))):.2f}")
    print(f"seconds of processor time: median {np.median(seconds):.2f}, largest {max(seconds):.2f}")
