"""The measuring chain: recorded input, drive effects, the gripper, mechanism effects, camera effects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import Array, DriveEffect, Effect, History, InputPath, PointEffect, Values
from fingervision.domain.model import Model, PhysicalLaw, PhysicalModel
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response
from fingervision.effects import catalogue
from fingervision.effects.time_delay import is_delay, late

SLOPE_STEP = 1e-3
"""Step, as a share of the range, for the derivative of the prediction with respect to the input."""
SAME_S = 1e-9
"""Times closer than this are one point: the rounding of a difference of two times."""


def delayed_path(history: History, rows: NDArray[np.intp], delay_s: float, *, curved: bool) -> InputPath:
    """Add points at the times `delay_s` before each point of a path, which become the rows.

    An effect with memory, such as a play, changes its output between the points of a path: where the stage turns, and
    where the play is taken up. A delay that acts before it on the points alone would miss the turning points, and one
    that acts behind it would interpolate over the places where the play is taken up.

    Parameters
    ----------
    history : History
        History along the path, with times.
    rows : ndarray of int, shape (n,)
        Points of the path at which rows lie.
    delay_s : float
        The delay.
    curved : bool
        Whether the input follows curves between the points (`late`).

    Returns
    -------
    InputPath
        The path with the added points; its rows are the points `delay_s` earlier than the given ones.
    """
    earlier_mm = late(history.input_mm, history, delay_s, curved=curved)
    inputs, times, runs = [], [], []
    place = np.zeros(history.input_mm.size, dtype=np.intp)
    begin = 0
    for run in history.runs:
        time_s = history.times[run]
        ago_s = np.maximum(time_s - delay_s, time_s[0])
        next_to = np.clip(np.searchsorted(time_s, ago_s - SAME_S), 0, time_s.size - 1)
        new = np.abs(time_s[next_to] - ago_s) > SAME_S
        every_s = np.concatenate([time_s, ago_s[new]])
        order = np.argsort(every_s, kind="stable")
        to = np.empty(order.size, dtype=np.intp)
        to[order] = np.arange(order.size)
        place[run] = begin + to[next_to]
        place[run][new] = begin + to[time_s.size :]
        inputs.append(np.concatenate([history.input_mm[run], earlier_mm[run][new]])[order])
        times.append(every_s[order])
        runs.append(slice(begin, begin + order.size))
        begin += order.size
    longer = replace(history, input_mm=np.concatenate(inputs), time_s=np.concatenate(times), runs=tuple(runs))
    return InputPath(longer, place[rows], np.full(begin, -1, dtype=np.intp))


Settings = Mapping[str, Values]


@dataclass(frozen=True, eq=False)
class MeasuringChain:
    """A model with its input history; enabled effects act in the order of the catalogue.

    Parameters
    ----------
    model : Model
        Model of the gripper.
    history : History
        Input, times and runs.
    fixed : mapping
        Effects that are part of the model (for a corrected model).
    midline_mm : float
        Position of the fingers' midline in the picture, because camera effects act about the picture's centre.
    seen_midline_mm : float or None
        Median position of the midline as the camera sees it; the true position differs if the camera shifts it. None if
        `midline_mm` is known from another source.
    curved : bool
        Whether the input follows curves between samples, which matters for delays, or straight lines.
    path : InputPath or None
        Path of the input between the measured rows, and outside them; None if the measured rows contain all of it.
    dynamics : (ndarray of float, Response) or None
        Difference of a dynamic model from its static response along a path, with the times of this path.
    """

    model: Model
    history: History
    fixed: Settings
    midline_mm: float = 0.0
    seen_midline_mm: float | None = None
    curved: bool = False
    path: InputPath | None = None
    dynamics: tuple[Array, Response] | None = None

    @cached_property
    def effects(self) -> Mapping[str, Effect]:
        """The effects of the catalogue in order, each in the form that this model computes."""
        laws = own_laws(self.model)
        effects = {name: obeyed(effect, laws.get(name)) for name, effect in catalogue().items()}
        return {name: _along_curves(effect) for name, effect in effects.items()} if self.curved else effects

    @cached_property
    def _stages(self) -> tuple[tuple[DriveEffect, ...], tuple[PointEffect, ...]]:
        """Effects of the drive, and effects of mechanism and camera, each group in the catalogue's order."""
        effects = self.effects.values()
        drives = tuple(effect for effect in effects if isinstance(effect, DriveEffect))
        return drives, tuple(effect for effect in effects if isinstance(effect, PointEffect))

    @cached_property
    def _late(self) -> frozenset[str]:
        """Delays, unless the input is a command, or without times."""
        if self.history.commanded or self.history.time_s is None:
            return frozenset()
        return frozenset(effect.name for effect in (*self._stages[0], *self._stages[1]) if is_delay(effect))

    @cached_property
    def _driven(self) -> dict[object, Response]:
        """Response of the model without effects, and to the latest drive effects, by the drive effects' parameters.

        Explanations that differ in the effects of mechanism and camera share it.
        """
        return {}

    def with_input(self, input_mm: Array) -> "MeasuringChain":
        """Replace the recorded input of the measured rows, and of the points of the path that repeat these rows.

        `input_mm` of shape (n,).
        """
        path = None if self.path is None else self.path.moved(input_mm - self.history.input_mm)
        return replace(self, history=replace(self.history, input_mm=input_mm), path=path)

    def along_errors(self, error_mm: Array) -> "MeasuringChain":
        """Return the chain with an input that differs along its path; `error_mm` of shape (m,)."""
        along = self.along
        path = replace(along, history=replace(along.history, input_mm=along.history.input_mm + error_mm))
        history = replace(self.history, input_mm=self.history.input_mm + error_mm[along.rows])
        return replace(self, history=history, path=path)

    @cached_property
    def along(self) -> InputPath:
        """Path of the input; the measured rows themselves if they contain all of it."""
        rows = np.arange(self.history.input_mm.size)
        return InputPath(self.history, rows, rows) if self.path is None else self.path

    @cached_property
    def slope(self) -> Array:
        """Change of the stacked prediction per change of the recorded input, without effects; shape (channels * n,)."""
        reach = SLOPE_STEP * self.history.input_span_mm
        low, high = (self.with_input(self.history.input_mm + way).stacked({}) for way in (-reach, reach))
        return np.asarray((high - low) / (2.0 * reach))

    def with_rest_gap(self, rest_gap_mm: float) -> "MeasuringChain":
        """Return the chain with another gap of the model at input zero."""
        path = self.path
        if path is not None:
            path = replace(path, history=replace(path.history, rest_gap_mm=rest_gap_mm))
        return replace(self, history=replace(self.history, rest_gap_mm=rest_gap_mm), path=path)

    def respond(self, settings: Settings) -> Response:
        """Evaluate the chain along the path, and return the measuring points at the measured rows.

        An effect named in `settings` replaces a fixed effect of the same name.
        """
        acting = {**self.fixed, **settings}
        history = self.along.history
        for effect in self._delays(acting, self._stages[1]):
            return self._before(effect, acting, self.along.rows).respond(_without(effect, acting))
        points = [effect for effect in self._stages[1] if effect.name in acting]
        response = self._answered(acting)
        if self.dynamics is not None and self.dynamics[0] is history.time_s:
            response = response.plus(self.dynamics[1])
        cameras = [effect for effect in points if effect.stage == "camera"]
        for effect in points:
            if effect.stage != "camera":
                response = effect.act(response, history, acting[effect.name])

        def seen(midline_mm: float) -> Response:
            picture = response.shifted(midline_mm) if midline_mm else response
            for effect in cameras:
                picture = effect.act(picture, history, acting[effect.name])
            return picture if self.path is None else picture.at(self.path.rows)

        first = seen(self.midline_mm)
        if not cameras or self.seen_midline_mm is None:
            return first
        return seen(self.midline_mm + self.seen_midline_mm - float(np.median(first.midline_mm)))

    def _answered(self, acting: Settings) -> Response:
        """Response of the model to the input behind the drive effects."""
        drives = tuple((one.name, *acting[one.name].items()) for one in self._stages[0] if one.name in acting)
        if drives not in self._driven:
            if len(self._driven) > 1:
                self._driven.popitem()
            self._driven[drives] = self.model.respond(self._driven_mm(acting))
        return self._driven[drives]

    def driven_mm(self, settings: Settings) -> Array:
        """Input (mm) that the mechanism receives at the measured rows, after the drive effects; shape (n,)."""
        along = self._driven_mm({**self.fixed, **settings})
        return along[self.along.rows]

    def _driven_mm(self, acting: Settings) -> Array:
        history = self.along.history
        input_mm, drives = history.input_mm, self._stages[0]
        if history.commanded:
            # A delay commutes with effects that do not depend on time. Delays are applied last, because the jumps of a
            # delayed command lie between the points of the path.
            drives = tuple(sorted(drives, key=lambda effect: effect.delay_s is not None))
        for effect in self._delays(acting, drives):
            # A delay commutes with drive effects, none of which depends on the time itself.
            return self._before(effect, acting, np.arange(input_mm.size)).driven_mm(_without(effect, acting))
        for effect in drives:
            if effect.name in acting:
                input_mm = effect.act(input_mm, history, acting[effect.name])
        return input_mm

    def _delays(self, acting: Settings, effects: Sequence[Effect]) -> list[Effect]:
        """Delays among some effects that act beside a drive effect with memory (`delayed_path`).

        None for a command, whose path has points between its rows, and for a model that is computed along the path.
        """
        if self._late.isdisjoint(acting) or self.dynamics is not None:
            return []
        if not any(e.memory and not is_delay(e) for e in self._stages[0] if e.name in acting):
            return []
        return [e for e in effects if e.name in acting and is_delay(e) and acting[e.name]["delay_s"] > 0.0]

    def _before(self, delay: Effect, acting: Settings, rows: NDArray[np.intp]) -> "MeasuringChain":
        """Return the chain whose rows are some points of the path, earlier by a delay."""
        path = delayed_path(self.along.history, rows, acting[delay.name]["delay_s"], curved=self.curved)
        return replace(self, fixed={}, path=path)

    def stacked(self, settings: Settings) -> Array:
        """Stack gap and, if measured, midline and force into one column; shape (channels * n,)."""
        response = self.respond(settings)
        parts = [response.gap_mm]
        if self.history.both_edges:
            parts.append(response.midline_mm)
        if self.history.force and response.force_n is not None:
            parts.append(response.force_n)
        return np.concatenate(parts)


