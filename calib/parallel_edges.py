"""Width between two parallel straight edges, with sub-pixel accuracy and uncertainty."""

from dataclasses import dataclass, replace
from math import atan, cos, hypot, sin

import numpy as np
from numpy.typing import NDArray

from calib.edge_spread import CoarseEdge, EdgeRows, fit_edge
from calib.errors import CalibrationError
from calib.straight_rows import FEWEST_ROWS, OUTLIER_SIGMAS, StraightRows

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Smallest contrast of a row as a share of the median, and largest residual as a multiple of the median; other rows are
# excluded, because they show dust.
LEAST_CONTRAST, LARGEST_MISFIT = 0.6, 2.5
# Largest distance of a row from the line (pixels, in addition to its noise) when rows are collected; other rows show a
# corner or a drop.
FARTHEST_PX = 0.5
# Largest interruption of a sequence of valid rows, as a share of its length.
LARGEST_BREAK = 0.15
# Distance from the end of an edge, as a multiple of the blur, within which rows are excluded because of the corner.
CORNER_BLURS = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class ParallelEdges:
    """Two parallel straight edges.

    Coordinates are pixels of the full picture; the centre of its first pixel is (0, 0).

    Parameters
    ----------
    width_px : float
        Distance of the edges, perpendicular to them, at the middle of the rows used.
    u_width_px : float
        Standard uncertainty from the scatter of the rows, correlation between rows included.
    points_px : ndarray, shape (2, 2)
        End points of that width; indices: point, x or y.
    light : bool
        True if the area between the edges is light.
    profiles : str
        "rows" for edges measured in rows of pixels, "columns" for edges measured in columns.
    first, last, count : int
        First and last row (column) used, and their number on the edge with fewer rows.
    taper, u_taper : float
        Change of the width per row (column), and its standard uncertainty.
    blur_px, contrast : float
        Blur of the edges, and their step in grey levels.
    clipped : bool
        Whether the sensor's full scale clips a flank.
    edges_px : tuple of ndarray, each of shape (n, 2)
        Every measured point of the two edges.
    residuals_px : tuple of ndarray, each of shape (n,)
        Distances of the measured points from the fitted line, perpendicular to it.
    """

    width_px: float
    u_width_px: float
    points_px: Floats
    light: bool
    profiles: str
    first: int
    last: int
    count: int
    taper: float
    u_taper: float
    blur_px: float
    contrast: float
    clipped: bool
    edges_px: tuple[Floats, Floats]
    residuals_px: tuple[Floats, Floats]

    @property
    def middle_px(self) -> Floats:
        """Centre between the edges, shape (2,)."""
        return np.asarray(self.points_px.mean(axis=0))

    @property
    def length_px(self) -> float:
        """Length of the shorter edge (pixels)."""
        return min(float(np.linalg.norm(edge[-1] - edge[0])) for edge in self.edges_px)

    def moved(self, x_px: int, y_px: int) -> "ParallelEdges":
        """Convert the edges from coordinates of a region that starts at (x, y) to those of the picture."""
        offset = np.array([x_px, y_px], dtype=np.float64)
        rows = y_px if self.profiles == "rows" else x_px
        return replace(
            self,
            points_px=self.points_px + offset,
            edges_px=(self.edges_px[0] + offset, self.edges_px[1] + offset),
            first=self.first + rows,
            last=self.last + rows,
        )

    def words(self) -> str:
        """Description of the pair and its position, for a user who has to choose between pairs."""
        x, y = self.middle_px
        return f"{self.width_px:.1f} px {'light' if self.light else 'dark'} at ({x:.0f}, {y:.0f})"


def measure_parallel_edges(grey: Floats, lines: tuple[Floats, Floats], light: bool) -> ParallelEdges:
    """Measure the width between two edges whose positions are known to a pixel or two.

    Parameters
    ----------
    grey : ndarray, shape (height, width)
        Original grey levels.
    lines : tuple of ndarray, each of shape (2, 2)
        Two points (x, y) on each edge.
    light : bool
        Whether the area between the edges is light.

    Raises
    ------
    CalibrationError
        If the edges are not straight, too short, or too near to other structures.
    """
    along = lines[0][1] - lines[0][0]
    if abs(along[0]) > abs(along[1]):
        # Profiles are taken along rows; edges parallel to the rows are measured in the transposed picture.
        upright = measure_parallel_edges(grey.T, (lines[0][:, ::-1], lines[1][:, ::-1]), light)
        return replace(
            upright,
            points_px=upright.points_px[:, ::-1].copy(),
            edges_px=(upright.edges_px[0][:, ::-1].copy(), upright.edges_px[1][:, ::-1].copy()),
            profiles="columns",
        )
    middle = np.array([np.mean([line[:, 1] for line in lines])])
    slopes = [float((line[1, 0] - line[0, 0]) / (line[1, 1] - line[0, 1])) for line in lines]
    starts = [float(line[0, 0] - slope * line[0, 1]) for line, slope in zip(lines, slopes, strict=True)]
    at_middle = [start + slope * float(middle[0]) for start, slope in zip(starts, slopes, strict=True)]
    left, right = (0, 1) if at_middle[0] < at_middle[1] else (1, 0)
    room_px = (at_middle[right] - at_middle[left]) / 2.0
    left_edge = _gather(grey, CoarseEdge(starts[left], slopes[left], rising=light), lines[left], room_px)
    right_edge = _gather(grey, CoarseEdge(starts[right], slopes[right], rising=not light), lines[right], room_px)
    return _across(left_edge, right_edge, light)


