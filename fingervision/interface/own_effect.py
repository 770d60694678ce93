"""`@fingervision.effect`: turns a function into an effect of the catalogue."""

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from fingervision.domain.effect import DriveEffect, Effect, PointEffect, Stage
from fingervision.domain.errors import ArgumentError, ArgumentTypeError
from fingervision.domain.parameter import Parameter
from fingervision.effects import catalogue, register, withdraw
from fingervision.interface.argument_checks import one_of, speaks_python
from fingervision.plugins.watched_import import importing

ARGUMENTS = 3
"""Number of arguments of an effect's function: the signal, the history, and the values of the parameters."""
_registered: dict[str, Effect] = {}
"""Effects that the decorator added, by name."""


@speaks_python
def effect(
    stage: str,
    parameters: Parameter | Iterable[Parameter],
    *,
    name: str | None = None,
    source: str = "this session",
    residual: str = "not described",
    after: str | None = None,
    **needs: Any,
) -> Callable[[Callable[..., Any]], Effect]:
    """Turn a function into a user-defined effect, and add it to the catalogue of this process.

    The first sentence of the function's docstring describes the effect; any further text is its formula.

    Parameters
    ----------
    stage : str
        Section of the measuring chain in which the effect acts: drive (the function receives and returns the input in
        mm, shape (n,)), mechanism or camera (the function receives and returns a `Response`, the two measuring points).
    parameters : Parameter or iterable of Parameter
        Parameters with bounds; one parameter, the size, has a neutral value at which the effect changes nothing.
    name : str or None
        Name of the effect; None takes the name of the function.
    source : str
        Source of the law.
    residual : str
        Description of the residual (measured minus simulated) that the effect causes.
    after : str or None
        Effect of the same section after which this effect acts; None puts the effect after all effects of its section.
    **needs
        Further fields of an effect: needs_times, needs_shared_clock, needs_edges, needs_force, memory, start, narrow.

    Returns
    -------
    callable
        A decorator that returns the effect.

    Raises
    ------
    ArgumentError
        An argument has an impossible value, or the name of a built-in effect.

    Examples
    --------
    The picture is stretched on the right of its middle:

    >>> from dataclasses import replace
    >>> import fingervision as fv
    >>> @fv.effect("camera", fv.Parameter("stretch", "", -0.05, 0.05, "how much longer the right half looks"))
    ... def half_stretch(points, history, values):
    ...     '''The right half of the picture is stretched.'''
    ...     longer = 1.0 + values["stretch"]
    ...     return replace(points, right_mm=points.right_mm * longer)
    >>> fv.effects["half_stretch"].words
    'the right half of the picture is stretched'
    >>> from fingervision.effects import withdraw
    >>> withdraw("half_stretch")
    """
    where = Stage(one_of("stage", stage, tuple(Stage)))
    listed = (parameters,) if isinstance(parameters, Parameter) else tuple(parameters)
    given: tuple[Any, ...] = listed
    if not given or not all(isinstance(each, Parameter) for each in given):
        raise ArgumentTypeError("parameters", "be one fingervision.Parameter or several", f"is {parameters!r}")
    for each in listed:
        if not each.lower < each.upper:
            raise ArgumentError(
                "parameters", "have lower below upper", f"{each.name} has {each.lower:g} and {each.upper:g}"
            )
    allowed = {
        "needs_times", "needs_shared_clock", "needs_edges", "needs_force", "memory", "start", "narrow", "act_curved",
    }  # fmt: skip
    for key in needs:
        one_of("effect", key, sorted(allowed))
    order = _order(where, after)

    def made(function: Callable[..., Any]) -> Effect:
        if len(inspect.signature(function).parameters) != ARGUMENTS:
            raise ArgumentTypeError("effect", "decorate a function of (signal, history, values)", f"is {function!r}")
        words, formula = _sentences(function)
        kind: Any = DriveEffect if where == Stage.DRIVE else PointEffect
        own: Effect = kind(
            name=name or function.__name__,
            stage=where,
            order=order,
            words=words,
            formula=formula,
            source=source,
            residual=residual,
            parameters=listed,
            act=function,
            **needs,
        )
        # The code that imports a file of effects adds its effects, with their origin.
        if not importing():
            _registered[own.name] = register(own)
        return own

    return made


@contextmanager
def added(effects: Iterable[Effect]) -> Iterator[None]:
    """Add effects to the catalogue for the duration of a `with` block; effects already in the catalogue stay."""
    known = catalogue()
    new = [each for each in effects if not (each.name in known and _registered.get(each.name) is each)]
    try:
        for each in new:
            register(each)
        yield
    finally:
        for each in new:
            withdraw(each.name)
            if each.name in known:
                register(_registered.get(each.name, known[each.name]))


def _order(stage: Stage, after: str | None) -> float:
    known = catalogue()
    if after is None:
        # The effect acts last in its section; effects with the same order are sorted by name.
        return max((each.order for each in known.values() if each.stage == stage), default=0.0) + 1.0
    own_stage: Mapping[str, Effect] = {key: each for key, each in known.items() if each.stage == stage}
    return own_stage[one_of("after", after, own_stage)].order


def _sentences(function: Callable[..., Any]) -> tuple[str, str]:
    """Description and formula of an effect from a docstring."""
    text = inspect.getdoc(function) or ""
    first, _, rest = text.partition("\n\n")
    words = " ".join(first.split()).rstrip(".")
    if not words:
        raise ArgumentError(
            "effect", "decorate a function with a docstring that says what happens", f"{function.__name__} has none"
        )
    formula = " ".join(rest.split()) or f"{function.__name__}(signal, history, values)"
    return words[0].lower() + words[1:], formula
