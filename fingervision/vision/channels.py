"""Ground between two straight sides: the room between the fingers, wherever a part between them leaves it open.

Seen with the tips up, every row of a binary picture has runs of ground pixels between runs of finger or part pixels.
Runs of ground in successive rows, with hardly any step between their ends, form a channel. A gripper that holds a part
shows a channel above the part, a channel below it, or both, between the same two straight lines.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled
from fingervision.vision.likeness import Build, are_alike
from fingervision.vision.median import middle

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.uint8]

# A run of ground that is narrower is a scratch, and what bounds it must be as wide (pixels).
LEAST_GROUND_PX, LEAST_BESIDE_PX = 3, 5
# From row to row the sides of a channel move by no more than this (a slope of 25 degrees and a pixel of noise).
MOST_STEP_PX = 2
# A channel has so many times the measuring height in rows, and at least so many.
LEAST_HEIGHTS, LEAST_ROWS = 1.5, 14
# Its sides are straight: so much of the rows lie within so many pixels of a line; corners and fillets do not.
ON_LINE_SHARE, ON_LINE_PX = 0.75, 1.2
# A line through one channel passes through another one of the same fingers within this (pixels); sides lean no more.
SAME_LINE_PX, STEEPEST = 2.5, 0.55
# The longest of so many channels are looked at.
MOST_CHANNELS = 6


@dataclass(frozen=True, slots=True, eq=False)
class Channel:
    """The room between two fingers: a line on either side, across = c + m along, at their last pixels.

    Parameters
    ----------
    left_c, left_m, right_c, right_m : float
        The two lines.
    first_row, last_row : int
        Where the channel begins and ends along the fingers, parts that interrupt it included.
    rows : int
        Rows in which it is open.
    """

    left_c: float
    left_m: float
    right_c: float
    right_m: float
    first_row: int
    last_row: int
    rows: int

    def left(self, row: float) -> float:
        """Last pixel of the left finger."""
        return self.left_c + self.left_m * row

    def right(self, row: float) -> float:
        """First pixel of the right finger."""
        return self.right_c + self.right_m * row


def find_channel(upright: Mask, below_tip_px: float) -> Channel | None:
    """The longest channel between two things that are alike in width, or None.

    Parameters
    ----------
    upright : ndarray of uint8, shape (rows, columns)
        Non-zero where the fingers may be, seen with the tips up.
    below_tip_px : float
        Height of measuring below the tips.
    """
    shortest = int(max(LEAST_HEIGHTS * below_tip_px, LEAST_ROWS))
    chains = _chains(upright, shortest)
    lines = [found for chain in chains if (found := _straight(chain)) is not None]
    lines.sort(key=lambda channel: -channel.rows)
    for channel in lines[:MOST_CHANNELS]:
        if not are_alike(*_beside(upright, channel)):
            continue
        same = [other for other in lines if other is channel or _is_same(channel, other)]
        if len(same) == 1:
            return channel
        chosen = np.concatenate([chain for chain in chains if _lies_on(chain, channel)])
        joined = _straight(chosen[np.argsort(chosen[:, 0])])
        if joined is not None:
            return joined
    return None


def _lies_on(chain: Ints, channel: Channel) -> bool:
    row = chain[:, 0].mean()
    return bool(
        abs(chain[:, 1].mean() - channel.left(row)) <= SAME_LINE_PX
        and abs(chain[:, 2].mean() - channel.right(row)) <= SAME_LINE_PX
    )


def _is_same(channel: Channel, other: Channel) -> bool:
    row = 0.5 * (other.first_row + other.last_row)
    return (
        abs(channel.left(row) - other.left(row)) <= SAME_LINE_PX
        and abs(channel.right(row) - other.right(row)) <= SAME_LINE_PX
    )


def _straight(chain: Ints) -> Channel | None:
    """Lines through the two sides of a chain of runs; None where they are not straight."""
    row = chain[:, 0].astype(float)
    fitted = [_line(row, chain[:, side].astype(float)) for side in (1, 2)]
    if any(share < ON_LINE_SHARE or abs(m) > STEEPEST for _, m, share in fitted):
        return None
    (left_c, left_m, _), (right_c, right_m, _) = fitted
    return Channel(left_c, left_m, right_c, right_m, int(chain[:, 0].min()), int(chain[:, 0].max()), len(chain))


@compiled
def _line(t: Floats, v: Floats) -> tuple[float, float, float]:
    """Line v = c + m t by slopes from one half of the rows to the other (Theil, Sen), and the share of rows on it."""
    half = t.size // 2
    m = middle((v[t.size - half :] - v[:half]) / np.maximum(t[t.size - half :] - t[:half], 1.0))
    c = middle(v - m * t)
    on = 0
    for i in range(t.size):
        if abs(v[i] - c - m * t[i]) <= ON_LINE_PX:
            on += 1
    return c, m, on / t.size


def _beside(upright: Mask, channel: Channel) -> tuple[Build, Build]:
    """Breadth of what bounds a channel on its left and on its right."""
    rows = np.linspace(channel.first_row, channel.last_row, 9).astype(int)[1:-1]
    last = upright.shape[1] - 1
    left, right = [], []
    for row in rows:
        a, b = round(channel.left(row)), round(channel.right(row))
        if 0 <= a < b <= last:
            left.append(_run(upright[row], a, -1))
            right.append(_run(upright[row], b, 1))
    widths = [float(np.median(one)) if one else 0.0 for one in (left, right)]
    middle_row = 0.5 * (channel.first_row + channel.last_row)
    cut = (
        channel.left(middle_row) - widths[0] < 0.5,
        channel.right(middle_row) + widths[1] > last - 0.5,
    )
    return Build(widths[0], channel.left_m, cut[0]), Build(widths[1], channel.right_m, cut[1])


@compiled
def _run(line: Mask, start: int, step: int) -> int:
    """Length of what is set from a pixel on; a pixel to either side is forgiven."""
    i = start
    if 0 <= i < line.size and not line[i]:
        i += step
    length = 0
    while 0 <= i < line.size and line[i]:
        length += 1
        i += step
    return length


def _chains(upright: Mask, shortest: int) -> list[Ints]:
    """Chains of runs: (row, last pixel on the left, first pixel on the right), at least so many rows each."""
    runs, previous, length, has_next = _runs(np.ascontiguousarray(upright))
    ends = np.flatnonzero(~has_next & (length >= shortest))
    ends = ends[np.argsort(-length[ends], kind="stable")][: 4 * MOST_CHANNELS]
    return [_chain(runs, previous, int(end), int(length[end])) for end in ends]


@compiled
def _chain(runs: Ints, previous: Ints, end: int, length: int) -> Ints:
    chain = np.empty((length, 3), dtype=np.int64)
    i = end
    for k in range(length):
        chain[k] = runs[i]
        i = previous[i]
    return chain


@compiled
def _runs(upright: Mask) -> tuple[Ints, Ints, Ints, NDArray[np.bool_]]:
    """All bounded runs of ground; the run below that each goes on from, its place in its chain, and which go on."""
    rows, columns = upright.shape
    most = 4096
    runs, previous, length = (
        np.empty((most, 3), dtype=np.int64),
        np.empty(most, dtype=np.int64),
        np.ones(most, dtype=np.int64),
    )
    has_next = np.zeros(most, dtype=np.bool_)
    count, below_first, below_past = 0, 0, 0
    for row in range(rows - 1, -1, -1):
        first = count
        line = upright[row]
        x = 0
        while x < columns and not line[x]:
            x += 1
        start = x
        while x < columns:
            # A run of something that is set, from `start`.
            while x < columns and line[x]:
                x += 1
            bounded, a = x - start, x - 1
            while x < columns and not line[x]:
                x += 1
            start = x
            if x == columns or x - a - 1 < LEAST_GROUND_PX or bounded < LEAST_BESIDE_PX:
                continue
            end = x
            while end < columns and end - x < LEAST_BESIDE_PX and line[end]:
                end += 1
            if end - x < LEAST_BESIDE_PX:
                continue
            if count == most:
                return runs[:count], previous[:count], length[:count], has_next[:count]
            runs[count, 0], runs[count, 1], runs[count, 2] = row, a, x
            previous[count] = -1
            for k in range(below_first, below_past):
                if abs(runs[k, 1] - a) <= MOST_STEP_PX and abs(runs[k, 2] - x) <= MOST_STEP_PX:
                    previous[count], length[count], has_next[k] = k, length[k] + 1, True
            count += 1
        below_first, below_past = first, count
    return runs[:count], previous[:count], length[:count], has_next[:count]
