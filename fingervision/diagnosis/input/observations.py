"""Prepare the measurement: smooth the input, exclude outliers, estimate the noise, whiten."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.inference.hypothesis import SMALL_SHARE, Explanation, Problem
from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.diagnosis.inference.position_map import PositionMap
from fingervision.diagnosis.inference.random_effect import DRAWING, FORM, GAINS, MAP, PATH, RunGains
from fingervision.diagnosis.inference.uncertain_dimensions import BENT, DrawingRefit, estimated, tangent, with_moved
from fingervision.diagnosis.input.driven_model import with_dynamics
from fingervision.diagnosis.input.record_nuisances import FREEDOM, TurningErrors, clock_columns
from fingervision.diagnosis.noise.channel_noises import channel_noises, noises_of_repeats
from fingervision.diagnosis.noise.noise_model import Noise, gate, without_input
from fingervision.diagnosis.noise.replicates import PureError, pure_error, resolution
from fingervision.diagnosis.noise.run_offsets import RunOffsets
from fingervision.diagnosis.noise.whitening import Whitener
from fingervision.domain.effect import Array, Effect, Flags, History
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.model import PhysicalModel
from fingervision.domain.response import Response
from fingervision.effects import catalogue
from fingervision.models.corrected import CorrectedModel
from fingervision.models.function_model import FunctionModel
from fingervision.motion.clock.noise import even_variance
from fingervision.motion.input_path import (
    NO_TURNS,
    UnseenTurns,
    continued,
    input_path,
    log_at,
    log_input_path,
    recorded,
    turning_readings,
    unseen_turns,
)
from fingervision.motion.log_path import drawn_paths
from fingervision.motion.recorded_input import RecordedInput

FEWEST_EQUAL = 6
"""Least number of equal readings at an end that does not occur by chance."""
LONGER = 3.0
"""Ratio to the longest constant stretch elsewhere, in rows and in predicted motion, because the steps of a dead band
are constant too."""
LEAST_DIGITS = 5.0
"""Digits of the reading by which the model must move while the reading is constant."""


def stalled_ends(input_mm: Array, predicted_mm: Array, gap_mm: Array) -> frozenset[str]:
    """Effects that would explain a constant reading at an end of the range.

    Noise changes a reading from row to row; readings that are equal over many rows, while the model moves by many
    digits, have another cause.

    Parameters
    ----------
    input_mm, predicted_mm, gap_mm : ndarray of float, shape (n,)
        Recorded input, predicted and measured gap.
    """
    order = np.argsort(input_mm, kind="stable")
    gap, predicted = gap_mm[order], predicted_mm[order]
    digit = resolution(gap_mm)
    changes = np.flatnonzero(np.abs(np.diff(gap)) > 0.5 * digit) + 1
    borders = np.concatenate([[0], changes, [gap.size]])
    rows = np.diff(borders)
    motion = np.maximum.reduceat(predicted, borders[:-1]) - np.minimum.reduceat(predicted, borders[:-1])
    found: frozenset[str] = frozenset()
    for end, word in ((0, "closed"), (rows.size - 1, "open")):
        others = np.arange(rows.size) != end
        least = max(float(FEWEST_EQUAL), LONGER * float(rows[others].max(initial=0)))
        far = max(LEAST_DIGITS * digit, LONGER * float(motion[others].max(initial=0.0)))
        if rows.size > 1 and rows[end] >= least and motion[end] > far:
            found |= {name for name, effect in catalogue().items() if word in effect.stands_at}
    return found


OF_NOISE = 0.1
"""Error of a dynamic model's remainder, as a share of the noise, above which it is recomputed with the effects
found."""
DOUBTFUL = 2.0
"""Standard uncertainties beyond which a refitted dimension of the drawing is doubtful."""
FORM_SHARE_OF_RIGS = 0.25
"""Share of an explained part that its formula may leave as residual if repeats determine the noise: the reversal of
real stages differs by 19 to 24 % from place to place (ISO 230-2 tables, among them those of `real/rigs`), and readings
at rest repeat well enough to show this."""
SEEN_STAMPS = 0.3
"""Largest effect of the rounding of a frame's time on the gap, relative to the noise, below which it is left to the
noise: it then changes a variance by less than a tenth."""
SHORT = 100
"""Number of samples below which no row is excluded before an effect is found."""
NOTHING: Mapping[str, Mapping[str, float]] = MappingProxyType({})
"""The model without effects."""
SMALL_TURN = 0.02
"""Step of the derivative with respect to a turning point's place (`UnseenTurns.short_by`), as a share of its range: the
play that it shifts is not linear."""
OUTLIER_SIGMAS, RAW_SIGMAS = 4.5, 7.0
"""Outlier limits, in standard deviations, for the residual of the best explanation, and for the residual before any
effect is found."""


@dataclass(frozen=True, slots=True, eq=False)
class Observations:
    """A measured table compared with a model.

    Parameters
    ----------
    table, model
        Table and model as read.
    chain : MeasuringChain
        Measuring chain with the smoothed input.
    stacked_mm : ndarray of float, shape (m,)
        Measured gap, then midline if measured.
    recorded : RecordedInput
        Properties of the recorded input.
    effects : dict
        Effects that the data can show.
    excluded : dict
        Effects that the data cannot show, with the reason.
    distrusted : ndarray of bool, shape (n,)
        Rows without information on the gripper: values that were set instead of measured, or next to a fault in the
        simulation.
    notes : tuple of str
        Remarks that a reader must know.
    refit : DrawingRefit
        Change of the prediction by the drawing's uncertain dimensions.
    clock : ndarray of float, shape (m, p), or None
        Change of the prediction by the uncertain offset between the clocks of input and pictures.
    function : FunctionModel or None
        Dynamic model, of which `model` is the static response.
    turning : TurningErrors or None
        Errors of an encoder's record at the reversals of the stage.
    turns : UnseenTurns
        Corners of the motion between the rows, and where the stage turned.
    """

    table: MeasuredTable
    model: CorrectedModel
    chain: MeasuringChain
    stacked_mm: Array
    recorded: RecordedInput
    effects: dict[str, Effect]
    excluded: dict[str, str]
    distrusted: Flags
    notes: tuple[str, ...]
    refit: DrawingRefit
    repeats: NDArray[np.intp] | None = None
    position_map: PositionMap | None = None
    run_gains: RunGains | None = None
    function: FunctionModel | None = None
    turning: TurningErrors | None = None
    turns: UnseenTurns = NO_TURNS

    @property
    def aim_mm(self) -> Array:
        """Target of the fit: the measurement, corrected for the refit of the drawing's dimensions; shape (m,) (mm)."""
        return np.asarray(self.stacked_mm + self.refit.shift)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the stacked channels."""
        history = self.chain.history
        return ("gap", *(["midline"] if history.both_edges else []), *(["force"] if history.force else []))

    @property
    def floors_mm(self) -> list[float]:
        """Least noise of each channel: the rounding of the last digit, a step over root 12, or the stated one."""
        floor = resolution(self.table.gap_mm) / float(np.sqrt(12.0))
        if self.table.u_random_mm is not None:
            floor = max(floor, float(np.median(self.table.u_random_mm)))
        return [{"gap": floor, "midline": 0.5 * floor, "force": 0.0}[name] for name in self.channels]

    def random_effects_mm(self, values: Mapping[str, Mapping[str, float]]) -> dict[str, Array]:
        """Columns of the random effects beside an explanation, by name, in the order used by a problem."""
        found = {} if self.position_map is None else {MAP: self.position_map.columns_mm}
        found |= {} if self.run_gains is None else {GAINS: self.run_gains.columns_mm}
        found |= {DRAWING: self.refit.columns} if self.refit.moved else {}
        return found | {PATH: self.path_errors_mm(values), FORM: self.form_errors_mm(values)}

    def path_errors_mm(self, values: Mapping[str, Mapping[str, float]]) -> Array:
        """Change of the prediction per standard uncertainty of reversals, turning points and clock; shape (m, k)."""
        parts = [self._clock_columns_mm(values)]
        if self.turning is not None:
            parts.append(self.turning.columns_mm(self.chain, values))
        if self.turns.random:
            parts.append(self.turn_columns_mm(values) * self.turns.sigmas)
        return np.hstack(parts)

    def _clock_columns_mm(self, values: Mapping[str, Mapping[str, float]]) -> Array:
        """Change of the prediction per standard deviation of the clock offset's prior; shape (m, 1), or (m, 0).

        Beside a reversal, the rows alone do not show the slope of the path. A play that is taken up within a frame, in
        a motion at one speed, differs from an offset in these rows only.
        """
        u_s = self.table.clock.u_s
        if self.recorded.log is None or u_s == 0.0:
            return clock_columns(self.chain, u_s, values)
        after, before = (self.later(way * u_s).chain.stacked(values) for way in (1.0, -1.0))
        return np.asarray(0.5 * FREEDOM * (after - before))[:, None]

    def form_errors_mm(self, values: Mapping[str, Mapping[str, float]]) -> Array:
        """Change of the prediction per standard deviation of each error of an inexact formula; shape (m, k)."""
        others = [
            {**values, name: other}
            for name, effect in self.effects.items()
            if effect.inexact is not None and name in values
            for other in effect.inexact(values[name])
        ]
        if not others:
            return np.zeros((self.stacked_mm.size, 0))
        return np.stack([self.chain.stacked(other) for other in others], axis=1) - self.chain.stacked(values)[:, None]

    @property
    def stalled(self) -> frozenset[str]:
        """Effects that are suggested by readings that stay constant at an end of the input's range."""
        history = self.chain.history
        return stalled_ends(history.input_mm, self.chain.respond({}).gap_mm, self.table.gap_mm)

    def problem(
        self, residual_mm: Array, degrees: int, *, explained: bool, values: Mapping[str, Mapping[str, float]] = NOTHING
    ) -> Problem:
        """Estimate outliers and noise from the residual of an explanation, and whiten the measurement with them."""
        for nuisance in (self.position_map, self.run_gains):
            residual_mm = residual_mm if nuisance is None else residual_mm - nuisance.fitted_mm
        parts = np.split(residual_mm, len(self.channels))
        aside = self.outliers(parts, explained=explained, values=values)
        repeated = self.measured_pure_errors(aside)
        parts[0] = self.without_stamps(parts[0])
        noises = (
            channel_noises(self.chain.history, parts, aside, self.floors_mm, degrees, explained=explained)
            if repeated is None
            else noises_of_repeats(repeated, self.floors_mm)
        )
        return self.judged_by(noises, aside, values, known=repeated is not None)

    def outliers(
        self, parts: list[Array], *, explained: bool, values: Mapping[str, Mapping[str, float]] = NOTHING
    ) -> list[Flags]:
        """Mark the rows of each channel's residual that are gross errors, each of shape (n,)."""
        changes = np.split(self.chain.stacked(values) - self.chain.stacked({}), len(parts))
        history = self.chain.history
        timed = history.time_s is not None
        short = timed and history.input_mm.size < SHORT
        sigmas = OUTLIER_SIGMAS if explained else None if short else RAW_SIGMAS
        return [
            gate(part, history.input_mm, history.runs, timed, sigmas, change) | self.distrusted
            for part, change in zip(parts, changes, strict=True)
        ]

    def judged_by(
        self,
        noises: tuple[Noise, ...],
        aside: list[Flags],
        values: Mapping[str, Mapping[str, float]],
        *,
        known: bool = False,
    ) -> Problem:
        """Whiten the measurement with given noises and outliers; `known` if repeats determine the noise."""
        history = self.chain.history
        if history.both_edges:
            aside = [aside[0] | aside[1]] * 2 + aside[2:]
        error = self.recorded.error_mm
        if np.median(error) < 0.1 * noises[0].total_mm / np.sqrt(max(self.recorded.samples, 1.0)) and not np.any(
            error > 0.3 * noises[0].total_mm
        ):
            error = np.zeros_like(error)
        held = np.where(self.recorded.stays, error, 0.0)
        passing = np.where(self.recorded.stays, 0.0, error)
        noises = (without_input(noises[0], passing, self.floors_mm[0]), *noises[1:])
        stamps = self.recorded.stamps_mm
        if stamps is not None and np.any(stamps > SEEN_STAMPS * noises[0].total_mm):
            passing = np.hypot(passing, stamps)
        random = self.random_effects_mm(values)
        whitener = Whitener(
            history,
            noises,
            np.concatenate(aside),
            held,
            self.recorded.samples,
            passing,
            np.hstack(list(random.values())),
        )
        share = FORM_SHARE_OF_RIGS if known else SMALL_SHARE
        offsets = RunOffsets.of(whitener)
        mapped = 0.0
        if self.position_map is not None:
            curve = whitener.one(self.position_map.fitted_mm)
            mapped = float(curve @ curve)
        return Problem(
            self.chain,
            whitener.one(self.aim_mm),
            whitener,
            offsets,
            self.effects,
            share,
            self.stalled,
            mapped,
            tuple((name, columns.shape[1]) for name, columns in random.items()),
            self.other_paths,
        )

    def other_paths(self) -> Iterator[MeasuringChain]:
        """Measuring chains along other paths that the log of the stage permits; none without a log."""
        log, along = self.recorded.log, self.chain.along.history
        if log is None:
            return
        for drawn in drawn_paths(log):
            error_mm = np.empty(along.input_mm.size)
            for run, points in zip(along.runs, drawn.runs(self.table.run_names), strict=True):
                away_mm = drawn.drive.input_mm[points] - log.drive.input_mm[points]
                error_mm[run] = np.interp(along.times[run], log.drive.time_s[points], away_mm)
            yield self.chain.along_errors(error_mm)

    def without_stamps(self, residual_mm: Array) -> Array:
        """Reduce a residual of the gap to the variance that it would have without rounded times; shape (n,).

        The effect of rounded times grows with the speed, and is zero in holds of the stage: it is no part of the noise
        of the picture, and is accounted for separately.
        """
        stamps_mm = self.recorded.stamps_mm
        if stamps_mm is None:
            return residual_mm
        variance = even_variance((residual_mm - np.median(residual_mm)) ** 2, stamps_mm**2)
        return np.asarray(residual_mm / np.sqrt(1.0 + stamps_mm**2 / variance))

    def measured_pure_errors(self, aside: list[Flags]) -> list[PureError] | None:
        """Repeatability of each channel from readings at rest; None if there are too few repeats."""
        history = self.chain.history
        if self.repeats is None or history.time_s is None:
            return None
        parts = np.split(self.stacked_mm - self.chain.stacked({}), len(self.channels))
        clock = history.clock_s if history.shared_clock else np.arange(history.input_mm.size, dtype=np.float64)
        found = [
            pure_error(part, clock, self.repeats, out, history.input_mm, history.runs)
            for part, out in zip(parts, aside, strict=True)
        ]
        kept = [error for error in found if error is not None]
        return kept if len(kept) == len(found) else None

    def with_overshoots(self) -> "Observations":
        """Return the observations with an overshoot wherever two readings at one target indicate a reversal.

        Without two readings at one target, the observations are returned unchanged.
        """
        if not turning_readings(self.table).size:
            return self
        said = (
            f"{turning_readings(self.table).size} readings repeat an outermost target: an overshoot of the stage "
            "beyond this target, as in ISO 230-2, is assumed between them, because it explains the data better."
        )
        return replace(self._along(self.turns, overshoots=True), notes=(*self.notes, said))

    def turned(self, short_by: Array) -> "Observations":
        """Return the observations with other turning points between the rows (`UnseenTurns`); shape (reversals,)."""
        return self._along(self.turns.turned(short_by))

    def later(self, by_s: float) -> "Observations":
        """Return the observations with a stage that moved later by a given time: another offset of the clocks.

        The input of each row is that of the path at the earlier time; beyond the ends of a run, the stage keeps its
        speed. The corners between the rows are found anew.
        """
        record, along = self.recorded, self.chain.along.history
        _, time_s, runs = recorded(self.table)
        if time_s is None or along.time_s is None:
            return self
        log = None if record.log is None else record.log.later(by_s)
        if log is None:
            along_mm = _later(along.input_mm, along, time_s, runs, by_s)
        else:
            along_mm = log_at(log, log.drive.input_mm, self.table)
        history = replace(self.chain.history, input_mm=along_mm[self.table.path_rows])
        if log is None:
            turns = unseen_turns(self.table, history, along_mm, commanded=record.commanded)
            path = input_path(self.table, history, along_mm, commanded=record.commanded, turns=turns)
        else:
            turns, path = NO_TURNS, log_input_path(log, self.table, history)
        chain = replace(self.chain, history=history, path=path)
        if self.chain.dynamics is not None:
            there, answer = chain.along.history, self.chain.dynamics[1]

            def shifted(values: Array) -> Array:
                return _later(values, along, there.times, there.runs, by_s)

            force_n = None if answer.force_n is None else shifted(answer.force_n)
            answer = Response(shifted(answer.left_mm), shifted(answer.right_mm), force_n)
            chain = replace(chain, dynamics=(there.times, answer))
        moved = replace(record, smooth_mm=history.input_mm, along_mm=along_mm, log=log)
        return replace(self, chain=chain, recorded=moved, turns=turns, turning=TurningErrors.of(history))

    def turn_columns_mm(self, values: Mapping[str, Mapping[str, float]]) -> Array:
        """Change of the stacked prediction per unit of each reversal's `short_by`; shape (m, reversals).

        All turning points are moved together: a row depends on the latest one, as long as strokes are longer than what
        an effect remembers.
        """
        count, n = self.turns.uncertain, self.chain.history.input_mm.size
        columns = np.zeros((self.stacked_mm.size, count))
        if not (values or self.chain.fixed) or not count:
            return columns
        short_by, ranges = np.array(self.turns.short_by), self.turns.ranges
        step = SMALL_TURN * (ranges[:, 1] - ranges[:, 0]) * np.where(short_by < ranges.mean(axis=1), 1.0, -1.0)
        change = self.turned(short_by + step).chain.stacked(values) - self.chain.stacked(values)
        after = np.array([corner.after for corner in self.turns.reversals])
        latest = np.searchsorted(after, self.table.path_rows, side="left") - 1
        for begin in range(0, change.size, n):
            known = np.flatnonzero(latest >= 0)
            columns[begin + known, latest[known]] = change[begin + known] / step[latest[known]]
        return columns

    def _along(self, turns: UnseenTurns, *, overshoots: bool = False) -> "Observations":
        record = self.recorded
        path = input_path(
            self.table,
            self.chain.history,
            record.along_mm,
            commanded=record.commanded,
            turns=turns,
            overshoots=overshoots,
        )
        return replace(self, chain=replace(self.chain, path=path), turns=turns)

    def redrawn(self, problem: Problem, explanation: Explanation) -> "Observations":
        """Refit the drawing's uncertain dimensions for an explanation, and use them in all later predictions."""
        drawn = self.model.base
        if not (self.refit.moved and isinstance(drawn, PhysicalModel)):
            return self
        moved, known = estimated(self.refit, problem, explanation)
        model = with_moved(drawn, moved)
        rest_mm = float(model.respond(np.zeros(1)).gap_mm[0])
        chain = replace(self.chain, model=model).with_rest_gap(rest_mm)
        return replace(self, chain=chain, refit=replace(tangent(chain, drawn, moved), known=known))

    def driven_again(self, explanation: Explanation, noise_mm: float) -> "Observations | None":
        """Recompute a dynamic model along the path of the input after an explanation's drive effects.

        The function returns None if the recomputed model does not differ significantly.
        """
        if self.function is None or self.chain.dynamics is None:
            return None
        chain = with_dynamics(self.chain, self.function, explanation.values)
        changed = chain.stacked(explanation.values) - self.chain.stacked(explanation.values)
        return replace(self, chain=chain) if float(np.sqrt(np.mean(changed**2))) > OF_NOISE * noise_mm else None

    def straight(self, drawn: "Observations", problem: Problem) -> bool:
        """Whether a prediction linearised at other dimensions agrees with the present prediction within the noise."""
        bent = self.chain.stacked({}) - drawn.chain.stacked({})
        bent -= drawn.refit.columns @ np.subtract([*self.refit.moved.values()], [*drawn.refit.moved.values()])
        missed = problem.whitener.one(bent)
        return float(missed @ missed) < BENT

    def refitted(self) -> tuple[str, ...]:
        """Sentences on the dimensions of the drawing that were refitted, with their values."""
        drawn = self.model.base
        if not isinstance(drawn, PhysicalModel):
            return ()
        out = []
        for name, by in self.refit.moved.items():
            number = drawn.uncertain[name]
            u = number.u or 0.0
            left = self.refit.known.get(name, 1.0) * u
            far = ": it differs by more than the drawing's uncertainty" if abs(by) > DOUBTFUL else ""
            out.append(
                f"{name} was refitted to {number.value + by * u:.6g} +-{left:.2g}, "
                f"drawn as {number.value:g} +-{u:.2g}{far}."
            )
        return tuple(out)


def _later(values: Array, along: History, time_s: Array, runs: tuple[slice, ...], by_s: float) -> Array:
    """Values along a path, at given times of the same runs but later; beyond the ends of a run their slope continues.

    Parameters
    ----------
    values : ndarray of float, shape (m,)
        Values at the points of the path `along`.
    along : History
        The path.
    time_s : ndarray of float, shape (n,)
        Times at which the moved values are wanted, in `runs`.
    by_s : float
        Time by which the values are later.
    """
    out = np.empty(time_s.size)
    for run, points in zip(runs, along.runs, strict=True):
        out[run] = continued(time_s[run] - by_s, along.times[points], values[points])
    return out
