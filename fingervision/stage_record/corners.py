"""Corners of a motion that lie between two recorded rows: reversals, starts and stops of the stage.

A stage that reverses between two rows goes farther than either of them shows. At a constant speed v and rows dt apart,
the rows miss up to v dt / 2 of the stroke. A play is that small too: without the turning points, a delay, which is the
same as a play on every straight stroke, explains the rows beside a reversal better. A straight line between the rows
beside a start or a stop is wrong by up to v dt / 4, which a delayed mechanism shows at a later row.
"""

from dataclasses import dataclass, replace

import numpy as np

from fingervision.domain.effect import Array
from fingervision.stage_record.common_places import at_common_places
from fingervision.stage_record.continued_motion import ROUNDED, STENCIL, SURELY, ContinuedMotion, continued
from fingervision.stage_record.corner import Corner

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
        rows = _Rows(u, t, LONGEST_GAP * float(np.median(np.diff(t))), sigma_mm, run.start)
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
                if self._still(top - 1) or self._still(top):
                    continue
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
        found = [(self._bend(i), i) for i in range(1, self.u.size - 2)]
        size = np.zeros(self.u.size + 1)
        for bend, i in found:
            size[i] = 0.0 if bend is None else bend[0]
        return [bend[1] for bend, i in found if bend is not None and size[i] >= max(size[i - 1], size[i + 1])]

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

    def _still(self, i: int) -> bool:
        """Whether the rows i and i + 1 are at the same place: the stage rests, so that no reversal lies beside them."""
        return bool(abs(self.u[i + 1] - self.u[i]) <= SURELY * np.sqrt(2.0) * self.sigma_mm)

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

    def _bend(self, i: int) -> tuple[float, Corner] | None:
        """Find the corner between straight motions up to row i and from row i + 1, with the change of speed."""
        u, t = self.u, self.t
        if np.max(np.diff(t[i - 1 : i + 3])) > self.longest_s:
            return None
        at = t[i : i + 2]
        before, after = (continued(u, t, k, side, at, self.sigma_mm) for k, side in ((i, -1), (i + 1, 1)))
        if before is None or after is None or not (before.straight and after.straight):
            return None
        apart = before.input_mm - after.input_mm
        speeds = [float(np.diff(motion.input_mm)[0] / (t[i + 1] - t[i])) for motion in (before, after)]
        if speeds[0] * speeds[1] < 0.0 or apart[0] * apart[1] >= 0.0:
            return None
        share = float(apart[0] / (apart[0] - apart[1]))
        place = float(before.input_mm[0] + share * np.diff(before.input_mm)[0])
        beside = abs(place - (u[i] + share * (u[i + 1] - u[i])))
        noise = SURELY * float(np.hypot(max(before.u_mm, after.u_mm), self.sigma_mm))
        if not 1.0 / FINE < share < 1.0 - 1.0 / FINE or beside <= max(noise, ROUNDED * abs(u[i + 1] - u[i])):
            return None
        return abs(speeds[1] - speeds[0]), Corner(self.first + i, float(t[i] + share * (t[i + 1] - t[i])), place)


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
