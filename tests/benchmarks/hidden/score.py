"""Marks for one answer, and the table in section 5 of diagnosing.md from all marks."""

from dataclasses import dataclass

import numpy as np

from tests.benchmarks.hidden.binomial import Rate
from tests.benchmarks.hidden.diagnose_adapter import Answer
from tests.benchmarks.hidden.experiment import Row
from tests.benchmarks.hidden.oracle import Judgement


@dataclass(frozen=True, slots=True)
class Mark:
    """Mark of one answer.

    Parameters
    ----------
    right : bool
        Whether verdict and set are right.
    contains_truth : bool
        Whether the simulated effects are in the set, or need not be.
    wrong : bool
        Whether it names effects, and no stated explanation is right; without a simulated effect, any claim, including
        `unknown`.
    named : bool
        Whether it names any effect.
    size, oracle_size : int
        Number of stated explanations, and number of explanations that must be in the set.
    """

    right: bool
    contains_truth: bool
    wrong: bool
    named: bool
    size: int
    oracle_size: int


def mark(row: Row, judgement: Judgement, answer: Answer, hidden: frozenset[str]) -> Mark:
    """Mark one answer; `agrees` is treated as the explanation without an effect."""
    named = answer.verdict in ("named", "ambiguous")
    given = frozenset(answer.sets) if named else frozenset({frozenset[str]()} if answer.verdict == "agrees" else ())
    must, may = frozenset(judgement.must), frozenset(judgement.may)
    if row.foreign:
        return Mark(answer.verdict == "unknown", answer.verdict == "unknown", named, named, len(given), 0)
    nothing: frozenset[str] = frozenset()
    if answer.verdict == "agrees":
        right = nothing in must | may
    else:
        right = bool(given) and must <= given and given <= must | may
    contains = hidden in given or (answer.verdict == "agrees" and right)
    wrong = named and not given & (must | may | {hidden})
    if row.hidden == 0:
        wrong = named or answer.verdict == "unknown"
    return Mark(right, contains, wrong, named, len(given), len(must))


@dataclass(frozen=True, slots=True)
class Covered:
    """Deviation of one parameter relative to its stated uncertainty."""

    name: str
    deviation: float


def intervals(judgement: Judgement, answer: Answer, names_of: dict[str, tuple[str, ...]]) -> list[Covered]:
    """(value - truth) / u of every parameter with an uncertainty, if exactly the simulated effects were named."""
    out = []
    if not answer.sets or answer.sets[0] != frozenset(judgement.effects):
        return out
    for effect in answer.report["effects"]:
        truth = dict(zip(names_of[effect["name"]], judgement.effects[effect["name"]], strict=True))
        for key, p in effect["parameters"].items():
            if not p.get("u") or key not in truth:
                continue
            miss = float(p["value"]) - float(truth[key])
            if key == "phase_rad":
                miss = (miss + np.pi) % (2 * np.pi) - np.pi
            out.append(Covered(f"{effect['name']}.{key}", miss / float(p["u"])))
    return out


def row_lines(row: Row, marks: list[Mark]) -> list[str]:
    """Text lines with the results of a row."""
    n = len(marks)
    if n == 0:
        return []
    right = Rate(sum(m.right for m in marks), n)
    wrong, named = sum(m.wrong for m in marks), sum(m.named for m in marks)
    lines = [f"{row.name:16s} right {right}"]
    if row.hidden:
        lines.append(f"{'':16s} set contains the truth {Rate(sum(m.contains_truth for m in marks), n)}")
        sizes = [(m.size, m.oracle_size) for m in marks if m.named]
        if sizes:
            mine, judge = np.mean(sizes, axis=0)
            lines.append(f"{'':16s} mean size of the set {mine:.2f}, of the judge's {judge:.2f}")
    lines.append(f"{'':16s} wrong {Rate(wrong, n)} of tables, {wrong} of {named} answers that name")
    return lines
