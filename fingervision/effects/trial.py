"""Check that an object is a valid effect, by its fields and by its response on a few samples."""

from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from types import ModuleType

import numpy as np

from fingervision.domain.effect import Array, DriveEffect, Effect, History, PointEffect, Stage, Values
from fingervision.domain.errors import FingervisionError, error_words
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response
from fingervision.plugins.faults import MisfitError

ROUNDING_MM = 1e-9
"""Tolerance for rounding errors of a few operations on numbers of some millimetres."""
SAMPLES = 12
"""Number of samples in the trial: two runs of opening and return, with reversals and starts of runs."""


class EffectAnswerError(FingervisionError):
    """An effect from outside the package failed or returned an invalid response at certain parameter values.

    Parameters
    ----------
    name : str
        Name of the effect.
    words : str
        Description of the failure.
    """

    def __init__(self, name: str, words: str) -> None:
        super().__init__(f"The effect {name} {words}: correct it, or leave it out with --without {name}.")
        self.name, self.words = name, words


def effects_in(held: object, built_in: Iterable[Effect]) -> dict[str, Effect]:
    """Return the effects that a module defines at its top level, or the object if it is an effect, after a trial.

    Parameters
    ----------
    held : object
        A module or an effect.
    built_in : iterable of Effect
        The effects of this package; one that a module imports is not its own.

    Raises
    ------
    MisfitError
        An object is not an effect, or its function returns an invalid response.
    """
    found: list[object] = [held]
    if isinstance(held, ModuleType):
        ours = {id(effect) for effect in built_in}
        own = {id(value): value for value in vars(held).values() if isinstance(value, Effect) and id(value) not in ours}
        found = list(own.values())
        if not found and hasattr(held, "EFFECT"):
            found = [held.EFFECT]
    checked: dict[str, Effect] = {}
    for thing in found:
        effect = try_effect(thing)
        if effect.name in checked:
            raise MisfitError(f"must give each effect a name of its own, but has two effects {effect.name}")
        checked[effect.name] = guarded(effect)
    return checked


def try_effect(effect: object) -> DriveEffect | PointEffect:
    """Check that an effect meets every requirement on effects, and return it.

    Raises
    ------
    MisfitError
        If the object is not a valid effect; the message states what it must be and what it is.
    """
    if not isinstance(effect, DriveEffect | PointEffect):
        raise MisfitError(f"must be a DriveEffect or a PointEffect, but is of type {type(effect).__name__}")
    name = str(effect.name)
    if not (name.isidentifier() and name.islower()):
        raise MisfitError(f"must have a name of small letters and underscores, but is named {name!r}")
    if effect.stage not in tuple(Stage) or (effect.stage == Stage.DRIVE) != isinstance(effect, DriveEffect):
        where = "mechanism or camera" if isinstance(effect, PointEffect) else "drive"
        raise MisfitError(
            f"must have the stage {where}, because it is a {type(effect).__name__}, but its stage is {effect.stage!s}"
        )
    if not effect.parameters or not all(isinstance(p, Parameter) for p in effect.parameters):
        raise MisfitError("must have a tuple of at least one Parameter, but has none")
    for p in effect.parameters:
        if not p.lower < p.upper:
            raise MisfitError(
                f"must have lower below upper for each parameter, but {p.name} has {p.lower:g} and {p.upper:g}"
            )
    for word in ("words", "formula", "source", "residual"):
        if not isinstance(getattr(effect, word), str) or not getattr(effect, word):
            raise MisfitError(f"must state its {word} in a few words, but does not")
    history = trial_history()
    searched = effect.search(history)
    if isinstance(searched, str):
        return effect  # the effect cannot be seen in so few samples
    values = {p.name: 0.0 if p.run is not None else float(p.starting_values()[0]) for p in searched}
    neutral = neutral_values(searched)
    # A period of 0 lies beyond its bounds, and an effect need not answer for it.
    least = {p.name: min(max(0.0, p.lower), p.upper) for p in searched}
    try:
        _moved_mm(effect, history, values)
        moved_mm = [_moved_mm(effect, history, each) for each in (neutral, least)]
    except EffectAnswerError as error:
        raise MisfitError(str(error).split(f"{name} ", 1)[1].split(": correct it")[0]) from error
    if min(moved_mm) > ROUNDING_MM:
        raise MisfitError(
            f"must change nothing at {_told(neutral)} or with all of them 0, but changes its input by "
            f"{moved_mm[0]:.3g} and {moved_mm[1]:.3g} mm"
        )
    return effect


