"""Path of a stage between two rows of its log: Akima's curve, and corners where two straight lines meet."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from fingervision.domain.effect import Array
from fingervision.motion.encoder import differences

FINER = 6
"""Number of path points per row; the deviation of a chord from the curve decreases with its square, to a thirtieth."""
REACH, ABOUT_CORNER = 0.625, 15
"""Time before and after a corner, in rows, within which the path has more points, and number of these points on each
side. `corner_rounding` rounds corners there, over up to 1.25 rows. A chord over a 24th of a row reduces the rounding of
a reversal over a quarter of a row by 2 %; a chord over a sixth of a row reduced it by 20 %, which biased the fitted
play.
"""
FEWEST = 5
"""Least number of rows for a curve, and for fourth differences."""
CORNER = 0.07
"""Ratio of the standard deviation of an interpolated input to the fourth differences at both ends of its interval. A
corner of the motion anywhere between two rows causes an error of 0.105 of the change of step (RMS), which is 0.07 of
the fourth differences that it causes; the noise of the rows is then estimated within a tenth.
"""

SHARP = 5.0
"""Ratio of the change of step in an interval to those in the neighbouring intervals, and to a row's uncertainty, above
which there is a corner.
"""
BUMP = float(np.sqrt(30.0))
"""Factor of the parabola x (1 - x), which is zero at both rows, that gives an RMS of 1 between them."""
STANDS = 0.1
"""Ratio of a step to its neighbour below which the stage is at rest; the noise of a log is rarely larger."""


def piece(
    time_s: Array, input_mm: Array, u_mm: Array
) -> tuple[Array, Array, Array, Array, NDArray[np.intp], Array, Array]:
    """Interpolate the input between the rows of one run.

    Returns
    -------
    tuple
        Times, inputs, standard uncertainties, the part of each uncertainty that the interpolation causes, and the
        interval of each point; then times and inputs of the corners, at which the speed changes suddenly.
    """
    if time_s.size < FEWEST:
        none = np.zeros(0)
        return time_s, input_mm, u_mm, np.zeros(time_s.size), np.arange(time_s.size), none, none
    second_signed = np.pad(differences(input_mm, time_s, 2), 1, mode="edge")
    second = np.abs(second_signed)
    fourth = np.abs(np.pad(differences(input_mm, time_s, 4), 2, mode="edge"))
    between = CORNER * np.minimum(fourth[:-1] + fourth[1:], 3.0 * np.minimum(second[:-1], second[1:]))
    found = _corners(time_s, input_mm, second, u_mm)
    at_s = np.array([one.at_s for one in found])
    fine_s = _points(time_s, at_s)
    interval = np.clip(np.searchsorted(time_s, fine_s, side="right") - 1, 0, time_s.size - 2)
    fine_mm = _curve(time_s, input_mm, fine_s, interval)
    for one in found:
        inside = (fine_s >= time_s[one.first]) & (fine_s <= time_s[one.last])
        fine_mm[inside] = one.at_mm + np.where(fine_s < one.at_s, one.before, one.after)[inside] * (
            fine_s[inside] - one.at_s
        )
        between[one.first : one.last] = one.u_mm
    errors = np.hypot(between[interval], np.interp(fine_s, time_s, u_mm))
    share = (fine_s - time_s[interval]) / np.diff(time_s)[interval]
    bent = second_signed[interval] + second_signed[interval + 1]
    curve_mm = -np.sign(bent) * between[interval] * BUMP * share * (1.0 - share)
    turn_mm_s = np.array([one.after - one.before for one in found])
    return fine_s, fine_mm, errors, curve_mm, interval, at_s, turn_mm_s


def _points(time_s: Array, corner_s: Array) -> Array:
    """Times of the path's points: `FINER` for each row, each corner, and more points about it."""
    places = np.arange(FINER * (time_s.size - 1) + 1) / FINER
    even_s = np.interp(places, np.arange(time_s.size), time_s)
    near = np.linspace(-REACH, REACH, 2 * ABOUT_CORNER + 1) * float(np.median(np.diff(time_s)))
    about_s = (corner_s[:, None] + near).ravel()
    about_s = about_s[(about_s > time_s[0]) & (about_s < time_s[-1])]
    return np.unique(np.concatenate([even_s, about_s]))


@dataclass(frozen=True, slots=True)
class Corner:
    """Point where two straight stretches of a stage's path meet.

    Parameters
    ----------
    first, last : int
        Rows on the two lines, before and after the corner.
    at_s, at_mm : float
        Time and position at which the lines meet.
    before, after : float
        Speeds before and after the corner, in mm/s.
    u_mm : float
        Standard uncertainty of the corner's position.
    """

    first: int
    last: int
    at_s: float
    at_mm: float
    before: float
    after: float
    u_mm: float


def _corners(time_s: Array, input_mm: Array, second: Array, u_mm: Array) -> list[Corner]:
    """Find corners of the path without a row in them: a reversal lies between two rows."""
    k = np.arange(2, time_s.size - 3)
    bend, beside = second[k] + second[k + 1], second[k - 1] + second[k + 2]
    speed = np.diff(input_mm) / np.diff(time_s)
    apart = speed[k - 1] - speed[k + 1]
    met_s = np.where(
        apart != 0.0,
        (input_mm[k + 1] - input_mm[k] - speed[k + 1] * (time_s[k + 1] - time_s[k])) / np.where(apart, apart, 1.0),
        -1.0,
    )
    isolated = (bend > SHARP * beside) & (bend > SHARP * u_mm[k]) & (met_s > 0.0) & (met_s < np.diff(time_s)[k])
    return [
        Corner(
            row,
            row + 1,
            float(time_s[row] + after),
            float(input_mm[row] + speed[row - 1] * after),
            float(speed[row - 1]),
            float(speed[row + 1]),
            float(uncertain),
        )
        for row, after, uncertain in zip(k[isolated].tolist(), met_s[isolated], beside[isolated], strict=True)
    ]


def _curve(time_s: Array, input_mm: Array, fine_s: Array, interval: NDArray[np.intp]) -> Array:
    """Interpolate by Akima's curve; next to an interval in which the stage rests, the curve stays between its rows.

    A stage that arrives and stops has not been beyond its position of rest, and the play depends on the extreme
    position.
    """
    curve = np.asarray(Akima1DInterpolator(time_s, input_mm)(fine_s), dtype=np.float64)
    steps = np.abs(np.diff(input_mm))
    beside = np.minimum(np.append(steps[1:], np.inf), np.insert(steps[:-1], 0, np.inf))
    low = np.minimum(input_mm[:-1], input_mm[1:])[interval]
    high = np.maximum(input_mm[:-1], input_mm[1:])[interval]
    return np.where((beside < STANDS * steps)[interval], np.clip(curve, low, high), curve)
