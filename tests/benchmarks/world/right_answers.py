"""The right answers for one simulated table: effects that must be named, may be named, or are contradicted."""

from dataclasses import dataclass

import numpy as np

from tests.benchmarks.hidden.catalogue_chain import Effects
from tests.benchmarks.world.candidates import MAP, OFFSETS, RATIOS, WITH_START
from tests.benchmarks.world.nearest import Judge
from tests.benchmarks.world.rig import Rig

NEAR, FAR = 4.0, 20.0
"""Squared whitened distances, as in the benchmark `hidden`: below 4 indistinguishable, above 20 distinguishable."""
AS_GOOD = 1.5
"""If the catalogue's formula of the true effects leaves a residual, a set with at most 1.5 times this residual counts
as equivalent."""
BESIDE_OUTSIDE = frozenset({"friction_hysteresis", "thermal_drift"})
"""Effects that may be named for a part of an effect outside the catalogue: a loop, a change with time."""
LAGS = frozenset({"drive_lag", "camera_latency"})
"""Dead times before and after a stage, which are equivalent if nothing in between depends on time."""


@dataclass(frozen=True, slots=True, eq=False)
class RightAnswers:
    """Right answers for a table.

    Parameters
    ----------
    core : tuple of frozenset of str
        For each required effect, the names that are equivalent to it.
    needed : frozenset of str
        Simulated effects that are required.
    allowed : frozenset of str
        Effects that may be named in addition: simulated effects too small to be required, and the line that a map may
        have.
    nothing : float
        Distance of the model without an effect.
    own : float
        Distance that the catalogue's formulas of the simulated effects leave.
    parameters : dict
        Parameters of the simulated effects by the catalogue's formulas, by name.
    """

    core: tuple[frozenset[str], ...]
    needed: frozenset[str]
    allowed: frozenset[str]
    nothing: float
    own: float
    parameters: Effects


def threshold(own: float) -> float:
    """Distance up to which another set counts as equivalent to the truth."""
    return AS_GOOD * own + FAR


def begin_of(rig: Rig, judge: Judge) -> Effects:
    """Simulated parameters as starting values of the fit of the catalogue's formulas."""
    begin: Effects = {}
    for h in rig.hidden:
        if h.name in judge.known:
            c = judge.known[h.name]
            ends = {"upper_mm": c.upper[0], "lower_mm": c.lower[-1]} if h.name == "end_stop" else {}
            begin[h.name] = np.array([h.parameters.get(n, ends.get(n, 0.0)) for n in c.names], dtype=float)
    return begin


def right_answers(rig: Rig) -> tuple[RightAnswers, Judge]:
    """Find the right answers for a table from its truth."""
    judge = Judge.of(rig)
    nothing = judge.nearest(frozenset()).distance
    own = judge.nearest(rig.names, begin_of(rig, judge))
    allowed: set[str] = set()
    if MAP in rig.names or rig.outside:
        allowed |= OFFSETS | RATIOS
    if rig.run_gain:
        # The mean of the gains of a few runs is not zero.
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
    # An effect too small to be required may be replaced by any equivalent effect.
    for family in (OFFSETS, RATIOS):
        if allowed & family:
            allowed |= family
    answers = RightAnswers(tuple(core), frozenset(needed), frozenset(allowed), nothing, own.distance, own.effects)
    return answers, judge


def outside_enough(rig: Rig, judge: Judge, least: float = 25.0) -> bool:
    """Whether no single effect, and no pair with a play, a map or a drift, is close to the truth."""
    helpers = [n for n in ("backlash", MAP, "thermal_drift") if n in judge.known or n == MAP]
    for name in [*judge.known, MAP]:
        for more in [(), *[(h,) for h in helpers]]:
            if judge.nearest(frozenset((name, *more)), asked=least).distance < least:
                return False
    return True
