"""Distinguish step commands from encoder readings: both stay constant and jump while the stage moves slowly."""

from itertools import pairwise

import numpy as np

from fingervision.domain.effect import Array

HELD_SHARE = 0.5
"""Share of samples equal to the one before, above which an input may be a command; a recorded motion changes in most
samples."""
ISOLATED_SHARE = 0.9
"""Share of jumps that are isolated between equal values; in ramps and strokes, changes follow each other directly."""
FEWEST_LINES = 8.0
"""Least number of encoder lines over the range; an encoder with fewer would be useless."""
LEAST_HOLD = 4
"""Least number of samples in a hold for which the second half shows whether the gap moves or is constant."""
DWELL = 3.0
"""Ratio of a hold to the median hold between moves in the same direction, above which the stage itself waits; the gap
is then constant even if the input is an encoder's record."""
FOLLOWS = 0.5
"""Slope of the gap within holds, relative to that of a steady motion: 1 for an encoder, 0 for a command; this is the
limit between them."""


def is_commanded(input_mm: Array, runs: tuple[slice, ...], gap_of_input: Array, gap_mm: Array) -> bool:
    """Whether the input is a command, which stays constant until it jumps.

    The record of a coarse encoder also stays constant and jumps while the stage moves slowly. While an encoder's record
    is constant, the gap moves; while a command is constant, the gap is constant too.

    Parameters
    ----------
    input_mm : ndarray of float, shape (n,)
        Recorded input.
    runs : tuple of slice
        Samples of each run.
    gap_of_input, gap_mm : ndarray of float, shape (n,)
        Gap that the model predicts for the record, and measured gap.
    """
    moves = np.concatenate([np.diff(input_mm[run]) for run in runs])
    inner = [np.diff(input_mm[run]) != 0.0 for run in runs]
    jumps = int(sum(np.sum(jump) for jump in inner))
    if jumps == 0 or np.mean(moves == 0.0) < HELD_SHARE:
        return False
    beside = sum(int(np.sum(jump[1:] & jump[:-1])) for jump in inner)
    if 2 * beside > (1.0 - ISOLATED_SHARE) * jumps:
        return False
    if float(np.ptp(input_mm)) < FEWEST_LINES * float(np.min(np.abs(moves[moves != 0.0]))):
        return True
    along, power = 0.0, 0.0
    holds = []
    for run, jump in zip(runs, inner, strict=True):
        at = run.start + 1 + np.flatnonzero(jump)
        for before, after in pairwise(at):
            if (input_mm[before] - input_mm[before - 1]) * (input_mm[after] - input_mm[before]) > 0.0:
                holds.append((before, after))
    longest = DWELL * float(np.median([after - before for before, after in holds])) if holds else 0.0
    for before, after in holds:
        if LEAST_HOLD <= after - before <= longest:
            second = np.arange(before + (after - before) // 2, after)
            way = 0.5 * (gap_of_input[after] - gap_of_input[before - 1])
            drift = way * (second - second.mean()) / (after - before)
            along += float(drift @ (gap_mm[second] - gap_mm[second].mean()))
            power += float(drift @ drift)
    return power > 0.0 and along < FOLLOWS * power
