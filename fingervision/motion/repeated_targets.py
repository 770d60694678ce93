"""Recognise repeated visits of target positions (such as an ISO 230-2 cycle) in the path of a measured table."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import Array, Flags

Integers = NDArray[np.intp]

FEWEST_TARGETS = 3
"""Least number of targets of an axis: two positions are only the ends of one step."""
SPACING_RATIO = 10.0
"""Least ratio of the distance between neighbouring targets to that between inputs at one target. A stage repeats a
set-point within its in-position window, which is a small part of any tested spacing, whereas samples of a motion are
evenly spaced."""
WIDEST = 0.2
"""Largest range of the inputs at one target, as a share of the distance to the next; otherwise a reading could belong
to either target."""
MOST_TARGETS = 200
"""Largest number of targets: ISO 230-2 requires 5 per metre; with 200, five cycles have 2000 rests. More positions are
samples of a motion, or steps of an encoder."""
SHORTEST_REST_S = 0.3
"""Median time between visits of several rows each, below which the stage was in motion: a stage takes a few tenths of a
second to move, arrive and stop, and ISO 230-2 requires readings at rest."""
SHORTEST_SINGLE_S = 1.0
"""The same for visits of a single row, in which the stage is not seen to stand: at this rate a logger records a
motion."""
SETTLING_ROWS = 4
"""Least number of rows in a visit of which the first half is left out as settling."""
LEAST_SHARE = 0.5
"""Least share of the measured rows that must be in repeated visits; otherwise the figures would describe the smaller
part of the table."""


@dataclass(frozen=True, slots=True, eq=False)
class RepeatedTargets:
    """Target, direction of approach and visit number of each measured row.

    Parameters
    ----------
    target_mm : ndarray of float, shape (m,)
        Mean input of the target's rows.
    direction : ndarray of int, shape (m,)
        +1 for an approach from below, -1 from above, 0 if unknown or still settling: such rows are not used.
    cycle : ndarray of int, shape (m,)
        Number of the visit to this target from this side, counted from 0.
    notes : tuple of str
        Assumptions made, one sentence each.
    """

    target_mm: Array
    direction: Integers
    cycle: Integers
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class NoRepeatedTargets:
    """Reason why a table has no repeated visits of targets; the text completes a sentence."""

    reason: str


@dataclass(frozen=True, slots=True)
class _Visit:
    """Consecutive rows of the path at one target: rows with a reading, and the inputs before and after the visit.

    `places` contains all rows of the visit, including rows without a reading.
    """

    target: int
    places: tuple[int, ...]
    rows: tuple[int, ...]
    before_mm: float | None
    after_mm: float | None
    direction: int


def repeated_targets(
    input_mm: Array, measured: Flags, runs: Sequence[slice], time_s: Array | None = None
) -> RepeatedTargets | NoRepeatedTargets:
    """Find targets, directions of approach and cycles in a path.

    The direction of approach of a visit follows from the last earlier row at another position, with or without a
    reading (such as an overshoot or an approach). If the table lacks rows without a reading, two assumptions are made
    and reported. First, if a target at an end of the range has two successive readings where all other targets have one
    reading, the stage reversed with an overshoot between the two. Second, a run that starts at an end of the range came
    from beyond this end, if the table has pairs of readings at its ends, or if all its runs have the same direction.

    Parameters
    ----------
    input_mm : ndarray of float, shape (n,)
        Inputs of the path in order of time, run after run.
    measured : ndarray of bool, shape (n,)
        Rows with a reading; m is their number.
    runs : sequence of slice
        Rows of each run.
    time_s : ndarray of float, shape (n,), or None
        Times, by which rests are distinguished from motion.

    Returns
    -------
    RepeatedTargets or NoRepeatedTargets
        The visits, in the order of the measured rows, or the reason why there are none.
    """
    found = _targets(input_mm[measured])
    if isinstance(found, NoRepeatedTargets):
        return found
    centres, halfwidth = found
    visits = [visit for run in runs for visit in _visits(input_mm, measured, run, centres, halfwidth)]
    if time_s is not None:
        between = _seconds_between(visits, time_s, runs)
        several = bool(visits) and float(np.median([len(visit.places) for visit in visits])) > 1.0
        if between is not None and between < (SHORTEST_REST_S if several else SHORTEST_SINGLE_S):
            return NoRepeatedTargets(
                f"the input changes every {between:.2g} s, so readings were taken in motion and not at rest"
            )
    visits, notes = _ends(visits, centres)
    direction, cycle = np.zeros(input_mm.size, dtype=np.intp), np.zeros(input_mm.size, dtype=np.intp)
    target = np.zeros(input_mm.size)
    counted: dict[tuple[int, int], int] = {}
    read: dict[tuple[int, int], int] = {}
    for visit in visits:
        key = (visit.target, visit.direction)
        counted[key] = counted.get(key, -1) + 1
        read[key] = read.get(key, 0) + bool(visit.rows)
        target[list(visit.rows)] = centres[visit.target]
        cycle[list(visit.rows)] = counted[key]
        settled = visit.rows[len(visit.rows) // 2 :] if len(visit.rows) >= SETTLING_ROWS else visit.rows
        direction[list(settled)] = visit.direction
    repeated = {key for key, times in read.items() if times > 1 and key[1]}
    within = sum(len(visit.rows) for visit in visits if (visit.target, visit.direction) in repeated)
    if not repeated:
        return NoRepeatedTargets("no target is visited twice from the same side")
    if within < LEAST_SHARE * np.count_nonzero(measured):
        return NoRepeatedTargets(
            f"only {within} of {np.count_nonzero(measured)} readings are of targets visited twice from the same side"
        )
    return RepeatedTargets(target[measured], direction[measured], cycle[measured], notes)


def _targets(inputs: Array) -> tuple[Array, float] | NoRepeatedTargets:
    """Targets in ascending order, and the largest distance from a target at which an input still belongs to it."""
    ordered = np.sort(inputs)
    if ordered.size < 4 or ordered[0] == ordered[-1]:
        return NoRepeatedTargets("there are fewer than four readings, or the input never changes")
    # Equal set-points differ at most by the rounding of their digits.
    floor = 1e-9 * float(ordered[-1] - ordered[0])
    steps = np.maximum(np.diff(ordered), floor)
    falling = np.sort(steps)[::-1]
    # At most half as many targets as readings can have two readings each; among smaller steps, a chance pair could have
    # a large ratio.
    most = min(MOST_TARGETS, ordered.size // 2)
    ratios = (falling[:-1] / falling[1:])[: most - 1]
    last = int(np.argmax(ratios))
    if ratios[last] < SPACING_RATIO:
        return NoRepeatedTargets(
            "the inputs form no targets: no position is visited again, or readings were taken in motion"
        )
    parts = np.split(ordered, np.flatnonzero(steps >= falling[last]) + 1)
    if len(parts) < FEWEST_TARGETS:
        return NoRepeatedTargets(f"only {len(parts)} different targets were measured, and {FEWEST_TARGETS} are needed")
    centres = np.array([part.mean() for part in parts])
    halfwidth = max(max(abs(part[0] - c), abs(part[-1] - c)) for part, c in zip(parts, centres, strict=True))
    if max(np.ptp(part) for part in parts) > WIDEST * float(np.min(np.diff(centres))):
        return NoRepeatedTargets("the inputs scatter too widely about their targets to be set-points")
    # Rows without a reading may lie a little farther from a target than rows with a reading.
    return centres, 2.0 * float(halfwidth) + floor


def _visits(input_mm: Array, measured: Flags, run: slice, centres: Array, halfwidth: float) -> list[_Visit]:
    """Visits of a run in the order of travel, including visits without a reading."""
    path = input_mm[run]
    nearest = np.clip(np.searchsorted((centres[1:] + centres[:-1]) / 2.0, path), 0, centres.size - 1)
    at = np.where(np.abs(path - centres[nearest]) <= halfwidth, nearest, -1)
    starts = np.flatnonzero(np.concatenate([[True], (np.diff(at) != 0) | (at[1:] < 0)]))
    ends = np.append(starts[1:], path.size)
    out = []
    for start, end in zip(starts, ends, strict=True):
        if at[start] < 0:
            continue
        before = float(path[start - 1]) if start else None
        after = float(path[end]) if end < path.size else None
        places = tuple(range(run.start + int(start), run.start + int(end)))
        rows = tuple(row for row in places if measured[row])
        target = int(at[start])
        side = 0 if before is None else int(np.sign(centres[target] - before))
        out.append(_Visit(target, places, rows, before, after, side))
    return out


def _seconds_between(visits: Sequence[_Visit], time_s: Array, runs: Sequence[slice]) -> float | None:
    """Median time from the first reading of a visit to the first reading of the next visit within a run (s)."""
    first = np.array([visit.rows[0] for visit in visits if visit.rows])
    steps = [np.diff(time_s[first[(first >= run.start) & (first < run.stop)]]) for run in runs]
    together = np.concatenate(steps) if steps else np.empty(0)
    return float(np.median(together)) if together.size else None


def _ends(visits: list[_Visit], centres: Array) -> tuple[list[_Visit], tuple[str, ...]]:
    """Split pairs of readings at range ends into two visits; give a direction to runs that start at an end."""
    last = centres.size - 1
    inner = [len(visit.places) for visit in visits if 0 < visit.target < last]
    usual = int(np.median(inner)) if inner else 0
    beyond = {0: -1, last: 1}
    turns = [
        visit
        for visit in visits
        if visit.direction == beyond.get(visit.target) and _goes_back(visit, centres[visit.target])
    ]
    pairs = sum(len(visit.places) == 2 * usual for visit in turns)
    paired = usual > 0 and pairs > len(turns) / 2
    ways = {int(np.sign(v.after_mm - centres[v.target])) for v in visits if v.after_mm is not None}
    one_way = len(ways) == 1
    out: list[_Visit] = []
    began_beyond = False
    for visit in visits:
        if paired and any(visit is turn for turn in turns):
            # If a reversal has another number of rows, rows are missing, and it is unknown which row came first.
            whole = len(visit.places) == 2 * usual
            for part, side in ((visit.places[:usual], 1), (visit.places[usual:], -1)):
                rows = tuple(row for row in visit.rows if row in part)
                out.append(replace(visit, places=part, rows=rows, direction=side * visit.direction if whole else 0))
        elif not visit.direction and visit.after_mm is not None and (paired or one_way) and visit.target in beyond:
            away = int(np.sign(visit.after_mm - centres[visit.target]))
            began_beyond |= away == -beyond[visit.target]
            out.append(replace(visit, direction=away if away == -beyond[visit.target] else 0))
        else:
            out.append(visit)
    notes = []
    if paired:
        notes.append(
            "The table has no rows beyond its end targets: of two successive readings at an end target, the first is "
            "assumed to be approached from inside, the second from beyond, as in an ISO 230-2 cycle."
        )
    if began_beyond:
        notes.append("Runs that begin at an end target are assumed to have approached it from beyond.")
    unknown = sum(len(visit.rows) for visit in out if not visit.direction)
    if unknown:
        notes.append(
            f"{unknown} readings were left out, because it is not known from which side their target was approached."
        )
    return out, tuple(notes)


def _goes_back(visit: _Visit, centre: float) -> bool:
    """Whether the path leaves a target on the side from which it came."""
    if visit.before_mm is None or visit.after_mm is None:
        return False
    return bool(np.sign(visit.before_mm - centre) == np.sign(visit.after_mm - centre))
