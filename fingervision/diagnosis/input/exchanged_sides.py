"""Whether the picture shows the model's left side on the right: upside down, or from behind."""

from dataclasses import replace

import numpy as np

from fingervision.domain.effect import Array
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.response import Response

FAULT, FAULT_SHARE = 0.05, 0.01
"""Prior probability that the fingers share the opening otherwise than the model says, and how much then (half width of
a Cauchy distribution, because the size of a fault is hardly known; `assembly_asymmetry`)."""
OF_MODEL = 0.2
"""Relative standard uncertainty of the share that the model states."""
CLEARLY = 20.0
"""Odds from which the sides are exchanged."""


def facing(table: MeasuredTable, bare: Response) -> MeasuredTable:
    """Exchange the measured sides if only then the fingers share the opening as the model says.

    A picture may be turned or mirrored, so that both ways are equally probable beforehand. Each of them leaves a share
    of the opening by which the midline moves besides: a small one, because the model is not exact, or one of a fault.
    If both ways need a fault, they are not told apart, and the sides stay.

    Parameters
    ----------
    table : MeasuredTable
        The table.
    bare : Response
        Response of the model at the rows' inputs.
    """
    if table.midline_mm is None:
        return table
    seen, midline, opening = (each - each.mean() for each in (table.midline_mm, bare.midline_mm, bare.gap_mm))
    moved = float(opening @ opening)
    own = abs(float(midline @ opening)) / max(moved, 1e-300)
    if not own > 0.0:
        return table
    straight, exchanged = (_probability(seen - sign * midline, opening, OF_MODEL * own) for sign in (1.0, -1.0))
    if not exchanged > CLEARLY * straight:
        return table
    note = (
        "the picture shows the model's left side on the right (upside down, or from behind): left and right are meant "
        "as in the model."
    )
    return replace(table, midline_mm=-table.midline_mm, notes=(*table.notes, note))


def _probability(left: Array, opening: Array, of_model: float) -> float:
    """Prior density of the share of the opening by which the midline moves besides what the model says."""
    moved = float(opening @ opening)
    share = float(left @ opening) / moved
    rest = left - share * opening
    variance = float(rest @ rest) / (left.size * moved)
    small, large = (float(np.sqrt(variance + own**2)) for own in (of_model, FAULT_SHARE))
    inexact = float(np.exp(-0.5 * (share / small) ** 2)) / (small * float(np.sqrt(2.0 * np.pi)))
    return (1.0 - FAULT) * inexact + FAULT / (np.pi * large * (1.0 + (share / large) ** 2))
