"""Prepare a diagnosis: smooth the input, derive its path, and list the effects that the data can show."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.inference.evidence import STRONG
from fingervision.diagnosis.inference.measuring_chain import MeasuringChain, admissible
from fingervision.diagnosis.inference.signatures import start_patterns
from fingervision.diagnosis.inference.uncertain_dimensions import DrawingRefit, tangent
from fingervision.diagnosis.input.driven_model import at_rest_beside, with_dynamics
from fingervision.diagnosis.input.exchanged_sides import facing
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.input.record_nuisances import TurningErrors
from fingervision.diagnosis.noise.replicates import FEWEST_DEGREES, repeats_in, visits
from fingervision.domain.effect import REZEROED, Array, Flags, History
from fingervision.domain.errors import DataError
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


UNIT_SHARES = (0.1, 3.0)
"""Smallest and largest share of the model's range that the inputs cover, after a change of unit, if the input was
apparently given in that unit. Runs cover at least a tenth of the range."""
UNITS = {
    "has the opposite sign": -1.0,
    "is in micrometres": 1e3,
    "is in metres": 1e-3,
    "is in tenths of a millimetre": 10.0,
    "is in centimetres": 0.1,
    "is in inches": 1.0 / 25.4,
}
"""Factors between a column and one in millimetres, with the words for such a column."""
THOUSANDS = (1e3, 1e-3)
"""Factors that leave no doubt: no run is a thousand times as long as the model's range, or a thousandth of it."""
MODEL_POINTS = 200
"""Number of inputs at which the range of the model's gap is computed."""


def prepare(table: MeasuredTable, model: CorrectedModel, without: frozenset[str] = frozenset()) -> Observations:
    """Combine a measured table with a model.

    Raises
    ------
    DataError
        If the model does not cover the inputs, or the inputs are in another unit.
    """
    model, function = at_rest_beside(table, model)
    _refuse_other_inputs(table, model)
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


def _refuse_other_inputs(table: MeasuredTable, model: CorrectedModel) -> None:
    """Refuse a table whose inputs are in another unit than the model's, or outside the model's range."""
    input_mm, (low, high) = table.input_mm, model.input_range_mm
    share, runs = float(np.ptp(input_mm)) / (high - low), f"{input_mm.min():g} to {input_mm.max():g}"
    outside = ~_within(input_mm, low, high)
    # A run that is mostly within the range is a right one of which the model covers too little.
    far = float(np.mean(outside)) > 0.5
    mistakes = [
        words
        for words, factor in UNITS.items()
        if UNIT_SHARES[0] < share / abs(factor) < UNIT_SHARES[1]
        and (factor in THOUSANDS or (far and _within(input_mm / factor, low, high).all()))
    ]
    if outside.any() and _fit_exchanged(table, model, ~outside):
        mistakes = ["was exchanged with gap_mm"]
    if mistakes or outside.any():
        is_drawn = hasattr(type(model.base), "places")
        ends = ", where a flexure yields or parts touch" if is_drawn else ""
        advice = ["leave those rows out", *(f"correct the column if it {words}" for words in mistakes)]
        advice = advice if is_drawn else ["simulate the missing inputs", *advice]
        raise DataError(
            f"input_mm must lie within the model's {low:g} to {high:g} mm{ends}, but runs from {runs}: "
            f"{', or '.join(advice)}."
        )


def _fit_exchanged(table: MeasuredTable, model: CorrectedModel, inside: Flags) -> bool:
    """Whether the model covers the table with input and gap exchanged, and then fits far better than as it is.

    Parameters
    ----------
    inside : ndarray of bool, shape (n,)
        Rows whose input lies in the model's range; if they are the minority, there is nothing to compare with.
    """
    low, high = model.input_range_mm
    there = model.base.respond(np.linspace(low, high, MODEL_POINTS)).gap_mm
    if not (_within(table.input_mm, there.min(), there.max()).all() and _within(table.gap_mm, low, high).all()):
        return False
    if np.mean(inside) < 0.5:
        return True
    here = _left_share(model, table.input_mm[inside], table.gap_mm[inside])
    exchanged = _left_share(model, table.gap_mm[inside], table.input_mm[inside])
    # -2 log odds of 20 to 1, with a noise of unknown level in both.
    return exchanged < 0.5 and float(inside.sum()) * float(np.log(here / max(exchanged, 1e-12))) > STRONG


def _left_share(model: CorrectedModel, input_mm: Array, gap_mm: Array) -> float:
    """Share of the variance of a gap that the model leaves, without its constant."""
    left_mm = gap_mm - model.base.respond(input_mm).gap_mm
    return float(np.var(left_mm)) / max(float(np.var(gap_mm)), 1e-300)


def _within(values: Array, low: float, high: float) -> Flags:
    """Whether each value lies in a range, or at its ends but for rounding; shape (n,)."""
    slack = 1e-9 * (high - low)
    return np.asarray((values >= low - slack) & (values <= high + slack))


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