def neutral_values(searched: Iterable[Parameter]) -> dict[str, float]:
    """Parameter values at which an effect must change nothing; shape parameters get their starting values."""
    return {
        p.name: 0.0 if p.run is not None else float(p.starting_values()[0]) if p.neutral is None else p.neutral
        for p in searched
    }


def guarded(effect: DriveEffect | PointEffect) -> Effect:
    """Wrap an effect so that each of its responses is checked; the error for an invalid response names the effect."""
    if isinstance(effect, DriveEffect):
        return replace(effect, act=partial(_checked_drive, effect))
    return replace(effect, act=partial(_checked_points, effect))


def trial_history() -> History:
    """Return a history of twelve samples in two runs, with times, both edges and a force."""
    way = np.array([0.0, 0.4, 0.8, 1.2, 0.6, 0.1])
    return History(
        input_mm=np.concatenate([way, way - 0.2]),
        time_s=0.1 * np.arange(float(SAMPLES)),
        runs=(slice(0, 6), slice(6, 12)),
        rest_gap_mm=4.0,
        opening_mm=9.0,
        closing_mm=1.5,
        force=True,
    )


def _moved_mm(effect: DriveEffect | PointEffect, history: History, values: Values) -> float:
    """Largest change (mm, or N of the force) that an effect makes to the samples of the trial."""
    if isinstance(effect, DriveEffect):
        return float(np.max(np.abs(_checked_drive(effect, history.input_mm, history, values) - history.input_mm)))
    gap = 4.0 + 7.5 * history.input_mm
    given = Response(0.3 - 0.5 * gap, 0.3 + 0.5 * gap, 2.0 * history.input_mm)
    answer = _checked_points(effect, given, history, values)
    pairs = [(getattr(one, name) for one in (given, answer)) for name in ("left_mm", "right_mm", "force_n")]
    return max(float(np.max(np.abs(after - before))) for before, after in pairs)


def _checked_drive(effect: DriveEffect, input_mm: Array, history: History, values: Values) -> Array:
    asked = input_mm.copy()
    try:
        answer = effect.act(input_mm, history, values)
    except Exception as error:
        raise EffectAnswerError(effect.name, _raised(error, values)) from error
    _same(effect.name, "input", answer, input_mm.shape, values)
    if not np.array_equal(asked, input_mm, equal_nan=True):
        raise EffectAnswerError(
            effect.name, "must not change the array of inputs that it is given, but changed it in place"
        )
    return answer


def _checked_points(effect: PointEffect, response: Response, history: History, values: Values) -> Response:
    try:
        answer = effect.act(response, history, values)
    except Exception as error:
        raise EffectAnswerError(effect.name, _raised(error, values)) from error
    if not isinstance(answer, Response):
        found = f"returned a {type(answer).__name__} (the first argument's with_gap(gap_mm) makes a Response)"
        raise EffectAnswerError(effect.name, f"must return a Response, but {found}")
    for side in ("left_mm", "right_mm"):
        _same(effect.name, side, getattr(answer, side), response.left_mm.shape, values)
    if (answer.force_n is None) != (response.force_n is None):
        raise EffectAnswerError(effect.name, "must return a force if, and only if, it is given a force, but does not")
    if answer.force_n is not None:
        _same(effect.name, "force_n", answer.force_n, response.left_mm.shape, values)
    return answer


def _same(name: str, what: str, answer: object, shape: tuple[int, ...], values: Values) -> None:
    if not isinstance(answer, np.ndarray) or answer.dtype.kind != "f":
        kind = f"array of {answer.dtype}" if isinstance(answer, np.ndarray) else type(answer).__name__
        raise EffectAnswerError(name, f"must return {what} as an array of float, but returned a {kind}")
    if answer.shape != shape:
        raise EffectAnswerError(
            name, f"must return {what} in the shape {shape} of its input, but returned the shape {answer.shape}"
        )
    if not np.all(np.isfinite(answer)):
        raise EffectAnswerError(name, f"must return finite numbers, but returned NaN or infinity at {_told(values)}")


def _raised(error: Exception, values: Values) -> str:
    return (
        "must return a result for all parameter values within their bounds, but raised "
        f"{error_words(error)} at {_told(values)}"
    )


def _told(values: Values) -> str:
    return ", ".join(f"{key} = {value:.6g}" for key, value in values.items())
