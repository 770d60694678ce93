"""Marks of an answer (exact, set with the truth, part, wrong, unknown, false `agrees`) and of its intervals."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from tests.benchmarks.world.candidates import MAP
from tests.benchmarks.world.draw import drawn
from tests.benchmarks.world.nearest import Judge
from tests.benchmarks.world.right_answers import LAGS, threshold

LEFT_SHARE, LEFT_NOISES = 0.05, 3.0
"""Limits of a named answer: it may leave at most 5 % of the disagreement or 3 times the noise, whichever is larger."""
SIGN_WORDS = (
    "swapped",
    "exchanged",
    "mirrored",
    "wrong sign",
    "turned round",
    "reversed sign",
    "is reversed",
    "opposite sign",
    "opposite direction",
)
COVERAGE_FACTOR = 1.96


@dataclass(frozen=True, slots=True)
class Mark:
    """Mark of one answer.

    Parameters
    ----------
    result : str
        `right` (nothing hidden and `agrees`, or outside and `unknown`), `claim` (nothing hidden, and anything else
        said), `exact`, `set`, `part`, `wrong`, `unknown`, `false agrees`, `no report`.
    leaves : bool
        Whether it names effects, and leaves more of the disagreement than allowed.
    sign_said : bool or None
        Whether a wrong sign is reported, if the table has one.
    deviations : dict
        (value - truth) / u of each parameter, if exactly the simulated effects were named.
    sizes : dict
        Whether each parameter of a named, required effect lies within the tolerance in truth.json.
    """

    result: str
    leaves: bool = False
    sign_said: bool | None = None
    deviations: dict[str, float] = field(default_factory=dict)
    sizes: dict[str, bool] = field(default_factory=dict)


def _turned(angle_rad: float) -> float:
    """The equivalent angle from -pi to pi."""
    return float((angle_rad + np.pi) % (2 * np.pi) - np.pi)


class Marker:
    """Marks answers to one simulated table; an unforeseen set is fitted to the truth before it is marked as wrong."""

    def __init__(self, truth: dict[str, Any]) -> None:
        self.truth = truth
        self.needed = frozenset(truth["needed"])
        self.names = frozenset(h["name"] for h in truth["hidden"])
        right = truth["effects_right"]
        self.core = [frozenset(c) for c in (right[0]["core"] if right else [])]
        self.allowed = frozenset(right[0]["also_allowed"] if right else []) | (self.names - self.needed)

    @cached_property
    def judge(self) -> Judge:
        """Distances for the table, which is simulated again from its numbers."""
        return Judge.of(drawn(**self.truth["drawn_from"]))

    def exchangeable(self, names: frozenset[str]) -> bool:
        """Whether a set of effects is equivalent to the truth: by the groups in truth.json, or by its distance."""
        rest = names - self.allowed
        taken = [next((i for i, group in enumerate(self.core) if n in group), None) for n in rest]
        if None not in taken and len(set(taken)) == len(taken) == len(self.core):
            return True
        # A set with more effects than the truth makes a wrong claim by each additional effect.
        if len(rest) > max(len(self.core), 1):
            return False
        fitted = frozenset("drive_lag" if n in LAGS else n for n in names)
        own = float(self.truth["distance_of_truth"]) if not self.truth["outside_structure"] else 0.0
        begin = {h["name"]: np.array(list(h["parameters"].values())) for h in self.truth["hidden"]}
        known = self.judge.known
        begin = {n: v for n, v in begin.items() if n in known and v.size == len(known[n].names)}
        return self.judge.nearest(fitted, begin, threshold(own)).distance < threshold(own)

    def part(self, names: frozenset[str]) -> bool:
        """Whether all effects of a set are true, but a required effect is missing."""
        known = self.allowed.union(self.names, *self.core)
        return bool(names) and names <= known

    def mark(self, report: dict[str, Any] | None, exit_code: int | None = 0) -> Mark:
        """Mark a report; if there is no report, exit code 1 means that the table was refused with a sentence."""
        if report is None:
            return Mark("right" if exit_code == 1 and self.truth.get("may_refuse") else "no report")
        verdict = report["verdict"]
        names = verdict in ("named", "ambiguous")
        best = frozenset(e["name"] for e in report["effects"])
        sets = [best] + [frozenset(s) for s in report.get("alternatives") or []] if names else []
        said = None
        if self.truth["wrong_sign"]:
            text = str(report).lower()
            said = any(word in text for word in SIGN_WORDS)
        result = self._result(verdict, sets)
        leaves = names and self._leaves(report)
        return Mark(result, leaves, said, self._deviations(report, names), self._sizes(report) if names else {})

    def _sizes(self, report: dict[str, Any]) -> dict[str, bool]:
        found = {}
        for effect in report["effects"]:
            if effect["name"] in self.needed and not self.truth["outside_structure"]:
                for key, p in effect["parameters"].items():
                    true = self.truth["sizes"].get(key)
                    if true is not None:
                        away, room = float(p["value"]) - true["value"], true["tolerance"]
                        if key == "phase_rad":
                            # For a phase, a relative tolerance is meaningless: 15 % of a radian is used.
                            away, room = _turned(away), max(room, 0.15)
                        found[key] = abs(away) <= room
        return found

    def _result(self, verdict: str, sets: list[frozenset[str]]) -> str:
        seen = "agrees" in self.truth["must_not"]
        if not self.truth["hidden"] and not self.truth["outside_structure"]:
            return "right" if verdict == "agrees" else "claim"
        if verdict == "agrees":
            return "false agrees" if seen else "right"
        if verdict == "unknown":
            return "right" if self.truth["outside_structure"] else "unknown"
        if self.truth["outside_structure"]:
            return "set" if any(self.exchangeable(s) for s in sets if self.truth["wrong_sign"]) else (
                "part" if any(self.part(s) for s in sets) else "wrong")  # fmt: skip
        if len(set(sets)) == 1 and sets[0] - self.allowed == self.needed:
            return "exact"
        if any(self.exchangeable(s) for s in sets):
            return "set"
        return "part" if any(self.part(s) for s in sets) else "wrong"

    def _leaves(self, report: dict[str, Any]) -> bool:
        d = report["disagreement"]
        before, after = (float(d[k] or 0.0) for k in ("before_rms_mm", "after_rms_mm"))
        # The true noise of the table, not the noise that the report states.
        return after > max(LEFT_SHARE * before, LEFT_NOISES * float(self.truth["noise_with_input_mm"]))

    def _deviations(self, report: dict[str, Any], names: bool) -> dict[str, float]:
        said = frozenset(e["name"] for e in report["effects"])
        if not names or said != self.names or not self.truth["exact_forms"]:
            return {}
        true = {h["name"]: h["parameters"] for h in self.truth["hidden"]}
        found = {}
        for effect in report["effects"]:
            if effect["name"] == MAP:
                continue
            for key, p in effect["parameters"].items():
                if not p.get("u") or key not in true[effect["name"]]:
                    continue
                miss = float(p["value"]) - float(true[effect["name"]][key])
                if key == "phase_rad":
                    miss = _turned(miss)
                found[f"{effect['name']}.{key}"] = miss / float(p["u"])
        return found
