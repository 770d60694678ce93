"""The path between two samples: nobody recorded it, and a delay shows it."""

from dataclasses import replace

import numpy as np

from fingervision.diagnosis.inference.hypothesis_fit import MANY_STEPS, Explanation, Point, Problem, fit
from fingervision.diagnosis.input.observations import Observations

DELAYS = ("drive_lag", "camera_latency")
RESONANCE = "structural_resonance"
CLEARLY = 10.0
"""Chi-square by which curves must explain the data better than straight lines."""


def likelier_interpolation(data: Observations, problem: Problem, best: Explanation) -> Observations:
    """Read the record along curves where a delay then explains the data better than along straight lines.

    A stage that turns within half a second goes along a curve between samples that are an eighth of a second apart.
    Cut straight, its corners are sharper than the delayed ones that were measured, and a resonance that is damped well
    rounds them.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    problem : Problem
        The observation model in which `best` was found.
    best : Explanation
        What was found; nothing but it is refitted, with a delay in the place of a resonance.

    Returns
    -------
    Observations
        `data` itself where nothing is late or straight lines do as well.
    """
    fixed = any(name in data.chain.fixed for name in DELAYS)
    if data.chain.curved or not (fixed or {*DELAYS, RESONANCE} & set(best.names)):
        return data
    curved = replace(data.chain, curved=True)
    straight, along = (_score(replace(problem, chain=chain), best, fixed) for chain in (data.chain, curved))
    return replace(data, chain=curved) if along < straight - CLEARLY else data


def _score(problem: Problem, best: Explanation, fixed: bool) -> float:
    kept = {name: dict(best.values[name]) for name in best.names if name not in (*DELAYS, RESONANCE)}
    starts: list[Point] = [{**kept, name: {"delay_s": _delay_s(best)}} for name in DELAYS if name in problem.effects]
    starts += [kept] if fixed else []
    return min(
        (fit(problem, tuple(start), start, iterations=MANY_STEPS).score if start else problem.nothing().score)
        for start in starts
    )


def _delay_s(best: Explanation) -> float:
    """Delay that an explanation has, or that its resonance imitates."""
    for name in DELAYS:
        if name in best.names:
            return best.values[name]["delay_s"]
    if RESONANCE in best.names:
        values = best.values[RESONANCE]
        return float(values["damping_ratio"] / (np.pi * values["frequency_hz"]))
    return 0.0
