"""Corners of a motion that lie between two recorded rows: reversals, starts and stops of the stage.

A stage that reverses between two rows goes farther than either of them shows. At a constant speed v and rows dt apart,
the rows miss up to v dt / 2 of the stroke. A play is that small too: without the turning points, a delay, which is the
same as a play on every straight stroke, explains the rows beside a reversal better. A straight line between the rows
beside a start or a stop is wrong by up to v dt / 4, which a delayed mechanism shows at a later row.
"""

from dataclasses import dataclass

import numpy as np

from fingervision.domain.effect import Array
from fingervision.stage_record.common_places import at_common_places
from fingervision.stage_record.corner import Corner

STENCIL = 3
"""Rows on either side that determine the motion up to the corner: position, speed and acceleration."""
LONGEST_GAP = 5.0
"""Longest time between two rows, in median time steps, over which the motion is continued: a few rows are missing. In
a longer pause of the record, the stage may have done anything."""
SURELY = 3.0
"""Standard uncertainties by which a corner must lie beside the line through the rows, so that noise of the input adds
none."""
BENT = 0.2
"""Bend, as a share of that at the corner, up to which the motions beside a start or stop are straight; and least
distance of a row at rest from both continued motions, as a share of the bend there. At a smooth reversal with 25 rows a
period, a parabola continues the motion to a quarter of the bend."""
FINE = 33
"""Times between two rows at which both continuations are compared: the turning point of a smooth reversal is then exact
to a thousandth of the motion between two rows."""


def corners(input_mm: Array, time_s: Array, runs: tuple[slice, ...], sigma_mm: float) -> list[Corner]:
    """Find the corners of a motion between its recorded rows.

    The motions before and after a corner are continued to where they intersect: beside a reversal by parabolas through
    three rows each, beside a start or stop, where both must be straight, by lines. At a reversal without a corner, both
    parabolas are the same curve, and its vertex is the turning point.

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
        u, t = way * self.u, self.t
        if not self._continued(top - 1, top + 1):
            return []
        at = np.array([t[top]])
        before, after = slice(top - STENCIL, top), slice(top + 1, top + 1 + STENCIL)
        bend = 2.0 * u[top] - u[top - 1] - u[top + 1]
        shares = []
        for rows, one, other in ((before, top - 2, top - 1), (after, top + 2, top + 1)):
            weights = _weights(t[rows], at)
            ahead = min(float((weights @ u[rows])[0]), float(_line(u, t, one, other, at)[0]))
            noise = SURELY * float(np.sqrt(np.sum(weights**2) + 1.0)) * self.sigma_mm
            if ahead - u[top] <= max(noise, BENT * bend):
                return []
            shares.append((u[top] - u[other]) / (ahead - u[other]))
        ends = [
            (after, t[other] + share * (t[top] - t[other]))
            for share, other, after in zip(shares, (top - 1, top + 1), (top - 1, top), strict=True)
        ]
        return [Corner(self.first + i, float(at_s), float(self.u[top])) for i, at_s in ends]

    def _still(self, i: int) -> bool:
        """Whether the rows i and i + 1 are at the same place: the stage rests, so that no reversal lies beside them."""
        return bool(abs(self.u[i + 1] - self.u[i]) <= SURELY * np.sqrt(2.0) * self.sigma_mm)

    def _continued(self, i: int, j: int) -> bool:
        """Whether the motions up to row i and from row j on are known, without a pause of the record."""
        known = i >= STENCIL - 1 and j + STENCIL <= self.u.size
        return known and bool(np.max(np.diff(self.t[i : j + 1])) <= self.longest_s)

    def _beyond(self, i: int, way: float) -> Corner | None:
        """Find the reversal beyond the rows i and i + 1; None if the rows show none."""
        u, t = way * self.u, self.t
        # Two equal rows are a short stop: a stage in motion is seldom at exactly the same place on both sides of a
        # corner.
        if not self._continued(i, i + 1) or u[i] == u[i + 1]:
            return None
        at = np.linspace(t[i], t[i + 1], FINE)
        before, after = slice(i - STENCIL + 1, i + 1), slice(i + 1, i + 1 + STENCIL)
        # No farther than at the speeds beside the reversal: a parabola through rows of a bend overestimates it.
        rising = np.minimum(_weights(t[before], at) @ u[before], _line(u, t, i - 1, i, at))
        falling = np.minimum(_weights(t[after], at) @ u[after], _line(u, t, i + 2, i + 1, at))
        at, rising, falling = _with_crossing(at, rising, falling)
        height = np.minimum(rising, falling)
        top = int(np.argmax(height))
        sums = [np.sum(_weights(t[rows], at[top : top + 1]) ** 2) for rows in (before, after)]
        gain = float(np.sqrt(max(sums)))
        least = max(u[i], u[i + 1])
        if height[top] - least <= SURELY * gain * self.sigma_mm:
            return None
        # Both rows are passed at their own times, the lower one's motion passes the height of the other in between.
        leave_s = float(np.interp(least, np.maximum.accumulate(rising[: top + 1]), at[: top + 1]))
        return_s = float(np.interp(least, np.maximum.accumulate(falling[top:][::-1]), at[top:][::-1]))
        return Corner(self.first + i, float(at[top]), way * float(height[top]), way * float(least), (leave_s, return_s))

    def _bend(self, i: int) -> tuple[float, Corner] | None:
        """Find the corner between straight motions up to row i and from row i + 1, with the change of speed."""
        u, t = self.u, self.t
        near = slice(max(0, i - 2), i + 4)
        step_s = np.diff(t[near])
        speed, noise = np.diff(u[near]) / step_s, SURELY * np.sqrt(2.0) * self.sigma_mm / float(np.min(step_s))
        gap = i - near.start
        before, after = speed[:gap], speed[gap + 1 :]
        before = before[-1:] if self._still(i - 1) else before
        after = after[:1] if self._still(i + 1) else after
        change = after[0] - before[-1]
        bent = max(float(np.ptp(before)), float(np.ptp(after)))
        if before[-1] * after[0] < 0.0 or np.max(step_s) > self.longest_s or bent > max(BENT * abs(change), noise):
            return None
        if abs(change) <= max(noise, 1e-9 * float(np.max(np.abs(speed)))):
            return None
        at_s = (u[i + 1] - u[i] - after[0] * t[i + 1] + before[-1] * t[i]) / (before[-1] - after[0])
        place = u[i] + before[-1] * (at_s - t[i])
        margin_s = (t[i + 1] - t[i]) / FINE
        beside = abs(place - float(np.interp(at_s, t[i : i + 2], u[i : i + 2])))
        if not t[i] + margin_s < at_s < t[i + 1] - margin_s or beside <= 2.0 * SURELY * self.sigma_mm:
            return None
        return abs(change), Corner(self.first + i, float(at_s), float(place))


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


def _weights(t: Array, at: Array) -> Array:
    """Weights of three rows in the parabola through them (Lagrange), shape (times, 3)."""
    columns = []
    for j in range(STENCIL):
        others = [k for k in range(STENCIL) if k != j]
        columns.append(np.prod([(at - t[k]) / (t[j] - t[k]) for k in others], axis=0))
    return np.stack(columns, axis=1)


def _line(u: Array, t: Array, one: int, other: int, at: Array) -> Array:
    """Continue the straight line through two rows."""
    return np.asarray(u[other] + (u[other] - u[one]) / (t[other] - t[one]) * (at - t[other]))
