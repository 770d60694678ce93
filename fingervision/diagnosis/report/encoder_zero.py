"""Sentence on an offset within one step of the encoder, which may be the encoder's own zero."""

import numpy as np

from fingervision.diagnosis.inference.answer import Answer
from fingervision.diagnosis.report.sentences import COVERAGE_FACTOR
from fingervision.domain.effect import Array

OFFSETS = ("input_offset", "rest_gap_error", "edge_bias")
"""Effects that act like a wrong zero of the encoder."""


def encoder_zero(answered: Answer) -> tuple[str, ...]:
    """Sentence on the zero of the encoder, if an offset of less than one step is named, or remains without a name.

    An encoder reads the distance from its own first line, which may lie anywhere within a step. The motion across many
    lines shows by how much the record is off in all; it does not show whether the encoder or the stage is the cause.
    """
    history, best = answered.data.chain.history, answered.found.best
    step_mm = history.input_step_mm
    if step_mm == 0.0 or (answered.data.position_map is not None):
        return ()
    about = f"one step of the encoder ({1e3 * step_mm:.3g} um)"
    named = [name for name in OFFSETS if name in best.names]
    if named:
        changed_mm = answered.data.chain.stacked({name: best.values[name] for name in named})
        size_mm = _of_input(answered, changed_mm - answered.data.chain.stacked({}))[0]
        if abs(size_mm) > step_mm:
            return ()
        return (
            f"{' and '.join(named)}, {1e3 * size_mm:+.2g} um of input, cannot be distinguished from the encoder's own "
            f"zero, because the offset is smaller than {about}: unless the encoder was referenced, add "
            f"{1e3 * step_mm / np.sqrt(12.0):.2g} um of input to its standard uncertainty as a property of the stage.",
        )
    size_mm, u_mm = _of_input(answered, answered.data.stacked_mm - answered.data.chain.stacked(best.values))
    if abs(size_mm) > step_mm:
        return ()
    found = (
        f" (here {1e3 * size_mm:+.2g} um, U = {1e3 * COVERAGE_FACTOR * u_mm:.2g} um, on average over the table)"
        if abs(size_mm) > COVERAGE_FACTOR * u_mm
        else ""
    )
    return (
        f"an offset of the input below {about} cannot be distinguished from the encoder's own zero, and is not "
        f"named{found}.",
    )


def _of_input(answered: Answer, change_mm: Array) -> tuple[float, float]:
    """Offset of the input (mm) that causes a change of the gap, by generalised least squares, and its uncertainty."""
    problem, chain = answered.found.problem, answered.data.chain
    reach = 1e-3 * chain.history.input_span_mm
    low, high = (chain.with_input(chain.history.input_mm + way).stacked({}) for way in (-reach, reach))
    offsets, whitener = problem.offsets, problem.whitener
    # The offsets of the runs are the quantity itself here, and are not fitted.
    metric = offsets.metric((0.0,) * offsets.channels)
    columns = whitener.columns(np.stack([(high - low) / (2.0 * reach), change_mm], axis=1))[0]
    slope, change = columns.T
    bent = slope - offsets.design @ (metric @ (offsets.design.T @ slope))
    normal = float(bent @ slope)
    return float(bent @ change) / normal, normal**-0.5