def _gather(grey: Floats, coarse: CoarseEdge, line: Floats, room_px: float) -> EdgeRows:
    """Fit rows in which the edge is visible, outwards from the coarse line as far as the edge stays straight."""
    rows = np.arange(max(0, int(np.ceil(line[:, 1].min()))), min(grey.shape[0] - 1, int(line[:, 1].max())) + 1)
    # The first fit excludes the ends, where corners are; the second fit uses the resulting line in all rows.
    inner = rows[rows.size // 8 : rows.size - rows.size // 8]
    first = fit_edge(grey, inner, coarse, room_px)
    seed = StraightRows.through(first)
    better = CoarseEdge(seed.at_px - seed.slope * seed.middle_row, seed.slope, coarse.rising)
    everywhere = np.arange(grey.shape[0])
    x = better.x_px(everywhere)
    edge = fit_edge(grey, everywhere[(x > 0) & (x < grey.shape[1] - 1)], better, room_px, known=first)
    sound = edge.contrast > LEAST_CONTRAST * float(np.median(first.contrast))
    sound &= edge.unexplained < LARGEST_MISFIT * max(float(np.median(first.unexplained)), 0.3)
    sound &= np.abs(edge.x_px - better.x_px(edge.rows)) < FARTHEST_PX + OUTLIER_SIGMAS * edge.u_x_px
    keep = _one_run(edge.rows, sound, int(np.median(seed.rows)), CORNER_BLURS * edge.blur_px, grey.shape[0])
    if np.count_nonzero(keep) < FEWEST_ROWS:
        raise CalibrationError(
            "An edge must be straight and sharp over at least ten rows of pixels, but is not: "
            "check the picture, its light and its focus."
        )
    return fit_edge(grey, edge.rows[keep], better, room_px)


def _one_run(rows: Ints, sound: NDArray[np.bool_], seed: int, corner_px: float, height: int) -> NDArray[np.bool_]:
    """Valid rows around `seed`, extended over short interruptions, without the corners at the ends."""
    good = rows[sound]
    if good.size == 0:
        return sound
    breaks = np.flatnonzero(np.diff(good) > max(5.0, LARGEST_BREAK * good.size))
    run = min(np.split(good, breaks + 1), key=lambda part: (not part[0] <= seed <= part[-1], -part.size))
    low = int(run[0]) + (0 if run[0] <= 1 else int(np.ceil(corner_px)))
    high = int(run[-1]) - (0 if run[-1] >= height - 2 else int(np.ceil(corner_px)))
    return np.asarray(sound & (rows >= low) & (rows <= high))


def _across(left: EdgeRows, right: EdgeRows, light: bool) -> ParallelEdges:
    lines = [StraightRows.through(edge) for edge in (left, right)]
    # The common direction is the mean of both edges' directions, weighted by their uncertainties.
    weights = np.array([1.0 / line.u_slope**2 for line in lines])
    slope = float(np.average([line.slope for line in lines], weights=weights))
    turn = atan(slope)
    rows_apart = lines[1].middle_row - lines[0].middle_row
    apart = lines[1].at_px - lines[0].at_px - slope * rows_apart
    width = apart * cos(turn)
    by_slope = -rows_apart * cos(turn) - apart * sin(turn) * cos(turn) ** 2
    across = np.array([cos(turn), -sin(turn)])
    middle = np.mean([[line.at_px, line.middle_row] for line in lines], axis=0)
    rows = np.concatenate([line.rows for line in lines])
    return ParallelEdges(
        width_px=width,
        u_width_px=hypot(cos(turn) * hypot(lines[0].u_at_px, lines[1].u_at_px), by_slope / np.sqrt(weights.sum())),
        points_px=np.array([middle - across * width / 2, middle + across * width / 2]),
        light=light,
        profiles="rows",
        first=int(rows.min()),
        last=int(rows.max()),
        count=min(line.rows.size for line in lines),
        taper=(lines[1].slope - lines[0].slope) * cos(turn),
        u_taper=hypot(lines[0].u_slope, lines[1].u_slope),
        blur_px=(left.blur_px + right.blur_px) / 2.0,
        contrast=float(min(np.median(left.contrast), np.median(right.contrast))),
        clipped=left.clipped or right.clipped,
        edges_px=(lines[0].points_px, lines[1].points_px),
        residuals_px=(lines[0].residual_px * cos(turn), lines[1].residual_px * cos(turn)),
    )
