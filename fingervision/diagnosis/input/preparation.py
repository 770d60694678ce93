"""Prepare a diagnosis: smooth the input, derive its path, and list the effects that the data can show."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.inference.measuring_chain import MeasuringChain, admissible
from fingervision.diagnosis.inference.signatures import start_patterns
from fingervision.diagnosis.inference.uncertain_dimensions import DrawingRefit, tangent
from fingervision.diagnosis.input.column_mistakes import refuse_other_inputs
from fingervision.diagnosis.input.driven_model import at_rest_beside, with_dynamics
from fingervision.diagnosis.input.exchanged_sides import facing
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.input.record_nuisances import TurningErrors
from fingervision.diagnosis.noise.replicates import FEWEST_DEGREES, repeats_in, visits
from fingervision.domain.effect import REZEROED, Array, History
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.model import Model, PhysicalModel
from fingervision.domain.response import Response
from fingervision.models.corrected import CorrectedModel
from fingervision.models.table import TableModel
from fingervision.motion.input_path import NO_TURNS, dwell_s, input_path, log_input_path, mostly_at_rest, unseen_turns
from fingervision.motion.input_path import recorded as recorded_rows
from fingervision.motion.recorded_input import RecordedInput

SET_SHARE = 1e-5
"""Relative difference from the model's rest gap below which a row at input zero counts as set, because no gap is
measured with such accuracy."""
OFF_LINE = 0.01
"""Share of the simulated range: a table that is otherwise straight within half of this share has a fault where it
deviates by more."""

MOST_SET = 0.2
"""Share of rows at input 0 above which these rows are measurements at rest, not a value that was set."""


def screened_rows(table: MeasuredTable, model: Model, rest_gap_mm: float) -> tuple[NDArray[np.bool_], list[str]]:
    """Mark the excluded rows, shape (n,), and give the reasons as sentences.

    Only tables without times are screened, because tables without times are small and made by hand.
    """
    out = np.zeros(table.input_mm.size, dtype=bool)
    notes: list[str] = []
    if table.time_s is not None:
        return out, notes
    put = (table.input_mm == 0.0) & (np.abs(table.gap_mm - rest_gap_mm) <= SET_SHARE * rest_gap_mm)
    if put.any() and put.sum() < MOST_SET * put.size:
        out |= put
        notes.append(
            f"the row at input 0 agrees with the simulated rest gap of {rest_gap_mm:.4g} mm to its last digit: it was "
            "probably set instead of measured, and was set aside in the fit."
        )
    if isinstance(model, TableModel) and model.input_mm.size >= 8:
        gap = model.right_mm - model.left_mm
        # The median slope of all pairs of rows (Theil and Sen), which single faulty rows do not move.
        first, second = np.triu_indices(gap.size, 1)
        slope = np.median((gap[second] - gap[first]) / (model.input_mm[second] - model.input_mm[first]))
        intercept = np.median(gap - slope * model.input_mm)
        off = np.abs(gap - intercept - slope * model.input_mm)
        faulty = off > OFF_LINE * np.ptp(gap)
        faulty[[0, -1]] = False
        if 0 < faulty.sum() <= gap.size // 4 and np.median(off) < 0.5 * OFF_LINE * np.ptp(gap):
            places = model.input_mm[faulty]
            out |= np.isin(table.input_mm, places)
            notes.append(
                f"the simulation deviates from its own straight line at input {', '.join(f'{x:g}' for x in places)} "
                "mm: check these rows of the model; measured rows at these inputs were set aside in the fit."
            )
    return out, notes


def prepare(table: MeasuredTable, model: CorrectedModel, without: frozenset[str] = frozenset()) -> Observations:
    """Combine a measured table with a model.

    Raises
    ------
    DataError
        If the model does not cover the inputs, or the inputs are in another unit.
    """
    model, function = at_rest_beside(table, model)
    refuse_other_inputs(table, model)
    table = facing(table, model.base.respond(table.input_mm))
    recorded = RecordedInput.of(table, model.base, model.input_range_mm)
    history = _history(table, model, recorded)
    if recorded.log is None:
        turns = unseen_turns(table, history, recorded.along_mm, commanded=recorded.commanded)
        path = input_path(table, history, recorded.along_mm, commanded=recorded.commanded, turns=turns)
    else:
        turns, path = NO_TURNS, log_input_path(recorded.log, table, history)
    fixed = {name: {key: e.value for key, e in values.items()} for name, values in model.effects.items()}
    chain = MeasuringChain(model.base, history, fixed, path=path)
    if function is not None:
        chain = with_dynamics(chain, function, {})
    chain, stacked = _seen(table, chain)
    able, excluded = admissible(chain.effects, history, without)
    distrusted, screened = screened_rows(table, model.base, history.rest_gap_mm)
    refit = DrawingRefit(np.zeros((stacked.size, 0)), {})
    if isinstance(model.base, PhysicalModel) and model.base.uncertain:
        refit = tangent(chain, model.base, {})
    return Observations(
        table,
        model,
        chain,
        stacked,
        recorded,
        able,
        excluded,
        distrusted,
        (*table.notes, *_notes_on_input(table, recorded), *screened, *_notes_on_clock(table)),
        refit,
        _visits(table),
        function=function,
        turning=TurningErrors.of(history),
        turns=turns,
    )


def _history(table: MeasuredTable, model: CorrectedModel, recorded: RecordedInput) -> History:
    """Collect the data that effects may use: input, times and runs."""
    rest = model.base.respond(np.zeros(1))
    zero_mm = float(rest.gap_mm[0])
    opening_mm = model.base.respond(table.input_mm).gap_mm - zero_mm
    return History(
        input_mm=recorded.smooth_mm,
        time_s=table.time_s,
        runs=table.runs,
        rest_gap_mm=zero_mm,
        opening_mm=float(np.max(np.abs(opening_mm))),
        closing_mm=float(max(0.0, -np.min(opening_mm))),
        shared_clock=table.shared_clock,
        input_sigma_mm=recorded.sigma_mm,
        input_step_mm=recorded.step_mm,
        both_edges=table.midline_mm is not None,
        force=table.force_n is not None and rest.force_n is not None,
        rezeroed=_rezeroed(table),
        dwell_s=dwell_s(table),
        commanded=recorded.commanded,
    )


def _seen(table: MeasuredTable, chain: MeasuringChain) -> tuple[MeasuringChain, Array]:
    """Set the chain's midline to the measured one, and stack measured gap, midline and force into one column."""
    stacked = [table.gap_mm]
    if table.midline_mm is not None:
        bare: Response = chain.respond({})
        stands_mm = float(np.median(table.midline_mm - bare.midline_mm))
        seen_mm = float(np.median(bare.midline_mm)) + stands_mm
        chain = replace(chain, midline_mm=stands_mm, seen_midline_mm=seen_mm)
        stacked.append(table.midline_mm)
    if chain.history.force and table.force_n is not None:
        stacked.append(table.force_n)
    measured = np.concatenate(stacked)
    return _with_starts(chain, measured), measured


