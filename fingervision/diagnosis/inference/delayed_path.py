"""A path with points at earlier times, so that a delay acts on exact values between the points of the path."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import History, InputPath
from fingervision.effects.time_delay import late

SAME_S = 1e-9
"""Times closer than this are one point: the rounding of a difference of two times."""


def delayed_path(history: History, rows: NDArray[np.intp], delay_s: float, *, curved: bool) -> InputPath:
    """Add points at the times `delay_s` before each point of a path, which become the rows.

    An effect with memory, such as a play, changes its output between the points of a path: where the stage turns, and
    where the play is taken up. A delay that acts before it on the points alone would miss the turning points, and one
    that acts behind it would interpolate over the places where the play is taken up.

    Parameters
    ----------
    history : History
        History along the path, with times.
    rows : ndarray of int, shape (n,)
        Points of the path at which rows lie.
    delay_s : float
        The delay.
    curved : bool
        Whether the input follows curves between the points (`late`).

    Returns
    -------
    InputPath
        The path with the added points; its rows are the points `delay_s` earlier than the given ones.
    """
    earlier_mm = late(history.input_mm, history, delay_s, curved=curved)
    inputs, times, runs = [], [], []
    place = np.zeros(history.input_mm.size, dtype=np.intp)
    begin = 0
    for run in history.runs:
        time_s = history.times[run]
        ago_s = np.maximum(time_s - delay_s, time_s[0])
        next_to = np.clip(np.searchsorted(time_s, ago_s - SAME_S), 0, time_s.size - 1)
        new = np.abs(time_s[next_to] - ago_s) > SAME_S
        every_s = np.concatenate([time_s, ago_s[new]])
        order = np.argsort(every_s, kind="stable")
        to = np.empty(order.size, dtype=np.intp)
        to[order] = np.arange(order.size)
        place[run] = begin + to[next_to]
        place[run][new] = begin + to[time_s.size :]
        inputs.append(np.concatenate([history.input_mm[run], earlier_mm[run][new]])[order])
        times.append(every_s[order])
        runs.append(slice(begin, begin + order.size))
        begin += order.size
    longer = replace(history, input_mm=np.concatenate(inputs), time_s=np.concatenate(times), runs=tuple(runs))
    return InputPath(longer, place[rows], np.full(begin, -1, dtype=np.intp))
