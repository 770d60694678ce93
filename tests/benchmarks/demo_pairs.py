"""Two effects of any sizes hidden in the demonstration's first run: does any name leave the disagreement standing?

    python -m tests.benchmarks.demo_pairs --draws 300 --seed 41 --jobs 2

The stage goes there and back, the effects act through the measuring chain and every edge has the random noise that the
pictures' measurement has there; pictures themselves are left out, they cost ten times as much.
`fingervision demo --hide A --hide B` does the same with pictures.
"""

from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np

from fingervision.diagnosis.diagnose import diagnose
from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.diagnosis.input.preparation import prepare
from fingervision.domain.effect import Effect
from fingervision.domain.measured_table import MeasuredTable
from fingervision.effects import catalogue
from fingervision.models.corrected import CorrectedModel
from fingervision.models.table import TableModel
from tests.benchmarks.frame import Namespace, answers, benchmark

EDGE_MM = 0.00014
"""Random noise of one edge in the demonstration's pictures (`u_random_mm` of the gap over the square root of 2)."""
RATE_HZ = 25.0
STANDING = 0.05, 3.0
"""Share of the disagreement, and noises, that a name may leave."""
ROUNDING = 1.02


def motion() -> MeasuredTable:
    """Input of a first run there and back, with holds; the gap is filled in later."""
    ends = (0.0, -0.3, 1.4, 0.0)
    parts = [np.zeros(25)]
    for begin, end in pairwise(ends):
        parts += [np.linspace(begin, end, int(abs(end - begin) * RATE_HZ / 0.5)), np.full(13, end)]
    u = np.concatenate(parts)
    time_s = np.arange(u.size) / RATE_HZ
    return MeasuredTable(u, 4.0 + 7.7 * u, np.zeros(u.size), time_s, (slice(0, u.size),), ("1",))


def straight() -> CorrectedModel:
    """The demonstration's simulation: a straight line."""
    at = np.array([-0.6, 1.7])
    gap = 4.2 + 7.7 * at
    return CorrectedModel("line", TableModel("line", at, -0.5 * gap, 0.5 * gap), "line.csv", (-0.6, 1.7), {})


def drawn_values(effect: Effect, table: MeasuredTable, rng: np.random.Generator) -> dict[str, float] | None:
    """Draw any parameters within the bounds that the data leave; sizes over three decades. None where none show."""
    bench = prepare(table, straight())
    searched = effect.search(bench.chain.history)
    if isinstance(searched, str):
        return None
    out = {}
    for p in searched:
        if p.run is not None:
            continue
        if p.neutral is None:
            inside = rng.random()
            log = p.logarithmic and p.lower > 0.0
            out[p.name] = p.lower * (p.upper / p.lower) ** inside if log else p.lower + (p.upper - p.lower) * inside
        else:
            far = p.upper if rng.random() < 0.5 and p.upper > p.neutral else p.lower
            far = p.upper if far == p.neutral else far
            out[p.name] = p.neutral + (far - p.neutral) * 10.0 ** rng.uniform(-3.0, 0.0)
    return out


def one(seed: int) -> tuple[str, bool, bool, str]:
    """Verdict, whether what was hidden is the answer or in the set, whether too much stands, and a line about it."""
    rng = np.random.default_rng(seed)
    table, model = motion(), straight()
    names = [name for name in catalogue() if name != "hinge_stiffness_error"]
    while True:
        pair = sorted(rng.choice(names, 2, replace=False), key=list(catalogue()).index)
        hidden = {name: drawn_values(catalogue()[name], table, rng) for name in pair}
        if all(values is not None for values in hidden.values()):
            break
    chain: MeasuringChain = prepare(table, model).chain
    shown = replace(chain, midline_mm=0.0, seen_midline_mm=None).respond({k: v for k, v in hidden.items() if v})
    left, right = (edge + EDGE_MM * rng.standard_normal(edge.size) for edge in (shown.left_mm, shown.right_mm))
    u_mm = np.full(left.size, EDGE_MM * float(np.sqrt(2.0)))
    measured = replace(table, gap_mm=right - left, midline_mm=0.5 * (left + right), u_random_mm=u_mm)
    report = diagnose(measured, model, seed=seed).report
    d = report.disagreement
    allowed = max(STANDING[0] * d.before_rms_mm, STANDING[1] * EDGE_MM) * ROUNDING
    stands = str(report.verdict) in ("named", "ambiguous") and d.after_rms_mm > allowed
    inside = set(pair) in [set(names) for names in report.alternatives]
    said = " + ".join(effect.name for effect in report.effects)
    line = f"{seed} {'+'.join(pair)}: {report.verdict} {said}; {d.before_rms_mm:.3g} to {d.after_rms_mm:.3g} mm"
    return str(report.verdict), inside, stands, line


@benchmark(draws=300, seed=41, jobs=2, first={"type": int, "default": 0, "help": "number of the first draw"})
def main(arguments: Namespace) -> None:
    """Draw, diagnose, count."""
    seeds = [1000 * arguments.seed + k for k in range(arguments.first, arguments.first + arguments.draws)]
    results = []
    for _, result in answers(one, seeds, arguments.jobs):
        results.append(result)
        _, inside, stands, line = result
        print("STANDS" if stands else "      ", "in " if inside else "out", line, flush=True)
    print(dict(sorted(Counter(verdict for verdict, _, _, _ in results).items())))
    print(
        f"what was hidden is the answer or in its set: {sum(inside for _, inside, _, _ in results)} of {len(results)}"
    )
    print(f"names that leave too much standing: {sum(stands for _, _, stands, _ in results)} of {len(results)}")
