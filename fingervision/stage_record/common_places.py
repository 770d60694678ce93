"""Turning points that strokes have in common: a stage that is sent to the same place turns there each time."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fingervision.stage_record.corner import Corner


def at_common_places(corners: Sequence[Corner], within_mm: float) -> list[Corner]:
    """Narrow the places of the reversals by those of the other strokes.

    Each reversal lies between the farther row beside it and the place at which the motions before and after it meet. If
    these ranges have a part in common, the strokes ended there: rows at rest in one stroke, or the motions of several,
    then determine the place for all.

    Parameters
    ----------
    corners : sequence of Corner
        All corners of a table.
    within_mm : float
        Largest distance between equal places, from the uncertainty of the rows.

    Returns
    -------
    list of Corner
        The same corners, with narrower ranges of `short_by`.
    """
    out = list(corners)
    for way in (1.0, -1.0):
        turning = [k for k, c in enumerate(out) if c.least_mm is not None and way * (c.input_mm - c.least_mm) > 0.0]
        rests = np.array([way * c.input_mm for c in out if c.least_mm is None])
        for group in _overlapping(turning, out, way):
            least = max(way * float(out[k].least_mm or 0.0) for k in group)
            most = min(way * out[k].input_mm for k in group)
            if least > most + within_mm:
                continue
            resting = rests[(rests >= least - within_mm) & (rests <= most + within_mm)]
            if resting.size:
                least = most = float(np.median(resting))
            elif len(group) == 1:
                continue
            for k in group:
                out[k] = _narrowed(out[k], way, least, max(most, least))
    return out


def _overlapping(turning: list[int], corners: Sequence[Corner], way: float) -> list[list[int]]:
    """Group reversals whose ranges overlap, from the lowest to the highest."""
    groups: list[list[int]] = []
    reach = -np.inf
    for k in sorted(turning, key=lambda k: way * float(corners[k].least_mm or 0.0)):
        if way * float(corners[k].least_mm or 0.0) > reach:
            groups.append([])
        groups[-1].append(k)
        reach = max(reach, way * corners[k].input_mm)
    return groups


def _narrowed(corner: Corner, way: float, least: float, most: float) -> Corner:
    farthest = way * corner.input_mm
    width = farthest - way * float(corner.least_mm or 0.0)
    low, high = corner.short_by
    shares = [float(np.clip((farthest - place) / width, low, high)) for place in (most, least)]
    return replace(corner, short_by=(shares[0], shares[1]))
