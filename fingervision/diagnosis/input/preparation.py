"""A measured table put beside a model: input smoothed, path known, effects told that the data can show."""

from dataclasses import replace

import numpy as np

from fingervision.diagnosis.inference.measuring_chain import MeasuringChain, admissible
from fingervision.diagnosis.inference.signatures import start_patterns
from fingervision.diagnosis.inference.uncertain_dimensions import DrawingRefit, tangent
from fingervision.diagnosis.input.clock_nuisance import clock_columns
from fingervision.diagnosis.input.driven_model import at_rest_beside, with_dynamics
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.input.path import dwell_s, input_path, readings_at_rest
from fingervision.diagnosis.input.path import recorded as recorded_rows
from fingervision.diagnosis.input.recorded_input import AT_REST_SHARE, RecordedInput
from fingervision.diagnosis.input.row_screening import screened_rows
from fingervision.diagnosis.noise.replicates import visits
from fingervision.domain.effect import REZEROED, Array, History
from fingervision.domain.errors import DataError
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.model import PhysicalModel
from fingervision.domain.response import Response
from fingervision.models.corrected import CorrectedModel


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
            raise DataError(
                f"input_mm must be in millimetres within the model's {low:g} to {high:g}, but runs from {u.min():g} to "
                f"{u.max():g}, as if in {unit}: convert the column."
            )
    slack = 1e-9 * (high - low)
    if u.min() < low - slack or u.max() > high + slack:
        raise DataError(
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
    """Which runs came after a re-zeroing, told by their names; empty where all did: none shows the earlier zero."""
    flags = tuple(REZEROED in name.split() for name in table.run_names)
    return flags if any(flags) and not all(flags) else ()
