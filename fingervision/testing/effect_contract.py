"""Contract tests of effects: no change at neutral values, rest at the start of a run, symmetry, finite results."""

from dataclasses import replace

import numpy as np

from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.domain.effect import DriveEffect, Effect, History, PointEffect
from fingervision.domain.response import Response
from fingervision.effects.trial import ROUNDING_MM, guarded, neutral_values, try_effect
from fingervision.models.table import TableModel
from fingervision.plugins.faults import MisfitError
from fingervision.testing.contract import NotApplicable, hold

SHOWS = 1e-3
"""Smallest change (mm or N) by which an effect counts as visible at usual parameter values; it is smaller than a good
camera can detect."""
MIDLINE_MM = 0.3
GAIN, REST_GAP_MM = 7.7, 4.0
INPUT_MM = np.array([-0.6, 1.6])
GAP_MM = REST_GAP_MM + GAIN * INPUT_MM
MODEL = TableModel("straight", INPUT_MM, -0.5 * GAP_MM, 0.5 * GAP_MM, 2.0 * INPUT_MM)


def bench() -> History:
    """Sample history of two runs, each with an opening, a rest and a return; the second run is half as fast."""
    up = np.linspace(-0.4, 1.4, 120)
    run = np.concatenate([up, np.full(40, 1.4), up[::-1]])
    return History(
        input_mm=np.concatenate([run, run[::-1]]),
        # The runs have different speeds, so that a speed limit affects only one of them.
        time_s=np.concatenate([0.04 * np.arange(run.size), 0.04 * run.size + 0.08 * np.arange(run.size)]),
        runs=(slice(0, run.size), slice(run.size, 2 * run.size)),
        rest_gap_mm=REST_GAP_MM,
        opening_mm=GAIN * 1.4,
        closing_mm=GAIN * 0.4,
        force=True,
        bodies=True,
    )


def usual_values(effect: Effect, history: History) -> dict[str, float]:
    """Parameter values at which the effect must be visible, well inside the bounds."""
    out = {}
    for p in _searched(effect, history):
        if p.run is not None:
            out[p.name] = 0.0
        elif p.neutral is None:
            out[p.name] = float(p.starting_values()[0])
        elif p.neutral == p.upper:
            out[p.name] = 0.5 * (p.lower + p.upper)
        else:
            out[p.name] = 0.7 * p.neutral + 0.3 * p.upper
    return out


