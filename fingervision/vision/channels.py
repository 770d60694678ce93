"""Find the background channel between two straight sides: the space between the fingers that no part fills.

With the tips up, each row of a binary picture has runs of background pixels between runs of finger or part pixels.
Background runs in successive rows form a channel if their ends differ by hardly a pixel. A gripper that holds a part
shows a channel above the part, a channel below it, or both, between the same two straight lines.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.likeness import Build, are_alike

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.uint8]

# Least width (pixels) of a run of background, as narrower runs are scratches, and of the objects on both of its sides.
LEAST_GROUND_PX, LEAST_BESIDE_PX = 3, 5
# Largest displacement of a channel's sides from row to row: a slope of 25 degrees, and one pixel of noise.
MOST_STEP_PX = 2
# Least number of rows of a channel, as a multiple of the measuring height (in pixels), and absolutely.
LEAST_HEIGHTS, LEAST_ROWS = 1.5, 14
# Least share of a channel's rows whose sides lie within this distance (pixels) of a straight line; corners and fillets
# do not.
ON_LINE_SHARE, ON_LINE_PX = 0.75, 1.2
# Largest distance (pixels) of a second channel of the same fingers from the line through the first, and largest slope
# of the sides.
SAME_LINE_PX, STEEPEST = 2.5, 0.55
# Largest number of channels that are examined, the longest first.
MOST_CHANNELS = 6
# Largest number of background runs that are examined; a picture with more runs shows texture.
MOST_RUNS = 4096

_lines = loop("channels_lines")
_beside_lines = loop("channels_beside")
_follow_chain = loop("channels_chain")
_find_runs = loop("channels_runs")


@dataclass(frozen=True, slots=True, eq=False)
class Channel:
    """Background between two fingers, bounded on either side by a straight line: column = c + m row.

    The left line runs through the last pixels of the left finger, the right line through the first pixels of the right
    finger.

    Parameters
    ----------
    left_c, left_m, right_c, right_m : float
        Coefficients c and m of the left and of the right line.
    first_row, last_row : int
        First and last row of the channel, including rows where a part interrupts it.
    rows : int
        Number of rows in which the channel is open.
    """

    left_c: float
    left_m: float
    right_c: float
    right_m: float
    first_row: int
    last_row: int
    rows: int

    def left(self, row: float) -> float:
        """Column of the left finger's last pixel in a row."""
        return self.left_c + self.left_m * row

    def right(self, row: float) -> float:
        """Column of the right finger's first pixel in a row."""
        return self.right_c + self.right_m * row


def find_channel(upright: Mask, below_tip_px: float) -> Channel | None:
    """Find the longest channel between two objects of similar width; return None if there is none.

    Parameters
    ----------
    upright : ndarray of uint8, shape (rows, columns)
        Non-zero where the fingers may be; turned so that the tips point up.
    below_tip_px : float
        Distance of the measuring point below the tip.
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
    row, left, right = chain.mean(axis=0).tolist()
    return bool(abs(left - channel.left(row)) <= SAME_LINE_PX and abs(right - channel.right(row)) <= SAME_LINE_PX)


def _is_same(channel: Channel, other: Channel) -> bool:
    row = 0.5 * (other.first_row + other.last_row)
    return (
        abs(channel.left(row) - other.left(row)) <= SAME_LINE_PX
        and abs(channel.right(row) - other.right(row)) <= SAME_LINE_PX
    )


def _straight(chain: Ints) -> Channel | None:
    """Fit straight lines to the two sides of a chain of runs; return None if the sides are not straight."""
    left_c, left_m, left_share, right_c, right_m, right_share, first_row, last_row = _lines(chain)
    if min(left_share, right_share) < ON_LINE_SHARE or max(abs(left_m), abs(right_m)) > STEEPEST:
        return None
    return Channel(left_c, left_m, right_c, right_m, first_row, last_row, len(chain))


def _beside(upright: Mask, channel: Channel) -> tuple[Build, Build]:
    """Widths of the objects to the left and to the right of a channel (pixels)."""
    sides = (channel.left_c, channel.left_m, channel.right_c, channel.right_m)
    widths = _beside_lines(upright, *sides, channel.first_row, channel.last_row)
    last = upright.shape[1] - 1
    middle_row = 0.5 * (channel.first_row + channel.last_row)
    cut = (
        channel.left(middle_row) - widths[0] < 0.5,
        channel.right(middle_row) + widths[1] > last - 0.5,
    )
    return Build(widths[0], channel.left_m, cut[0]), Build(widths[1], channel.right_m, cut[1])


def _chains(upright: Mask, shortest: int) -> list[Ints]:
    """Chains of runs with at least `shortest` rows: (row, last pixel on the left, first pixel on the right)."""
    runs, previous, length, has_next = _runs(np.ascontiguousarray(upright))
    ends = np.flatnonzero(~has_next & (length >= shortest))
    ends = ends[np.argsort(-length[ends], kind="stable")][: 4 * MOST_CHANNELS]
    return [_chain(runs, previous, int(end), int(length[end])) for end in ends]


def _chain(runs: Ints, previous: Ints, end: int, length: int) -> Ints:
    chain = np.empty((length, 3), dtype=np.int64)
    _follow_chain(runs, previous, end, chain)
    return chain


def _runs(upright: Mask) -> tuple[Ints, Ints, Ints, NDArray[np.bool_]]:
    """All runs of background between objects, linked into chains from row to row."""
    runs, has_next = np.empty((MOST_RUNS, 3), dtype=np.int64), np.empty(MOST_RUNS, dtype=np.bool_)
    previous, length = np.empty((2, MOST_RUNS), dtype=np.int64)
    count = _find_runs(upright, runs, previous, length, has_next)
    return runs[:count], previous[:count], length[:count], has_next[:count]
