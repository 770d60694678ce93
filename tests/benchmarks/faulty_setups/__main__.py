"""Whether `fingervision inspect` names the worst fault first, and whether its costs are true.

    python -m tests.benchmarks.faulty_setups [--setups 500] [--good 100] [--frames 8] [--seed 1] [--only NAME...]

For every fault: set-ups, how many have it named first, the others that were named instead; the median cost that was
stated for it, and the median error of the gap that the drawing shows (RMS over the frames of measured less true gap,
less the same of the bench without the fault; for vibration the standard deviation of the camera's place), in µm.
Nobody states the camera's response: it is found out, or said to be unknown.
"""

import tempfile
from collections import Counter
from pathlib import Path

import cv2
import numpy as np

from calib.calibration import BareScale
from fingervision.frames.source import Wish
from fingervision.frames.source_kinds import open_source
from fingervision.inspection.catalogue import inspect, to_mend
from fingervision.inspection.sample import take_sample
from fingervision.measuring.task import Task
from tests.benchmarks.faulty_setups.bench import BELOW_MM, PX_PER_MM, Bench, recorded
from tests.benchmarks.faulty_setups.faults import FAULTS, good
from tests.benchmarks.frame import Namespace, benchmark


def inspected(bench: Bench, frames: int, rng: np.random.Generator):
    """Findings of a bench, worst first, and the errors of its gaps (µm)."""
    recording = recorded(bench, frames, rng)
    scale = BareScale(PX_PER_MM * bench.zoom)
    with tempfile.TemporaryDirectory() as folder:
        for k, picture in enumerate(recording.pictures):
            if isinstance(picture, bytes):
                (Path(folder) / f"{k:03d}.jpg").write_bytes(picture)
            else:
                cv2.imwrite(str(Path(folder) / f"{k:03d}.png"), picture)
        source = open_source(folder, Wish(rate_hz=25.0))
        settings, _ = Task(scale, below_tip_mm=BELOW_MM).settings_for(source.description.files)
        sample = take_sample(source, source.description, settings, scale)
        findings = inspect(sample)
    track = sample.track
    error_um = np.array([])
    if len(track):
        gaps = np.array([recording.gaps_mm[int(place)] for place in track[:, 0]])
        error_um = 1e3 * ((track[:, 2] - track[:, 1]) / scale.px_per_mm - gaps)
    return findings, error_um, sample


@benchmark(setups=500, good=100, frames=8, seed=1, only={"nargs": "*", "choices": list(FAULTS)}, verbose=False)
def main(options: Namespace) -> None:
    rng = np.random.default_rng(options.seed)
    named, drawn = 0, 0
    print("fault         set-ups  first   stated um   error um   named instead")
    for name in (options.only or FAULTS) if options.setups else ():
        count = -(-options.setups // len(options.only or FAULTS))
        right, instead, stated, errors = 0, Counter(), [], []
        for _ in range(count):
            bench = FAULTS[name](good(rng), rng)
            findings, error_um, _ = inspected(bench, options.frames, rng)
            mend = to_mend(findings)
            first = mend[0].name if mend else "nothing"
            right += first == name
            if first != name:
                instead[first] += 1
                if options.verbose:
                    print(name, bench)
                    for each in findings[:4]:
                        print("    ", each.name, each.severity, each.cost_um, each.figure)
            cost = next((each.cost_um for each in findings if each.name == name), None)
            if cost is not None and error_um.size:
                stated.append(cost)
                shake_um = 1e3 * bench.shake_px / PX_PER_MM
                errors.append(shake_um or float(np.sqrt(np.mean(error_um**2))))
        named, drawn = named + right, drawn + count
        print(
            f"{name:13s} {count:7d} {100 * right / count:5.1f} % {np.median(stated) if stated else 0.0:10.2f} "
            f"{np.median(errors) if errors else 0.0:10.2f}   {dict(instead) or ''}",
            flush=True,
        )
    print(f"worst fault named first: {named} of {drawn} ({100 * named / max(drawn, 1):.1f} %)")
    quiet, wrong, errors = 0, Counter(), []
    for _ in range(options.good):
        findings, error_um, _ = inspected(good(rng), options.frames, rng)
        mend = to_mend(findings)
        quiet += not mend
        wrong.update(each.name for each in mend)
        errors.append(float(np.sqrt(np.mean(error_um**2))) if error_um.size else 0.0)
        if mend and options.verbose:
            for each in mend:
                print("    good:", each.name, each.cost_um, each.figure)
    if options.good:
        print(
            f"nothing to mend: {quiet} of {options.good} good ones ({100 * quiet / options.good:.1f} %), error "
            f"{np.median(errors):.2f} um; {dict(wrong) or ''}"
        )
