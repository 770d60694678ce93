"""The right answers for one drawn table: what must be named, what may be, and what the data contradict."""

from dataclasses import dataclass

import numpy as np

from tests.benchmarks.world.candidates import MAP, OFFSETS, RATIOS, WITH_START
from tests.benchmarks.world.definitions import Effects
from tests.benchmarks.world.nearest import Judge
from tests.benchmarks.world.rig import Rig

NEAR, FAR = 4.0, 20.0
"""Squared whitened distances, as in the hidden-effect benchmark: nearer than 4 cannot be told, farther than 20 can."""
AS_GOOD = 1.5
"""Where the truth's own form leaves something, a set that leaves at most half as much again is as good a form."""
BESIDE_OUTSIDE = frozenset({"friction_hysteresis", "thermal_drift"})
"""What a careful reader may say of a part of a thing outside: a loop, a change with time."""
LAGS = frozenset({"drive_lag", "camera_latency"})
"""A dead time before a stage or after it: nothing between the two knows the time of day."""


@dataclass(frozen=True, slots=True, eq=False)
class RightAnswers:
    """What may be said of a table.

    Parameters
    ----------
    core : tuple of frozenset of str
        For each effect that is needed, the names that are exchangeable with it; the first set's members are each one
        answer.
    needed : frozenset of str
        The hidden effects that are needed.
    allowed : frozenset of str
        What may stand beside them: hidden effects too small to be needed, and the line that a map may have.
    nothing : float
        Distance of no effect at all.
    own : float
        What the catalogue's form of the hidden effects leaves.
    parameters : dict
        The hidden effects in the catalogue's form, by name.
    """

    core: tuple[frozenset[str], ...]
    needed: frozenset[str]
    allowed: frozenset[str]
    nothing: float
    own: float
    parameters: Effects


def threshold(own: float) -> float:
    """Distance up to which another set is as good as the truth."""
    return AS_GOOD * own + FAR


def begin_of(rig: Rig, judge: Judge) -> Effects:
    """The drawn parameters as a beginning of the fit of the truth's own form."""
    begin: Effects = {}
    for h in rig.hidden:
        if h.name in judge.known:
            c = judge.known[h.name]
            ends = {"upper_mm": c.upper[0], "lower_mm": c.lower[-1]} if h.name == "end_stop" else {}
            begin[h.name] = np.array([h.parameters.get(n, ends.get(n, 0.0)) for n in c.names], dtype=float)
    return begin


def right_answers(rig: Rig) -> tuple[RightAnswers, Judge]:
    """Judge a table from its truth."""
    judge = Judge.of(rig)
    nothing = judge.nearest(frozenset()).distance
    own = judge.nearest(rig.names, begin_of(rig, judge))
    allowed: set[str] = set()
    if MAP in rig.names or rig.outside:
        allowed |= OFFSETS | RATIOS
    if rig.run_gain:
        # The gains of a few runs have a mean of their own.
        allowed |= RATIOS
    if rig.outside:
        allowed |= BESIDE_OUTSIDE
    needed = set(rig.names)
    for name in sorted(rig.names, key=lambda n: n in WITH_START or n == MAP):
        without = judge.nearest(frozenset(needed - {name}), own.effects, own.distance + FAR).distance
        if without < own.distance + FAR and len(needed) > 0:
            needed.discard(name)
            allowed.add(name)
    if rig.outside and not rig.hidden:
        needed = set()
    limit = threshold(own.distance)
    core = []
    for name in sorted(needed):
        same = {name}
        for other in judge.known:
            if other in rig.names or other in allowed:
                continue
            found = judge.nearest(frozenset(needed - {name} | {other}), own.effects, limit)
            if found.distance < limit:
                same.add(other)
        core.append(frozenset(same | (LAGS if same & LAGS else set())))
    # What merely stands for something too small to be needed may be said by any of its family.
    for family in (OFFSETS, RATIOS):
        if allowed & family:
            allowed |= family
    answers = RightAnswers(tuple(core), frozenset(needed), frozenset(allowed), nothing, own.distance, own.effects)
    return answers, judge


def outside_enough(rig: Rig, judge: Judge, least: float = 25.0) -> bool:
    """Whether no single effect, and no pair with a play, a map or a drift, comes near."""
    helpers = [n for n in ("backlash", MAP, "thermal_drift") if n in judge.known or n == MAP]
    for name in [*judge.known, MAP]:
        for more in [(), *[(h,) for h in helpers]]:
            if judge.nearest(frozenset((name, *more)), asked=least).distance < least:
                return False
    return True