def _visits(table: MeasuredTable) -> NDArray[np.intp] | None:
    """Number the visits of each target, if most readings were taken at rest.

    Runs of a few rows may have no other repeats than their first rows, whose side of approach is not known.
    """
    if not mostly_at_rest(table):
        return None
    along_mm, _, along_runs = recorded_rows(table)
    sided, first = (visits(along_mm, along_runs, table.path_rows, first=first) for first in (False, True))
    return sided if repeats_in(sided, table.runs) >= FEWEST_DEGREES else first


def _notes_on_input(table: MeasuredTable, recorded: RecordedInput) -> tuple[str, ...]:
    notes = []
    if table.midline_mm is None:
        notes.append("only the gap was measured: effects that move both fingers together cannot be detected.")
    if table.time_s is None:
        notes.append(
            "the table has no times: effects that depend on the order of the rows (backlash, friction, creep, delays, "
            "drifts) cannot be detected; add a column time_s."
        )
    if recorded.is_motion:
        notes.append(
            "the fluctuations of the input are also visible in the gap: they are real motion and were not smoothed."
        )
    return tuple(notes)


def _notes_on_clock(table: MeasuredTable) -> tuple[str, ...]:
    if table.clock.u_s <= 0.0:
        return ()
    said = (
        f"the clocks of input and pictures were synchronised by this motion itself (U = {2.0 * table.clock.u_s:.2g} s "
        "over the frames, k = 2): a constant lag is part of this offset, so that a lag is named only if it exceeds "
        "the offset's uncertainty."
    )
    if table.log is not None:
        return (said,)
    return (
        said,
        "the drive's log is not beside this table (drive_log.csv), or is not that of its inputs: a play and its "
        "uncertainty lack what happened between the frames; measure again with --drive.",
    )


def _with_starts(chain: MeasuringChain, stacked_mm: Array) -> MeasuringChain:
    """Fit the start states of the model's own effects in each run, because a table does not state them."""
    catalogued = chain.effects
    for name in [name for name in chain.fixed if catalogued[name].start]:
        tried = [
            replace(chain, fixed={**chain.fixed, name: {**chain.fixed[name], **pattern}})
            for pattern in start_patterns(chain.history)
        ]
        chain = min(tried, key=lambda one: float(np.sum((stacked_mm - one.stacked({})) ** 2)))
    return chain


def _rezeroed(table: MeasuredTable) -> tuple[bool, ...]:
    """Whether each run follows a re-zeroing, recognised by its name.

    Nothing is returned if every run follows a re-zeroing, because then no run shows the earlier zero.
    """
    flags = tuple(REZEROED in name.split() for name in table.run_names)
    return flags if any(flags) and not all(flags) else ()