class EffectContract:
    """Contract tests of one effect, stated as the class attribute `effect`."""

    effect: Effect

    def test_it_states_what_it_is(self) -> None:
        """Name, section of the chain, words, formula, source, residual and parameters are declared; a trial works."""
        try:
            try_effect(self.effect)
        except MisfitError as error:
            hold(False, f"The effect {getattr(self.effect, 'name', self.effect)} {error}.")

    def test_neutral_parameters_change_nothing(self) -> None:
        """At neutral values, or with all values 0, the positions of both fingers are those of the model."""
        bare = self._chain().respond({})
        moved_mm = []
        neutral = neutral_values(_searched(self.effect, bench()))
        for values in (neutral, dict.fromkeys(neutral, 0.0)):
            moved_mm.append(_moved_mm(self._chain().respond({self.effect.name: values}), bare))
            if moved_mm[-1] <= ROUNDING_MM:
                return
        hold(
            False,
            f"The effect {self.effect.name} must change nothing at {_told(neutral)} or with all of them 0, but moves "
            f"an edge by {moved_mm[0]:.3g} and {moved_mm[1]:.3g} mm.",
        )

    def test_it_shows(self) -> None:
        """At values well inside the bounds, the effect changes gap, midline or force."""
        values = usual_values(self.effect, bench())
        bare, moved = self._chain().respond({}), self._chain().respond({self.effect.name: values})
        changed = max(
            float(np.max(np.abs(moved.gap_mm - bare.gap_mm))),
            float(np.max(np.abs(moved.midline_mm - bare.midline_mm))),
            float(np.max(np.abs(np.asarray(moved.force_n) - np.asarray(bare.force_n)))),
        )
        hold(
            changed > SHOWS,
            f"The effect {self.effect.name} must change gap, midline or force at {_told(values)}, but changes them by "
            f"{changed:.3g} mm or N at most.",
        )

    def test_it_answers_at_its_bounds(self) -> None:
        """With each parameter at either bound and the other parameters at usual values, the response is finite."""
        usual = usual_values(self.effect, bench())
        for p in _searched(self.effect, bench()):
            for bound in (p.lower, p.upper):
                values = {**usual, p.name: bound}
                response = self._chain().respond({self.effect.name: values})
                hold(
                    bool(np.all(np.isfinite(response.left_mm)) and np.all(np.isfinite(response.right_mm))),
                    f"The effect {self.effect.name} must return finite numbers at {_told(values)}, but does not.",
                )

    def test_the_same_values_give_the_same_answer(self) -> None:
        """The response is not random, and does not depend on earlier calls."""
        values = usual_values(self.effect, bench())
        first, again = (self._chain().respond({self.effect.name: values}) for _ in range(2))
        moved_mm = _moved_mm(first, again)
        hold(
            moved_mm == 0.0,
            f"The effect {self.effect.name} must return the same result for the same values, but the results differ by "
            f"{moved_mm:.3g} mm.",
        )

    def test_memory_starts_each_run_at_rest(self) -> None:
        """At the first sample of a run, an effect with memory does not depend on earlier runs."""
        if not self.effect.memory:
            raise NotApplicable(f"{self.effect.name} does not depend on earlier inputs")
        bare = self._chain().respond({})
        moved = self._chain().respond({self.effect.name: usual_values(self.effect, bench())})
        for number, run in enumerate(bench().runs, start=1):
            off_mm = abs(float(moved.gap_mm[run][0] - bare.gap_mm[run][0]))
            hold(
                off_mm <= ROUNDING_MM,
                f"The effect {self.effect.name} must not depend on earlier runs at the start of a run, but run "
                f"{number} starts with a deviation of {off_mm:.3g} mm.",
            )

    def test_a_mirrored_picture_mirrors_the_answer(self) -> None:
        """In a mirrored picture, left and right exchange and change sign; parameters declared as odd change sign."""
        values = usual_values(self.effect, bench())
        seen = self._chain().respond({self.effect.name: values})
        values |= {name: -values[name] for name in self.effect.odd}
        mirrored = self._chain(-MIDLINE_MM).respond({self.effect.name: values})
        moved_mm = max(
            float(np.max(np.abs(mirrored.left_mm + seen.right_mm))),
            float(np.max(np.abs(mirrored.right_mm + seen.left_mm))),
        )
        hold(
            moved_mm <= ROUNDING_MM,
            f"The effect {self.effect.name} must have a mirrored result in a mirrored picture, but differs by "
            f"{moved_mm:.3g} mm: state in `odd` the parameters that change their sign.",
        )

    def test_without_the_data_that_it_needs_it_is_excluded(self) -> None:
        """A table without times, edges, force or a shared clock excludes an effect that needs them, with the reason."""
        needs = (
            (self.effect.needs_times, replace(bench(), time_s=None), "times"),
            (self.effect.needs_shared_clock, replace(bench(), shared_clock=False), "a shared clock"),
            (self.effect.needs_edges, replace(bench(), both_edges=False), "left and right"),
            (self.effect.needs_force, replace(bench(), force=False), "a force"),
        )
        for needed, without, words in needs:
            searched = self.effect.search(without) if needed else "not asked"
            hold(
                isinstance(searched, str) and len(searched) > 0,
                f"The effect {self.effect.name} must be excluded, with a reason, from data without {words}, but is "
                "searched for.",
            )

    def test_without_times_it_works_unless_it_says_that_it_needs_them(self) -> None:
        """An effect that reads times declares `needs_times`."""
        if self.effect.needs_times or self.effect.needs_shared_clock:
            raise NotApplicable(f"{self.effect.name} states that it needs times")
        chain = MeasuringChain(MODEL, replace(bench(), time_s=None), {}, MIDLINE_MM)
        if isinstance(self.effect.search(chain.history), str):
            raise NotApplicable(f"{self.effect.name} is excluded without times")
        try:
            self._respond(chain)
        except ValueError as error:
            hold(False, f"The effect {self.effect.name} must state needs_times, as it reads times ({error}).")

    def test_along_curves_a_sine_is_late_as_a_whole(self) -> None:
        """For a sine, a delay with curved interpolation is more accurate than a delay with linear interpolation."""
        if not (isinstance(self.effect, DriveEffect | PointEffect) and self.effect.act_curved is not None):
            raise NotApplicable(f"{self.effect.name} has the same result for curved and straight models")
        time_s = np.arange(0.0, 20.0, 0.2)
        wave = History(np.sin(time_s), time_s, (slice(0, time_s.size),), rest_gap_mm=REST_GAP_MM, opening_mm=GAIN)
        late_mm = REST_GAP_MM + GAIN * np.sin(time_s - 0.07)
        errors_mm = []
        for curved in (False, True):
            chain = MeasuringChain(MODEL, wave, {}, curved=curved)
            seen = self._respond(chain, {"delay_s": 0.07})
            errors_mm.append(float(np.max(np.abs(seen.gap_mm - late_mm)[5:-5])))
        # The error of lines is the step squared over eight; the error of curves is of third order in the step.
        hold(
            errors_mm[0] > 0.01 and errors_mm[1] < 0.2 * errors_mm[0],
            f"The effect {self.effect.name} must delay a sine better along curves than along lines, but misses it by "
            f"{errors_mm[1]:.3g} and {errors_mm[0]:.3g} mm.",
        )

    def _chain(self, midline_mm: float = MIDLINE_MM) -> "_ChainOf":
        return _ChainOf(self.effect, MeasuringChain(MODEL, bench(), {}, midline_mm))

    def _respond(self, chain: MeasuringChain, values: dict[str, float] | None = None) -> Response:
        given = usual_values(self.effect, chain.history) if values is None else values
        return _ChainOf(self.effect, chain).respond({self.effect.name: given})


