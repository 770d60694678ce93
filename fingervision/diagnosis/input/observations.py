"""The measurement made ready to be explained: smoothed input, outliers set aside, noise known, whitened."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.inference.hypothesis_fit import SMALL_SHARE, Explanation, Problem
from fingervision.diagnosis.inference.measuring_chain import MeasuringChain, admissible
from fingervision.diagnosis.inference.position_map import PositionMap
from fingervision.diagnosis.inference.signatures import start_patterns
from fingervision.diagnosis.inference.uncertain_dimensions import BENT, DrawingRefit, estimated, tangent, with_moved
from fingervision.diagnosis.input.clock_nuisance import clock_columns
from fingervision.diagnosis.input.driven_model import at_rest_beside, with_dynamics
from fingervision.diagnosis.input.path import dwell_s, input_path, readings_at_rest, turning_readings
from fingervision.diagnosis.input.path import recorded as recorded_rows
from fingervision.diagnosis.input.recorded_input import AT_REST_SHARE, RecordedInput, standing_still
from fingervision.diagnosis.input.row_screening import screened_rows
from fingervision.diagnosis.input.stalled_ends import stalled_ends
from fingervision.diagnosis.noise.noise_model import Noise, gate, white_noise, without_input
from fingervision.diagnosis.noise.replicates import PureError, pure_error, resolution, visits
from fingervision.diagnosis.noise.restricted_likelihood import noise_of_short_runs
from fingervision.diagnosis.noise.spectrum import noise_by_spectrum
from fingervision.diagnosis.noise.whitening import RunOffsets, Whitener
from fingervision.domain.effect import REZEROED, Array, Effect, Flags, History
from fingervision.domain.errors import FingervisionError
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.model import PhysicalModel
from fingervision.domain.response import Response
from fingervision.models.corrected import CorrectedModel
from fingervision.models.function_model import FunctionModel

OF_NOISE = 0.1
"""Share of the noise that a function of time may be off before it is driven again behind what was found."""
DOUBTFUL = 2.0
"""Standard uncertainties beyond which a number of the drawing is doubtful."""
FEWEST_STANDING = 60
"""Samples in all during which the stage must stand for the noise to be taken from them."""
FORM_SHARE_OF_RIGS = 0.25
"""Share of what an effect explains that its form may leave over where repeats tell the noise: the reversal of real
stages differs by 19 to 24 % from place to place (ISO 230-2 tables, among them those of `real/rigs`), and readings at
rest repeat so well that this shows."""
SHORT = 100
"""Samples below which nothing is set aside before something was explained."""
SHORT_RUN = 60
"""Samples of the longest run below which its spectrum says too little about the noise."""
OUTLIER_SIGMAS, RAW_SIGMAS = 4.5, 7.0
"""Limits on the residual of the best explanation, and on the raw one, where effects still stand out themselves."""


@dataclass(frozen=True, slots=True, eq=False)
class Observations:
    """A measured table beside a model.

    Parameters
    ----------
    table, model
        As they were read.
    chain : MeasuringChain
        The model over the smoothed input.
    stacked_mm : ndarray of float, shape (m,)
        Measured gap, then midline where there is one.
    recorded : RecordedInput
        What is known of the input.
    effects : dict
        Effects that the data can show.
    excluded : dict
        The others, with the reason.
    distrusted : ndarray of bool, shape (n,)
        Rows that say nothing about the gripper: set instead of measured, or beside a fault of the simulation.
    notes : tuple of str
        What a reader must know.
    refit : DrawingRefit
        What the drawing's uncertain numbers do to the prediction.
    clock : ndarray of float, shape (m, p), or None
        What the uncertain offset between the clocks of input and pictures does to it.
    function : FunctionModel or None
        The model that is driven in time, of which `model` is the answer at rest.
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
    runs_scatter_mm: float = np.inf
    clock: Array | None = None
    function: FunctionModel | None = None

    @property
    def aim_mm(self) -> Array:
        """What an explanation's prediction is fitted to: the measurement, seen from the drawn numbers; shape (m,)."""
        return np.asarray(self.stacked_mm + self.refit.shift)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the stacked channels."""
        history = self.chain.history
        return ("gap", *(["midline"] if history.both_edges else []), *(["force"] if history.force else []))

    @property
    def stalled(self) -> frozenset[str]:
        """Effects for which readings that stand at an end of the range speak."""
        history = self.chain.history
        return stalled_ends(history.input_mm, self.chain.respond({}).gap_mm, self.table.gap_mm)

    def problem(self, residual_mm: Array, degrees: int, *, explained: bool) -> Problem:
        """Estimate outliers and noise from a residual and whiten the measurement with them."""
        history = self.chain.history
        if self.position_map is not None:
            residual_mm = residual_mm - self.position_map.fitted_mm
        n, timed = history.input_mm.size, history.time_s is not None
        sigmas = OUTLIER_SIGMAS if explained else None if timed and n < SHORT else RAW_SIGMAS
        # A reading is known to its last digit at best: rounding has the standard deviation of a step over root 12.
        floor = resolution(self.table.gap_mm) / float(np.sqrt(12.0))
        if self.table.u_random_mm is not None:
            floor = max(floor, float(np.median(self.table.u_random_mm)))
        floors = [{"gap": floor, "midline": 0.5 * floor, "force": 0.0}[name] for name in self.channels]
        parts = [residual_mm[channel * n : (channel + 1) * n] for channel in range(len(self.channels))]
        aside = [gate(part, history.input_mm, history.runs, timed, sigmas) | self.distrusted for part in parts]
        noises = self._noises(parts, aside, floors, degrees, explained=explained)
        if history.both_edges:
            aside[0] = aside[1] = aside[0] | aside[1]
        error = self.recorded.error_mm
        if np.median(error) < 0.1 * noises[0].total_mm / np.sqrt(max(self.recorded.samples, 1.0)) and not np.any(
            error > 0.3 * noises[0].total_mm
        ):
            error = np.zeros_like(error)
        passing = np.where(self.recorded.stays, 0.0, error)
        noises = (without_input(noises[0], passing), *noises[1:])
        beside = [] if self.position_map is None else [self.position_map.columns_mm]
        beside += [self.clock] if self.clock is not None and self.clock.shape[1] else []
        beside += [self.refit.columns] if self.refit.moved else []
        drawing = np.hstack(beside) if beside else None
        whitener = Whitener(
            history,
            noises,
            np.concatenate(aside),
            error - passing,
            self.recorded.samples,
            passing,
            drawing,
            self.runs_scatter_mm,
        )
        share = SMALL_SHARE if self.measured_pure_errors(aside) is None else FORM_SHARE_OF_RIGS
        offsets = RunOffsets.of(whitener)
        return Problem(self.chain, whitener.one(self.aim_mm), whitener, offsets, self.effects, share, self.stalled)

    def _noises(
        self, parts: list[Array], aside: list[Flags], floors: list[float], degrees: int, *, explained: bool
    ) -> tuple[Noise, ...]:
        """Estimate every channel's noise; what was fitted leaves gap and midline the noise of the same pictures."""
        history = self.chain.history
        if history.time_s is None:
            return tuple(
                white_noise(part, out, floor, degrees) for part, out, floor in zip(parts, aside, floors, strict=True)
            )
        if self.repeats is not None:
            repeated = self._noises_of_repeats(aside, floors)
            if repeated is not None:
                return repeated
        rate_hz = 1.0 / history.sample_time_s
        together = 2 if history.both_edges and explained else 1
        groups = [slice(0, together), *(slice(k, k + 1) for k in range(together, len(parts)))]
        if max(run.stop - run.start for run in history.runs) < SHORT_RUN:
            return noise_of_short_runs(parts, history.runs, aside, floors, explained=explained)

        def over(stretches: tuple[slice, ...]) -> tuple[Noise, ...]:
            return tuple(
                noise
                for g in groups
                for noise in noise_by_spectrum(parts[g], stretches, rate_hz, aside[g], floors[g], explained=explained)
            )

        everywhere = over(history.runs)
        standing = () if explained else standing_still(history)
        if sum(hold.stop - hold.start for hold in standing) < FEWEST_STANDING:
            return everywhere
        # What nothing explains yet moves with the stage and passes for noise; where the stage stands, less of it does.
        holds = over(standing)
        return holds if holds[0].total_mm < everywhere[0].total_mm else everywhere

    def measured_pure_errors(self, aside: list[Flags]) -> list[PureError] | None:
        """Scatter of repeats of each channel, of readings at rest; None where too little repeats."""
        history = self.chain.history
        if self.repeats is None or history.time_s is None:
            return None
        parts = np.split(self.stacked_mm - self.chain.stacked({}), len(self.channels))
        clock = history.clock_s if history.shared_clock else np.arange(history.input_mm.size, dtype=np.float64)
        found = [pure_error(part, clock, self.repeats, out) for part, out in zip(parts, aside, strict=True)]
        kept = [error for error in found if error is not None]
        return kept if len(kept) == len(found) else None

    def _noises_of_repeats(self, aside: list[Flags], floors: list[float]) -> tuple[Noise, ...] | None:
        """Take the scatter of repeats for the noise: readings seconds apart are no samples of one fast process."""
        errors = self.measured_pure_errors(aside)
        if errors is None:
            return None
        # The doubt of a standard deviation's square is sqrt(2 / degrees).
        return tuple(
            Noise(max(error.sd_mm, floor, 1e-9), 0.0, 0.0, float(np.sqrt(2.0 / error.degrees)))
            for error, floor in zip(errors, floors, strict=True)
        )

    def with_overshoots(self) -> "Observations":
        """Let the stage run over where it turned between two readings of the same target; itself where it did not."""
        if not turning_readings(self.table).size:
            return self
        along_mm, commanded = self.recorded.along_mm, self.recorded.commanded
        path = input_path(self.table, self.chain.history, along_mm, commanded=commanded, overshoots=True)
        said = (
            f"{turning_readings(self.table).size} readings repeat an outermost target: the stage was taken to have run "
            "over beyond it in between, as in ISO 230-2, which explains the data better."
        )
        return replace(self, chain=replace(self.chain, path=path), notes=(*self.notes, said))

    def redrawn(self, problem: Problem, explanation: Explanation) -> "Observations":
        """Refit the drawing's uncertain numbers beside an explanation, and predict with them from now on."""
        drawn = self.model.base
        if not (self.refit.moved and isinstance(drawn, PhysicalModel)):
            return self
        moved, known = estimated(self.refit, problem, explanation)
        model = with_moved(drawn, moved)
        rest_mm = float(model.respond(np.zeros(1)).gap_mm[0])
        chain = replace(self.chain, model=model).with_rest_gap(rest_mm)
        return replace(self, chain=chain, refit=replace(tangent(chain, drawn, moved), known=known))

    def driven_again(self, explanation: Explanation, noise_mm: float) -> "Observations | None":
        """Drive a function of time along the path behind an explanation; None where that changes nothing of weight."""
        if self.function is None or self.chain.dynamics is None:
            return None
        chain = with_dynamics(self.chain, self.function, explanation.values)
        changed = chain.stacked(explanation.values) - self.chain.stacked(explanation.values)
        return replace(self, chain=chain) if float(np.sqrt(np.mean(changed**2))) > OF_NOISE * noise_mm else None

    def straight(self, drawn: "Observations", problem: Problem) -> bool:
        """Whether the tangent at other numbers of the drawing foretold this prediction, to within the noise."""
        bent = self.chain.stacked({}) - drawn.chain.stacked({})
        bent -= drawn.refit.columns @ (
            np.array(list(self.refit.moved.values())) - np.array(list(drawn.refit.moved.values()))
        )
        missed = problem.whitener.one(bent)
        return float(missed @ missed) < BENT

    def refitted(self) -> tuple[str, ...]:
        """Say which numbers of the drawing were refitted, and to what; a sentence each."""
        drawn = self.model.base
        if not isinstance(drawn, PhysicalModel):
            return ()
        out = []
        for name, by in self.refit.moved.items():
            number = drawn.uncertain[name]
            u = number.u or 0.0
            left = self.refit.known.get(name, 1.0) * u
            far = ": it lies farther off than the drawing states" if abs(by) > DOUBTFUL else ""
            out.append(
                f"{name} was refitted to {number.value + by * u:.6g} +-{left:.2g}, "
                f"drawn as {number.value:g} +-{u:.2g}{far}."
            )
        return tuple(out)