def _without(effect: Effect, acting: Settings) -> Settings:
    return {name: values for name, values in acting.items() if name != effect.name}


def own_laws(model: Model) -> Mapping[str, PhysicalLaw]:
    """Formulas for effects that the model itself provides, by the effect's name; a simulation table provides none."""
    return model.laws if isinstance(model, PhysicalModel) else {}


def obeyed(effect: Effect, law: PhysicalLaw | None) -> Effect:
    """Return the effect in the form that a model computes: by the model's own law, else by the catalogue's formula."""
    if law is None or not isinstance(effect, PointEffect):
        return effect

    def narrow(history: History) -> tuple[Parameter, ...] | str:
        searched = effect.parameters if effect.narrow is None else effect.narrow(history)
        return searched if isinstance(searched, str) else (*searched, *law.adds)

    return replace(effect, act=law.act, narrow=narrow, foretold=law.foretold)


def _along_curves(effect: Effect) -> Effect:
    if isinstance(effect, DriveEffect) and effect.act_curved is not None:
        return replace(effect, act=effect.act_curved)
    if isinstance(effect, PointEffect) and effect.act_curved is not None:
        return replace(effect, act=effect.act_curved)
    return effect


def admissible(
    effects: Mapping[str, Effect], history: History, without: frozenset[str]
) -> tuple[dict[str, Effect], dict[str, str]]:
    """Effects that the data can show, and the reasons for excluding all other effects."""
    able: dict[str, Effect] = {}
    excluded: dict[str, str] = {}
    for name, effect in effects.items():
        searched = effect.search(history)
        if name in without:
            excluded[name] = "left out by request"
        elif isinstance(searched, str):
            excluded[name] = searched
        elif not effect.curve:  # a curve is estimated as a whole, in addition to the effects
            able[name] = effect
    return able, excluded