class _ChainOf:
    """A measuring chain in which one given effect acts, whether it is in the catalogue or not."""

    def __init__(self, effect: Effect, chain: MeasuringChain) -> None:
        assert isinstance(effect, DriveEffect | PointEffect)  # noqa: S101 - as its contract says
        if chain.curved and effect.act_curved is not None:
            effect = replace(effect, act=effect.act_curved)  # type: ignore[arg-type]  # the law of the same stage
        effect = guarded(effect)
        self._chain = replace(chain)
        # Set the value of a cached property of a frozen record, for this chain only.
        self._chain.__dict__["effects"] = {effect.name: effect}

    def respond(self, settings: dict[str, dict[str, float]]) -> Response:
        """Compute the response of the measuring chain with this one effect."""
        return self._chain.respond(settings)


def _searched(effect: Effect, history: History) -> tuple:  # type: ignore[type-arg]  # of Parameter
    searched = effect.search(history)
    if isinstance(searched, str):
        raise NotApplicable(f"{effect.name} cannot be tested on the input of these tests: {searched}")
    return searched


def _moved_mm(one: Response, other: Response) -> float:
    return max(float(np.max(np.abs(one.left_mm - other.left_mm))), float(np.max(np.abs(one.right_mm - other.right_mm))))


def _told(values: dict[str, float]) -> str:
    return ", ".join(f"{key} = {value:.6g}" for key, value in values.items())
