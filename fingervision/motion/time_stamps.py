"""Resolution of time stamps, recognised from the times themselves.

A stamp that is rounded to the resolution q is a time with the standard uncertainty q / sqrt(12) (uniform distribution,
JCGM 100:2008, 4.3.7). While the stage moves, this makes the input uncertain that is read from a log at the stamp.
"""

import numpy as np

from fingervision.domain.effect import Array

LEAST_S = 1e-4
"""Resolution (s) below which rounded times do not matter: a tenth of the clock offset's least standard uncertainty."""
MOST_KINDS = 12
"""Most different times between rows of a log with a regular cycle; more indicate times that are not rounded."""
SAME = 0.02
"""Deviation from a multiple of the resolution, as a share of it, that the digits of the file explain."""
MISSING_ROWS = 0.7
"""Share of the shortest time between rows, if it is the resolution itself, above which the longer ones come from
missing rows, not from rounding."""
DECIMALS_S = (1e-1, 1e-2, 1e-3)
"""Resolutions (s) of the times of frames: milliseconds in Matroska, WebM and FLV, coarser in lists of times."""


def stamp_resolution_s(time_s: Array) -> float:
    """Resolution of the times (s), if they are visibly rounded: a cycle of 50 ms on a clock of 15.6 ms; else 0.

    Examples
    --------
    >>> round(stamp_resolution_s(np.floor(np.arange(0.0, 9.0, 0.05) / 0.0156) * 0.0156), 6)
    0.0156
    >>> missing_row = np.array([0.0, 0.1, 0.2, 0.4, 0.5, 0.6, 0.7])
    >>> stamp_resolution_s(np.arange(0.0, 9.0, 0.05)), stamp_resolution_s(missing_row)
    (0.0, 0.0)
    """
    steps = np.sort(np.diff(time_s))
    if steps.size < 2 or steps[0] <= 0.0:
        return 0.0
    jumps = np.flatnonzero(np.diff(steps) > 0.5 * LEAST_S)
    if not 1 <= jumps.size < MOST_KINDS:
        return 0.0
    kinds = np.array([np.median(part) for part in np.split(steps, jumps + 1)])
    resolution = float(np.min(np.diff(kinds)))
    multiples = kinds / resolution
    if resolution < LEAST_S or np.any(np.abs(multiples - np.round(multiples)) > SAME * np.sqrt(multiples)):
        return 0.0
    shortest = (jumps[0] + 1) / steps.size
    is_missing_rows = round(multiples[0]) == 1 and (kinds.size > 2 or shortest > MISSING_ROWS)
    return 0.0 if is_missing_rows else resolution


def frame_resolution_s(time_s: Array) -> float:
    """Resolution (s) to which the container rounded the times of frames; 0 if nothing was rounded visibly.

    Frames of a camera with a constant period that is a multiple of the resolution have exact times, also if some frames
    are missing. A shortest step of the resolution itself tells nothing: 700 frames a second are 1 or 2 ms apart.

    Examples
    --------
    >>> frame_resolution_s(np.round(np.arange(200) / 30.0, 3))
    0.001
    >>> frame_resolution_s(np.arange(200) / 30.0), frame_resolution_s(np.arange(200) * 0.04)
    (0.0, 0.0)
    """
    steps = np.diff(np.sort(time_s))
    steps = steps[steps > 0.0]
    if steps.size < 2:
        return 0.0
    for resolution in DECIMALS_S:
        if _are_multiples(time_s - time_s[0], resolution):
            shortest = float(steps.min())
            is_exact = (
                _are_multiples(steps, shortest) if shortest > 1.5 * resolution else np.ptp(steps) < SAME * shortest
            )
            return 0.0 if is_exact else resolution
    return 0.0


def input_error_of_stamps(input_mm: Array, time_s: Array, runs: tuple[slice, ...], resolution_s: float) -> Array:
    """Standard uncertainty (mm) of the input at rounded times: the rounding's times the speed; shape (n,)."""
    speed_mm_s = np.zeros(input_mm.size)
    for run in runs:
        if run.stop - run.start > 1:
            speed_mm_s[run] = np.gradient(input_mm[run], time_s[run])
    return np.asarray(np.abs(speed_mm_s) * resolution_s / np.sqrt(12.0))


def _are_multiples(values: Array, step: float) -> bool:
    return bool(np.all(np.abs(values / step - np.round(values / step)) < SAME))
