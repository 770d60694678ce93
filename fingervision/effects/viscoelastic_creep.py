"""Viscoelastic creep: the opening continues to change under a constant input."""

import numpy as np

from fingervision.domain.effect import Array, History, PointEffect, Stage, Values, start_key
from fingervision.domain.loops import filled, loop
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response

_low_pass = loop("low_pass_low_pass")


def low_pass(signal: Array, time_s: Array, tau_s: float, start: float) -> Array:
    """Low-pass filter one run's signal with time constant `tau_s`, from the state `start`; shape (n,)."""
    return filled(_low_pass, signal, np.ascontiguousarray(time_s), tau_s, start)


TAUS_S = (1, 4, 16, 64)
BETWEEN_S = (2, 8, 32)
"""Time constants in the middle of two others: a body that creeps with one of them creeps with neither of the two."""
SLOWER = 2.0
"""Smallest ratio of time constant to dwell at which creep is visible. The dwell before a reading is assumed to be half
of the time between two readings; creep with a shorter time constant depends on when exactly the stage arrived."""


def _share(tau_s: int) -> Parameter:
    """Share that creeps with one time constant; a tenth is much even for a polymer finger."""
    words = f"share of the opening that creeps with a time constant of {tau_s} s"
    return Parameter(f"fraction_{tau_s}s", "", 0.0, 0.5, words, typical=0.1)


def act(response: Response, history: History, values: Values) -> Response:
    """Apply the effect: the opening continues to change under a constant input."""
    opening_mm = response.gap_mm - history.rest_gap_mm
    crept_mm = opening_mm.copy()
    for tau_s in (*TAUS_S, *BETWEEN_S):
        fraction = values.get(f"fraction_{tau_s}s", 0.0)
        if fraction != 0.0:
            for index, run in enumerate(history.runs):
                # The opening that was held before the run is assumed to lie within the recorded openings.
                relaxed_mm = opening_mm[run][0] + values.get(start_key(index), 0.0) * history.opening_mm
                crept_mm[run] -= fraction * (
                    opening_mm[run] - low_pass(opening_mm[run], history.times[run], float(tau_s), relaxed_mm)
                )
    return response.with_gap(history.rest_gap_mm + crept_mm)


def inexact(values: Values) -> tuple[Values, ...]:
    """Creep whose time constants lie between two of the formula's, for as much as creeps with these two."""
    found = []
    for before, between, after in zip(TAUS_S, BETWEEN_S, TAUS_S[1:], strict=False):
        shares = {f"fraction_{tau_s}s": values.get(f"fraction_{tau_s}s", 0.0) for tau_s in (before, after)}
        both = sum(shares.values())
        less = {name: share - 0.5 * both for name, share in shares.items()}
        found.append({**values, **less, f"fraction_{between}s": both})
    return tuple(found)


def narrow(history: History) -> tuple[Parameter, ...] | str:
    """Exclude time constants much shorter than the stage's rest before each reading, whose creep would be complete."""
    kept = tuple(p for p, tau_s in zip(EFFECT.parameters, TAUS_S, strict=True) if tau_s >= SLOWER * history.dwell_s)
    if not kept:
        return (
            f"the stage is assumed to have rested for {history.dwell_s:.3g} s or longer before each reading, when "
            "creep has ended"
        )
    return kept


EFFECT = PointEffect(
    name="viscoelastic_creep",
    stage=Stage.MECHANISM,
    order=110,
    words="the opening continues to change while the input is held",
    formula="o - sum of a_k (o - low-pass_k[o]), tau_k = 1, 4, 16, 64 s",
    source="generalised Maxwell body (Ferry 1980)",
    residual="an error that decays exponentially during holds",
    parameters=tuple(_share(tau_s) for tau_s in TAUS_S),
    needs_times=True,
    memory=True,
    most_together=0.5,
    start="opening to which the body had relaxed before the run, minus its first opening, over the largest opening",
    narrow=narrow,
    inexact=inexact,
    demonstrated=True,
    act=act,
)
