"""Draws of a log's path within its uncertainty, with the correlation that its errors have."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fingervision.domain.effect import Array
from fingervision.measuring.clock.log_path import LogPath

DRAWS = 48
"""Number of draws; a variance then has a relative standard uncertainty of a fifth, and a standard deviation of a tenth.
"""
SEED = 16
"""Seed of the draws, so that the same log gives the same uncertainty."""
ALIKE = 0.5
"""Share of the variance between rows that all bends have in common. If a corner lies anywhere between two rows,
interpolation cuts it by 0.0725 of its change of step on average, and by 0.105 as RMS, so that the squared mean is half
of the mean square.
"""

TURNS_ALIKE = 1.0
"""Error that all reversals without a halt have in common, relative to the standard uncertainty of an encoder's
rounding. If a stage slows down within half a step of an encoder line, the smoothed path turns up to half a step too
far, which is 1.7 times the rounding's standard uncertainty.
"""


def drawn_paths(path: LogPath) -> Iterator[LogPath]:
    """Draw paths of the stage that are compatible with the log's rows.

    Three kinds of error are drawn. First, smoothing averages the noise over several rows, so that the errors of
    neighbouring rows are correlated. Second, the rounding error of an encoder is common to all rows of a halt, a
    reversal, or a stretch of a stroke. Third, a corner may lie anywhere between two rows, and a smooth curve cuts all
    corners on the same side. Reversals between two lines of an encoder are cut on the same side as well, by the
    rounding and by the smoothing.

    Parameters
    ----------
    path : LogPath
        Path with its uncertainty.

    Yields
    ------
    LogPath
    """
    rng = np.random.default_rng(SEED)
    time_s, parts, shared = path.drive.time_s, path.parts, path.shared
    stretch = np.searchsorted(shared.begin_s, time_s, side="right")
    for _ in range(DRAWS):
        rows_mm = parts.rows_mm * _averaged(rng.normal(size=parts.rows_mm.size), parts.span)
        common = np.sqrt(ALIKE) * rng.normal()
        own = np.sqrt(1.0 - ALIKE) * rng.normal(size=int(parts.interval.max()) + 1)
        input_mm = path.drive.input_mm + np.interp(time_s, path.rows.time_s, rows_mm)
        input_mm = input_mm + (common + own[parts.interval]) * parts.between_mm
        errors_mm = shared.u_mm * rng.normal(size=shared.u_mm.size)
        errors_mm += TURNS_ALIKE * shared.u_mm * rng.normal() * shared.outward
        input_mm = input_mm + errors_mm[stretch]
        yield replace(path, drive=replace(path.drive, input_mm=input_mm))


def _averaged(white: Array, span: Array) -> Array:
    """Mean of white noise over `span` rows about each row, scaled to a variance of 1."""
    sums = np.append(0.0, np.cumsum(white))
    rows = np.arange(white.size)
    half = 0.5 * (span - 1.0)
    low = np.clip(np.round(rows - half), 0, rows).astype(int)
    high = np.clip(np.round(rows + half), rows, white.size - 1).astype(int) + 1
    return np.asarray((sums[high] - sums[low]) / np.sqrt(high - low))
