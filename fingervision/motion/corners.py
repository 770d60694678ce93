"""Corners of a motion that lie between two recorded rows: reversals, starts and stops of the stage.

A stage that reverses between two rows goes farther than either of them shows. At a constant speed v and rows dt apart,
the rows miss up to v dt / 2 of the stroke. A play is that small too: without the turning points, a delay, which is the
same as a play on every straight stroke, explains the rows beside a reversal better. A straight line between the rows
beside a start or a stop is wrong by up to v dt / 4, which a delayed mechanism shows at a later row.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fingervision.domain.effect import Array

# A corner of a motion between two recorded rows.

MOST_SHORT = 0.999
"""Largest share of the way back to the row at which the stage turned: the points of the path keep different times. For
the same reason, a stage that turned within a thousandth of the meeting place turned there."""
KNOWN = 0.01
"""Range of this share below which the turning point is known."""


@dataclass(frozen=True, slots=True)
class Corner:
    """A corner of the motion between two rows.

    Parameters
    ----------
    after : int
        Index of the row before it.
    time_s, input_mm : float
        Its time and input.
    least_mm : float or None
        At a reversal, input of the farther one of the two rows beside it: a stage that stops for a moment, or slows
        down, turns anywhere between this row and `input_mm`. None at a start or stop.
    passed_s : (float, float)
        Times at which the continued motions before and after a reversal pass `least_mm`.
    short_by : (float, float)
        Least and largest share of the way from `input_mm` back to `least_mm` at which the stage can have turned.
    """

    after: int
    time_s: float
    input_mm: float
    least_mm: float | None = None
    passed_s: tuple[float, float] = (0.0, 0.0)
    short_by: tuple[float, float] = (0.0, MOST_SHORT)

    @property
    def free(self) -> bool:
        """Whether the place of the reversal is not known from the rows."""
        return self.least_mm is not None and self.short_by[1] - self.short_by[0] > KNOWN

    def points(self, short_by: float) -> list[tuple[float, float]]:
        """Time and input of the path's points here.

        Parameters
        ----------
        short_by : float
            At a reversal, share of the way from `input_mm` back to `least_mm` at which the stage stops, until the
            motion after the reversal passes this place.
        """
        if self.least_mm is None or short_by < 1.0 - MOST_SHORT:
            return [(self.time_s, self.input_mm)]
        place_mm = self.input_mm + short_by * (self.least_mm - self.input_mm)
        return [(self.time_s + short_by * (at_s - self.time_s), place_mm) for at_s in self.passed_s]


# A recorded motion, continued beyond a row as a straight line or a parabola.

SURELY = 3.0
"""Standard uncertainties beyond which a difference is not noise of the input."""
STENCIL = 3
"""Rows that determine a motion that is not straight: position, speed and acceleration."""
STRAIGHT_ROWS = (10, 7, 5, 3)
"""Numbers of rows of a straight line, of which the largest possible is used: with ten rows, the continued line is as
uncertain as one row, with three it is twice as uncertain."""
ROUNDED = 1e-4
"""Largest distance from a straight line, as a share of the motion between two rows, for a record without noise."""


@dataclass(frozen=True, slots=True, eq=False)
class ContinuedMotion:
    """The motion on one side of a row, continued to given times.

    Parameters
    ----------
    input_mm : ndarray of float, shape (k,)
        The continued input.
    u_mm : float
        Largest standard uncertainty of the continued input from the noise of the rows.
    straight : bool
        Whether the rows lie on a straight line.
    """

    input_mm: Array
    u_mm: float
    straight: bool


def continued(
    input_mm: Array, time_s: Array, row: int, side: int, at_s: Array, sigma_mm: float
) -> ContinuedMotion | None:
    """Continue a motion beyond a row.

    Parameters
    ----------
    input_mm, time_s : ndarray of float, shape (n,)
        Recorded inputs and times.
    row, side : int
        The row beyond which the motion is continued, and -1 to continue the motion before it, 1 the motion after it.
    at_s : ndarray of float, shape (k,)
        Times.
    sigma_mm : float
        Standard uncertainty of one recorded input.

    Returns
    -------
    ContinuedMotion or None
        None if there are too few rows.
    """
    last = row if side < 0 else input_mm.size - 1 - row
    if last >= 1 and abs(input_mm[row + side] - input_mm[row]) <= SURELY * np.sqrt(2.0) * sigma_mm:
        # A stage at rest stays there.
        return ContinuedMotion(np.full(at_s.size, 0.5 * (input_mm[row] + input_mm[row + side])), sigma_mm, True)
    for count in STRAIGHT_ROWS:
        if last + 1 < count:
            continue
        rows = row + side * np.arange(count)
        t, u = time_s[rows] - time_s[row], input_mm[rows]
        slope = float(np.sum((t - t.mean()) * u) / np.sum((t - t.mean()) ** 2))
        away = u - u.mean() - slope * (t - t.mean())
        step_mm = abs(slope * float(t[-1])) / (count - 1)
        if np.max(np.abs(away)) <= SURELY * sigma_mm + ROUNDED * step_mm:
            far = at_s - time_s[row] - t.mean()
            gain = np.sqrt(1.0 / count + np.max(far**2) / float(np.sum((t - t.mean()) ** 2)))
            return ContinuedMotion(u.mean() + slope * far, float(gain) * sigma_mm, True)
    if last + 1 < STENCIL:
        return None
    rows = row + side * np.arange(STENCIL)
    weights = _parabola(time_s[rows], at_s)
    gain = np.sqrt(np.max(np.sum(weights**2, axis=1)))
    return ContinuedMotion(weights @ input_mm[rows], float(gain) * sigma_mm, False)


def _parabola(t: Array, at: Array) -> Array:
    """Weights of three rows in the parabola through them (Lagrange), shape (times, 3)."""
    columns = []
    for j in range(STENCIL):
        others = [k for k in range(STENCIL) if k != j]
        columns.append(np.prod([(at - t[k]) / (t[j] - t[k]) for k in others], axis=0))
    return np.stack(columns, axis=1)


# Turning points that strokes have in common: a stage that is sent to the same place turns there each time.


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


LONGEST_GAP = 5.0
"""Longest time between two rows, in median time steps, over which the motion is continued: a few rows are missing. In
a longer pause of the record, the stage may have done anything."""
BENT = 0.2
"""Least distance of a row at rest from a continued motion that is not straight, as a share of the bend there (second
difference of the input). At a smooth reversal with 25 rows a period, a parabola continues the motion to a quarter of
the bend."""
FINE = 33
"""Times between two rows at which both continuations are compared: the turning point of a smooth reversal is then exact
to a thousandth of the motion between two rows."""


def corners(input_mm: Array, time_s: Array, runs: tuple[slice, ...], sigma_mm: float) -> list[Corner]:
    """Find the corners of a motion between its recorded rows.

    The motions before and after a corner are continued to where they intersect (`continued`); beside a start or stop,
    both must be straight. At a reversal without a corner, both are the same curve, and its vertex is the turning point.

    Parameters
    ----------
    input_mm, time_s : ndarray of float, shape (m,)
        Recorded input, read in motion, and times.
    runs : tuple of slice
        Rows of each run.
    sigma_mm : float
        Standard uncertainty of one recorded input.

    Returns
    -------
    list of Corner
        Sorted by row; at most one between two rows.
    """
    found: dict[int, Corner] = {}
    for run in runs:
        u, t = input_mm[run], time_s[run]
        if u.size < 2 * STENCIL:
            continue
        # Rows of a stage at rest, interpolated in a log, differ by the rounding of floating-point numbers.
        known_mm = max(sigma_mm, float(np.spacing(np.max(np.abs(u)))))
        rows = _Rows(u, t, LONGEST_GAP * float(np.median(np.diff(t))), known_mm, run.start)
        for corner in (*rows.starts_and_stops(), *rows.reversals()):
            found[corner.after] = corner
    return at_common_places(sorted(found.values(), key=lambda corner: corner.after), SURELY * sigma_mm)


@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """Rows of one run: inputs, times, longest gap, uncertainty of an input, and index of the first row."""

    u: Array
    t: Array
    longest_s: float
    sigma_mm: float
    first: int

    def reversals(self) -> list[Corner]:
        """Find the reversals that lie beyond the rows."""
        found = []
        step = np.sign(np.diff(self.u))
        for way in (1.0, -1.0):
            # Rows at which the motion away from them changes: the turning point lies before or after such a row.
            tops = 1 + np.flatnonzero((way * step[:-1] > 0.0) & (way * step[1:] <= 0.0))
            for top in tops.tolist():
                rest = self._rest_at(top, way)
                if rest:
                    found += rest
                    continue
                beside = [self._beyond(i, way) for i in (top - 1, top)]
                best = max((c for c in beside if c is not None), key=lambda c: way * c.input_mm, default=None)
                if best is not None:
                    found.append(best)
        return found

    def starts_and_stops(self) -> list[Corner]:
        """Find the corners without a reversal, of which the sharpest in its neighbourhood counts."""
        u, t, n = self.u, self.t, self.u.size
        before, u_before = _straight_motions(u, t, self.sigma_mm)
        after, u_after = (values[::-1] for values in _straight_motions(u[::-1], -t[::-1], self.sigma_mm))
        # Between the rows i and i + 1; motions that are not straight are NaN, and fail every comparison.
        i, step_s = np.arange(1, n - 2), np.diff(t)
        rising, falling = before[i], after[i + 1, ::-1]
        apart, ways = rising - falling, np.stack([np.diff(rising)[:, 0], np.diff(falling)[:, 0]])
        share = apart[:, 0] / np.where(apart[:, 0] == apart[:, 1], np.inf, apart[:, 0] - apart[:, 1])
        place = rising[:, 0] + share * ways[0]
        beside = np.abs(place - (u[i] + share * (u[i + 1] - u[i])))
        noise = SURELY * np.hypot(np.maximum(u_before[i], u_after[i + 1]), self.sigma_mm)
        found = np.lib.stride_tricks.sliding_window_view(step_s, 3).max(axis=1) <= self.longest_s
        found &= (ways[0] * ways[1] >= 0.0) & (apart[:, 0] * apart[:, 1] < 0.0)
        found &= (share > 1.0 / FINE) & (share < 1.0 - 1.0 / FINE)
        found &= beside > np.maximum(noise, ROUNDED * np.abs(u[i + 1] - u[i]))
        size = np.pad(np.where(found, np.abs(ways[1] - ways[0]) / step_s[i], 0.0), 1)
        found &= size[1:-1] >= np.maximum(size[:-2], size[2:])
        return [
            Corner(self.first + int(k), float(t[k] + share[k - 1] * step_s[k]), float(place[k - 1])) for k in i[found]
        ]

    def _rest_at(self, top: int, way: float) -> list[Corner]:
        """Stop and start beside a row at which the stage rested: the row lies on neither continued motion."""
        if not self._continued(top - 1, top + 1):
            return []
        t, at = self.t, np.array([self.t[top]])
        u = way * self.u
        bend = 2.0 * u[top] - u[top - 1] - u[top + 1]
        ends = []
        for other, side, after in ((top - 1, -1, top - 1), (top + 1, 1, top)):
            motion = self._beyond_row(other, side, at, way)
            if motion is None:
                return []
            ahead = float(motion.input_mm[0]) - u[top]
            bent = ROUNDED if motion.straight else BENT
            if ahead <= max(SURELY * float(np.hypot(motion.u_mm, self.sigma_mm)), bent * bend):
                return []
            share = (u[top] - u[other]) / (ahead + u[top] - u[other])
            ends.append(Corner(self.first + after, float(t[other] + share * (t[top] - t[other])), float(self.u[top])))
        return ends

    def _continued(self, i: int, j: int) -> bool:
        """Whether the motions up to row i and from row j on are known, without a pause of the record."""
        known = i >= STENCIL - 1 and j + STENCIL <= self.u.size
        return known and bool(np.max(np.diff(self.t[i : j + 1])) <= self.longest_s)

    def _beyond_row(self, i: int, side: int, at: Array, way: float) -> ContinuedMotion | None:
        """Continue the motion beyond a row, upside down if `way` is -1.

        A motion that is not straight goes no farther than at its speed beside the row: a parabola through rows of a
        corner overestimates it.
        """
        u, t = way * self.u, self.t
        motion = continued(u, t, i, side, at, self.sigma_mm)
        if motion is None or motion.straight:
            return motion
        line = u[i] + (u[i + side] - u[i]) / (t[i + side] - t[i]) * (at - t[i])
        return replace(motion, input_mm=np.minimum(motion.input_mm, line))

    def _beyond(self, i: int, way: float) -> Corner | None:
        """Find the reversal beyond the rows i and i + 1; None if the rows show none."""
        u, t = way * self.u, self.t
        # Two equal rows are a short stop: a stage in motion is seldom at exactly the same place on both sides of a
        # corner.
        if not self._continued(i, i + 1) or u[i] == u[i + 1]:
            return None
        at = np.linspace(t[i], t[i + 1], FINE)
        before, after = self._beyond_row(i, -1, at, way), self._beyond_row(i + 1, 1, at, way)
        if before is None or after is None:
            return None
        at, rising, falling = _with_crossing(at, before.input_mm, after.input_mm)
        height = np.minimum(rising, falling)
        top, least = int(np.argmax(height)), float(max(u[i], u[i + 1]))
        beyond = height[top] - least
        if beyond <= max(SURELY * max(before.u_mm, after.u_mm), ROUNDED * abs(u[i + 1] - u[i])):
            return None
        # Both rows are passed at their own times, the lower one's motion passes the height of the other in between.
        leave_s = float(np.interp(least, np.maximum.accumulate(rising[: top + 1]), at[: top + 1]))
        return_s = float(np.interp(least, np.maximum.accumulate(falling[top:][::-1]), at[top:][::-1]))
        return Corner(self.first + i, float(at[top]), way * float(height[top]), way * least, (leave_s, return_s))


def _straight_motions(input_mm: Array, time_s: Array, sigma_mm: float) -> tuple[Array, Array]:
    """Straight motion up to each row, continued to the next one; NaN where the motion is not straight.

    Returns
    -------
    at_mm : ndarray of float, shape (n, 2)
        The continued input at the row and at the next row.
    u_mm : ndarray of float, shape (n,)
        Largest standard uncertainty of both.
    """
    at_mm, u_mm = np.full((input_mm.size, 2), np.nan), np.full(input_mm.size, np.nan)
    ahead_s = np.stack([np.zeros(input_mm.size), np.diff(time_s, append=np.nan)], axis=1)
    for count in reversed([count for count in STRAIGHT_ROWS if count <= input_mm.size]):
        u, t = (np.lib.stride_tricks.sliding_window_view(values, count) for values in (input_mm, time_s))
        middle, rows = u.mean(axis=1), np.arange(count - 1, input_mm.size)
        lead_s = t.mean(axis=1) - time_s[rows]
        off_s = t - t.mean(axis=1, keepdims=True)
        squares = np.sum(off_s**2, axis=1)
        slope = np.sum(off_s * u, axis=1) / squares
        away = np.max(np.abs(u - middle[:, None] - slope[:, None] * off_s), axis=1)
        step_mm = np.abs(slope * (t[:, 0] - t[:, -1])) / (count - 1)
        straight = away <= SURELY * sigma_mm + ROUNDED * step_mm
        far_s = ahead_s[rows] - lead_s[:, None]
        gain = np.sqrt(1.0 / count + np.max(far_s**2, axis=1) / squares)
        at_mm[rows[straight]] = (middle[:, None] + slope[:, None] * far_s)[straight]
        u_mm[rows[straight]] = (gain * sigma_mm)[straight]
    # A stage at rest stays there.
    rests = 1 + np.flatnonzero(np.abs(np.diff(input_mm)) <= SURELY * np.sqrt(2.0) * sigma_mm)
    at_mm[rests] = 0.5 * (input_mm[rests] + input_mm[rests - 1])[:, None]
    u_mm[rests] = sigma_mm
    return at_mm, u_mm


def _with_crossing(at: Array, rising: Array, falling: Array) -> tuple[Array, Array, Array]:
    """Add the time at which two continued motions cross, by linear interpolation."""
    apart = rising - falling
    crossed = np.flatnonzero((apart[:-1] < 0.0) & (apart[1:] > 0.0))
    if not crossed.size:
        return at, rising, falling
    k = int(crossed[0])
    share = apart[k] / (apart[k] - apart[k + 1])
    columns = (np.insert(c, k + 1, c[k] + share * (c[k + 1] - c[k])) for c in (at, rising, falling))
    at, rising, falling = columns
    return at, rising, falling
