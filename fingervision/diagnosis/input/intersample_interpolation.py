"""Interpolation of the input between two samples, which matters for delays."""

from dataclasses import replace

from fingervision.diagnosis.inference.hypothesis import Explanation, Point, Problem
from fingervision.diagnosis.inference.hypothesis_fit import MANY_STEPS, fit
from fingervision.diagnosis.input.observations import Observations
from fingervision.effects import catalogue
from fingervision.effects.time_delay import is_delay

CLEARLY = 10.0
"""Chi-square by which curves must fit better than straight lines."""


def likelier_interpolation(data: Observations, problem: Problem, best: Explanation) -> Observations:
    """Interpolate the input by curves, if a delay then explains the data better than with straight lines.

    A stage that reverses within half a second moves along a curve between samples an eighth of a second apart. With
    straight lines, the interpolated reversals are sharper than the measured, delayed ones, and a well-damped resonance
    would seem to explain the rounding.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    problem : Problem
        Observation model with which `best` was found.
    best : Explanation
        The explanation found; only this is refitted, with a delay instead of a resonance.

    Returns
    -------
    Observations
        `data` itself if there is no delay, if straight lines fit as well, or if the input is a command, which jumps.
    """
    fixed = any(name in data.chain.fixed for name in delays())
    if data.chain.curved or data.chain.history.commanded or not (fixed or _like_delays() & set(best.names)):
        return data
    curved = replace(data.chain, curved=True)
    straight, along = (_score(replace(problem, chain=chain), best, fixed) for chain in (data.chain, curved))
    return replace(data, chain=curved) if along < straight - CLEARLY else data


def _score(problem: Problem, best: Explanation, fixed: bool) -> float:
    kept = {name: dict(best.values[name]) for name in best.names if name not in _like_delays()}
    starts: list[Point] = [{**kept, name: {"delay_s": _delay_s(best)}} for name in delays() if name in problem.effects]
    starts += [kept] if fixed else []
    return min(fit(problem, tuple(start), start, iterations=MANY_STEPS).score for start in starts)


def delays() -> tuple[str, ...]:
    """Names of the effects that are a delay, in the catalogue's order."""
    return tuple(name for name, effect in catalogue().items() if is_delay(effect))


def _like_delays() -> frozenset[str]:
    return frozenset(name for name, effect in catalogue().items() if effect.delay_s is not None)


def _delay_s(best: Explanation) -> float:
    """Delay (s) of the explanation, or the delay to which one of its other effects is equivalent; 0 without either."""
    effects = [effect for name, effect in catalogue().items() if name in best.names and effect.delay_s is not None]
    for effect in sorted(effects, key=lambda effect: not is_delay(effect)):
        assert effect.delay_s is not None  # noqa: S101 - chosen so above
        return float(effect.delay_s(best.values[effect.name]))
    return 0.0
