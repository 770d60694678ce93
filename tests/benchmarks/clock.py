"""How well the clock offset is found: drawn recordings with a known offset, rate, play and noise.

`python -m tests.benchmarks.clock --series 500 --seed 1` prints the table of tests/benchmarks/README.md.
"""

from collections import Counter
from dataclasses import asdict, replace
from time import process_time

import numpy as np

from fingervision.diagnosis.diagnose import diagnose
from fingervision.domain.direction import Direction
from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import FingervisionError
from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.domain.measured_table import FoundClock
from fingervision.interface.column_tables import measured_from_columns
from fingervision.models.corrected import CorrectedModel
from fingervision.models.table import TableModel
from fingervision.motion.clock.alignment import find_clock_offset
from fingervision.motion.clock.clock_offset import NoClockOffset
from fingervision.motion.drive_at import drive_at
from fingervision.rendering import Camera, render, two_fingers
from fingervision.vision.pipeline import Settings, measure_frame
from tests.benchmarks.drawn_recordings import Drawn, draw
from tests.benchmarks.frame import Namespace, benchmark, in_turn
from tests.benchmarks.scores import within

WIDEST_PX, FRAME_PX, BELOW_PX = 230.0, (360, 120), 10.2
"""Largest gap of a rendered recording, its frame, and where it is measured: small frames are measured fast,
and the noise of the gap depends on neither."""
PLAY_ALONE = {"creep": 0.0, "bend": 0.0, "set_points": False}
SLOWEST_HZ, FASTEST_HZ = 5.0, 120.0


def of_any_rate(seed, **fixed):
    """Draw a recording with creep, slow logs, missing rows, set-points and further motions, at any rate of frames."""
    frame_hz = float(np.exp(np.random.default_rng(seed).uniform(*np.log([SLOWEST_HZ, FASTEST_HZ]))))
    return draw(seed, frame_hz=frame_hz, **fixed)


def of_pictures(seed, **fixed):
    """Draw a short recording of 25 frames per second, render its frames, and measure the gap in them."""
    one = draw(seed, noise_mm=0.0, duration_s=12.0 + seed % 9, **fixed)
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


def named_play(one, drive, clock):
    """Play that a diagnosis of the recording names, as an estimate; None without one, or an error's or verdict's words.

    The model is the gap of the drawn mechanism without play, as a table.
    """
    states = [drive_at(drive, clock.log_time_s(time_s)) for time_s in one.time_s]
    kept = [k for k, state in enumerate(states) if state is not None]
    columns = {
        "time_s": [float(one.time_s[k]) for k in kept],
        "input_mm": [states[k].input_mm for k in kept],
        "gap_mm": [float(one.gap_mm[k]) for k in kept],
    }
    over = (min(columns["input_mm"]) - 0.2, max(columns["input_mm"]) + 0.2)
    inputs = np.array(over)
    half = 0.5 * (1.2 + 7.72 * inputs)
    model = CorrectedModel("drawn", TableModel("drawn", inputs, -half, half), "drawn.csv", over, {})
    found = FoundClock(clock.u_time_s, clock.corner_s, clock.u_corner_s)
    table = replace(measured_from_columns(columns), clock=found, log=clock.on_the_recording(drive))
    try:
        report = diagnose(table, model).report
    except FingervisionError as error:
        return str(error)
    named = {effect.name: effect.parameters for effect in report.effects}
    return named["backlash"]["play_mm"] if "backlash" in named else f"{report.verdict} {list(named)}"


def words_of(one: Drawn) -> str:
    """What was drawn."""
    return ", ".join(f"{name} {value}" for name, value in asdict(one.kind).items())


@benchmark(
    series=50,
    seed=1,
    laboratory={"action": "store_true", "help": "draw 25 frames per second"},
    rendered={"action": "store_true", "help": "render these frames, and measure the gap in them"},
    plays={"action": "store_true", "help": "draw plays without creep, and judge those of clock and diagnosis"},
    minutes=10.0,
    verbose=False,
)
def main(asked: Namespace) -> None:
    of_seed = of_pictures if asked.rendered else draw if asked.laboratory else of_any_rate
    tally = Counter()
    scores, seconds, plays = [], [], {"clock": [], "diagnosis": []}
    for number in in_turn(range(asked.series), asked.minutes):
        case = of_seed(1000 * asked.seed + number, **(PLAY_ALONE if asked.plays else {}))
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
        if asked.plays:
            truth_mm = case.kind.play_mm
            plays["clock"].append((found.play_mm - truth_mm) / found.u_play_mm)
            named = named_play(case, DriveHistory(case.log_s, case.input_mm), found)
            if isinstance(named, str):
                tally["no play named, of none" if truth_mm == 0.0 else "no play named"] += 1
            else:
                plays["diagnosis"].append((named.value - truth_mm) / named.u)
            if asked.verbose:
                said = named if isinstance(named, str) else f"{1e3 * named.value:.2f} u {1e3 * named.u:.2f}"
                ours = f"{1e3 * found.play_mm:.2f} u {1e3 * found.u_play_mm:.2f}"
                print(f"{number} play {1e3 * truth_mm:.2f} clock {ours} named {said} | {words}", flush=True)
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
    for name, off in {
        "answered": scores,
        "play of the clock": plays["clock"],
        "play named": plays["diagnosis"],
    }.items():
        if off:
            print(f"{name}: {within(off)}")
    print(f"seconds of processor time: median {np.median(seconds):.2f}, largest {max(seconds):.2f}")