def prepare(table: MeasuredTable, model: CorrectedModel, without: frozenset[str] = frozenset()) -> Observations:
    """Put a measured table beside a model.

    Raises
    ------
    FingervisionError
        The model does not cover the inputs, or the inputs are in another unit.
    """
    model, function = at_rest_beside(table, model)
    low, high = model.input_range_mm
    u = table.input_mm
    ratio = float(np.ptp(u)) / (high - low)
    for factor, unit in ((1e3, "micrometres"), (1e-3, "metres")):
        if 0.1 < ratio / factor < 3.0:
            raise FingervisionError(
                f"input_mm must be in millimetres within the model's {low:g} to {high:g}, but runs from {u.min():g} to "
                f"{u.max():g}, as if in {unit}: convert the column."
            )
    slack = 1e-9 * (high - low)
    if u.min() < low - slack or u.max() > high + slack:
        raise FingervisionError(
            f"input_mm must lie within the model's {low:g} to {high:g} mm, but runs from {u.min():g} to {u.max():g}: "
            "simulate the missing inputs, or leave those rows out."
        )
    notes = list(table.notes)
    recorded = RecordedInput.of(table, model)
    if table.midline_mm is None:
        notes.append("only the gap was measured: what moves both fingers together cannot show.")
    if recorded.is_motion:
        notes.append("the input's unrest shows in the gap as well: it is real motion and was not smoothed.")
    zero = model.base.respond(np.zeros(1)).gap_mm[0]
    opening = model.base.respond(u).gap_mm - zero
    bare_force = model.base.respond(np.zeros(1)).force_n
    history = History(
        input_mm=recorded.smooth_mm,
        time_s=table.time_s,
        runs=table.runs,
        rest_gap_mm=float(zero),
        opening_mm=float(np.max(np.abs(opening))),
        closing_mm=float(max(0.0, -np.min(opening))),
        shared_clock=table.shared_clock,
        input_sigma_mm=recorded.sigma_mm,
        input_step_mm=recorded.step_mm,
        both_edges=table.midline_mm is not None,
        force=table.force_n is not None and bare_force is not None,
        rezeroed=_rezeroed(table),
        dwell_s=dwell_s(table),
        commanded=recorded.commanded,
    )
    path = input_path(table, history, recorded.along_mm, commanded=recorded.commanded)
    fixed = {name: {key: e.value for key, e in values.items()} for name, values in model.effects.items()}
    chain = MeasuringChain(model.base, history, fixed, path=path)
    if function is not None:
        chain = with_dynamics(chain, function, {})
    stacked = table.gap_mm
    if table.midline_mm is not None:
        bare: Response = chain.respond({})
        stands_mm = float(np.median(table.midline_mm - bare.midline_mm))
        seen_mm = float(np.median(bare.midline_mm)) + stands_mm
        chain = replace(chain, midline_mm=stands_mm, seen_midline_mm=seen_mm)
        stacked = np.concatenate([table.gap_mm, table.midline_mm])
    if history.force and table.force_n is not None:
        stacked = np.concatenate([stacked, table.force_n])
    chain = _with_starts(chain, stacked)
    able, excluded = admissible(chain.effects, history, without)
    distrusted, reasons = screened_rows(table, model.base, float(zero))
    notes += reasons
    refit = DrawingRefit(np.zeros((stacked.size, 0)), {})
    if isinstance(model.base, PhysicalModel) and model.base.uncertain:
        refit = tangent(chain, model.base, {})
    repeats = None
    if np.mean(readings_at_rest(table)) > AT_REST_SHARE:
        rows = np.arange(u.size) if table.path is None else table.path.rows
        along_mm, _, along_runs = recorded_rows(table)
        repeats = visits(along_mm, along_runs, rows)
    if table.u_clock_s > 0.0:
        notes.append(
            "the clocks of input and pictures were laid on each other by this motion itself "
            f"(U = {2.0 * table.u_clock_s:.2g} s, k = 2): a lag that is the same at all times is part of that offset, "
            "and one is named only beyond its uncertainty."
        )
    return Observations(
        table,
        model,
        chain,
        stacked,
        recorded,
        able,
        excluded,
        distrusted,
        tuple(notes),
        refit,
        repeats,
        clock=clock_columns(chain, table.u_clock_s),
        function=function,
    )


def _with_starts(chain: MeasuringChain, stacked_mm: Array) -> MeasuringChain:
    """Let the effects that the model has begin each run where that suits the measurement best: nobody stated it."""
    catalogued = chain.effects
    for name in [name for name in chain.fixed if catalogued[name].start]:
        tried = [
            replace(chain, fixed={**chain.fixed, name: {**chain.fixed[name], **pattern}})
            for pattern in start_patterns(chain.history)
        ]
        chain = min(tried, key=lambda one: float(np.sum((stacked_mm - one.stacked({})) ** 2)))
    return chain


def _rezeroed(table: MeasuredTable) -> tuple[bool, ...]:
    """Which runs came after a re-zeroing, by their names; empty where all did: no run shows the zero before."""
    flags = tuple(REZEROED in name.split() for name in table.run_names)
    return flags if any(flags) and not all(flags) else ()
