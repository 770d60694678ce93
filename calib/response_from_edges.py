"""Camera response from the shape of straight edges, because blur spreads a step of light symmetrically.

The optics and the pixels blur the light, and nearly every blur is symmetric. If the blur is symmetric, an edge spread
function in light is antisymmetric about the edge. In the stored levels the edge spread function is not antisymmetric;
the exponent that makes it antisymmetric again is that of the camera. A slanted edge samples its profile at many
positions within a pixel (ISO 12233). Sharpening or smoothing after the transfer curve, or a bevel along the edge, also
changes the profile: the residuals of the fit then exceed the noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.special import ndtr

from calib.camera_response import MeasuredResponse
from calib.correlated_rows import rows_in_one
from calib.edge_spread import CoarseEdge, EdgeRows, fit_edge
from calib.errors import CalibrationError
from calib.response_curve import KNOTS, curve_of
from calib.straight_edges import FINDING_SIDES_PX, StraightEdge, find_straight_edges
from calib.straight_rows import StraightRows

Floats = NDArray[np.float64]
Grey = NDArray[np.uint8] | NDArray[np.uint16]

LEAST_CONTRAST = 0.15
"""Least step of an edge, as a share of full scale; within a smaller step, the curvature of the response is hidden by
noise.
"""
FEWEST_ROWS = 40
"""Least length of an edge in pixels."""
MOST_EDGES, MOST_PIXELS = 12, 3000
"""Most edges, and pixels of each, that are used: enough for 1 % of the exponent in a second of computing time."""
BESIDE_PX = 6
"""Distance from a line, on either side, at which levels are compared to find the lighter side."""
CORNER_PX, CORNER_SHARE = 6.0, 0.1
"""Length left out at either end of an edge, in pixels and as a share of its length, because corners are round."""
PARALLEL = 0.7
"""Cosine of the angle between two edges above which they count as parallel neighbours; others only meet at a corner."""
ROOM_PX = 24.0
"""Distance from an edge within which another edge limits the profile."""
STRAIGHT_PX = 0.15
"""Scatter of an edge about its line above which it does not count as straight: a fifth of the sharpest blur."""
REACH_SIGMAS = 3.5
"""Half length of a profile in standard deviations of the blur, plus two pixels, so that it includes flat plateaus."""
LARGEST_U = 0.3
"""Largest standard uncertainty of the exponent that is accepted: a linear camera (1) can then be distinguished from
consumer cameras (2.2)."""
LARGEST_MISFIT = 2.0
"""Largest ratio of the RMS residual to the noise of the plateaus; a larger ratio means that the profile is not that of
a symmetric blur and a power law.
"""
MOST_OVERSHOOT, OVERSHOOT_BIN_PX = 0.01, 0.5
"""Largest overshoot of a profile, as a share of its step, and bin width in pixels: sharpening that adds 2 % of the step
changes the exponent by 0.1 at a blur of 1.2 px (`tests/calib/test_response_from_pictures.py`)."""
STARTS = (1.0, 2.2)
"""Exponents from which the fit starts: those of usual cameras."""
EXPONENTS = (0.2, 5.0)
"""Bounds of the exponent; film and sensors lie between 0.4 and 3 (Grossberg & Nayar, 2004)."""


@dataclass(frozen=True, slots=True, eq=False)
class _Profile:
    """Pixels across one edge: distance towards its light side (px), level (share of full scale), starting values."""

    away_px: Floats
    level: Floats
    sigma_px: float
    ends: tuple[float, float]
    noise: float


def response_from_edges(pictures: Sequence[Grey], top_level: int, name: str) -> MeasuredResponse:
    """Fit a camera response as a power law.

    Parameters
    ----------
    pictures : sequence of ndarray, each of shape (height, width)
        Sharp pictures of straight, plain edges: a bar, a knife edge, the fingers themselves.
    top_level : int
        Full scale of the pictures.
    name : str
        Name of the response.

    Raises
    ------
    CalibrationError
        If there is no straight edge of sufficient contrast, the edges do not determine the exponent, or no power law
        explains the profiles.
    """
    profiles = [profile for grey in pictures for profile in _profiles(grey, top_level)]
    if not profiles:
        raise CalibrationError(
            f"The pictures must show straight edges of at least {FEWEST_ROWS} pixels with a step of "
            f"{LEAST_CONTRAST:.0%} of full scale and no clipped side, but show none: take a picture of a bar in good "
            "light."
        )
    overshoot = float(np.median([_overshoot(profile) for profile in profiles]))
    if overshoot > MOST_OVERSHOOT:
        raise CalibrationError(
            f"The edges must pass from one plateau to the other without overshoot, but overshoot by {overshoot:.1%} "
            "of their step, because the camera sharpens: switch sharpening off, or take an exposure series."
        )
    # Exponent and blur are correlated, so that the sum of squares may have several minima; the fit starts at several
    # exponents.
    tried = [
        least_squares(_left, _start(profiles, at), args=(profiles,), x_scale="jac", bounds=_bounds(profiles))
        for at in STARTS
    ]
    solved = min(tried, key=lambda one: float(one.cost))
    exponent = float(np.exp(solved.x[0]))
    used = sum(profile.level.size for profile in profiles)
    misfit = float(np.sqrt(2.0 * solved.cost / max(used - solved.x.size, 1)))
    covariance = np.linalg.pinv(solved.jac.T @ solved.jac)
    # A codec or a noise filter correlates the noise of neighbouring pixels.
    shared = rows_in_one(solved.fun[: profiles[0].level.size])
    u_exponent = exponent * float(np.sqrt(shared * covariance[0, 0])) * max(misfit, 1.0)
    if misfit > LARGEST_MISFIT:
        raise CalibrationError(
            f"The edges' profiles must be those of a symmetric blur and a power law, but the residuals are "
            f"{misfit:.1f} times the noise, because the camera sharpens, or the edges are bevelled or shaded: take an "
            "exposure series."
        )
    if u_exponent > LARGEST_U:
        raise CalibrationError(
            f"The edges must determine the exponent to within {LARGEST_U:g}, but give {exponent:.2f} with a standard "
            f"uncertainty of {u_exponent:.2f}: take more edges with more contrast, or an exposure series."
        )
    levels = np.concatenate([profile.level for profile in profiles])
    curve = curve_of(exponent, np.zeros(KNOTS), top_level, name)
    rms = float(np.sqrt(np.mean(solved.fun**2 * _noise_of(profiles) ** 2)))
    return MeasuredResponse(curve, exponent, rms, (float(levels.min()), float(levels.max())), u_exponent)


def _overshoot(profile: _Profile) -> float:
    """Overshoot of the mean profile beyond its plateaus, on either side, minus its noise, as a share of the step."""
    bins = np.floor(profile.away_px / OVERSHOOT_BIN_PX).astype(int)
    bins -= bins.min()
    count = np.bincount(bins)
    mean = np.bincount(bins, profile.level) / np.maximum(count, 1)
    mean, own = mean[count >= 8], profile.noise / np.sqrt(count[count >= 8])
    beyond = np.maximum(mean - profile.ends[1], profile.ends[0] - mean) - 3.0 * own
    return float(max(beyond.max(), 0.0) / (profile.ends[1] - profile.ends[0]))


def _profiles(grey: Grey, top_level: int) -> list[_Profile]:
    found = [edge for edge in find_straight_edges(grey, FINDING_SIDES_PX[0]) if edge.length_px >= FEWEST_ROWS]
    profiles: list[_Profile] = []
    for edge in found[: 2 * MOST_EDGES]:
        others = [other for other in found if other is not edge and abs(other.direction @ edge.direction) > PARALLEL]
        room = min([ROOM_PX, *(_apart_px(edge, other) / 2.0 for other in others)])
        try:
            profile = _profile(grey, edge, room, top_level)
        except CalibrationError:
            continue
        if profile is not None:
            profiles.append(profile)
    return profiles[:MOST_EDGES]


def _apart_px(edge: StraightEdge, other: StraightEdge) -> float:
    """Smallest distance (px) of another edge's ends and centre from the line of an edge, if the two overlap."""
    points = np.vstack([other.ends, other.ends.mean(axis=0)])
    along = (points - edge.ends[0]) @ edge.direction
    beside = np.abs((points - edge.ends[0]) @ edge.to_dark)
    near = (along > -ROOM_PX) & (along < edge.length_px + ROOM_PX)
    return float(beside[near].min()) if near.any() else np.inf


def _profile(grey: Grey, edge: StraightEdge, room_px: float, top_level: int) -> _Profile | None:
    levels, ends = grey.astype(np.float64) / top_level, edge.ends
    if abs(edge.direction[0]) > abs(edge.direction[1]):
        # Profiles are taken along rows; edges parallel to the rows are measured in the transposed picture.
        levels, ends = levels.T, ends[:, ::-1]
    slope = float((ends[1, 0] - ends[0, 0]) / (ends[1, 1] - ends[0, 1]))
    start = float(ends[0, 0] - slope * ends[0, 1])
    corner = max(CORNER_PX, CORNER_SHARE * edge.length_px)
    rows = np.arange(int(np.ceil(ends[:, 1].min() + corner)), int(ends[:, 1].max() - corner))
    if rows.size < FEWEST_ROWS:
        return None
    sides = [
        levels[rows, np.clip(np.rint(start + slope * rows).astype(int) + way, 0, levels.shape[1] - 1)]
        for way in (-6, 6)
    ]
    rising = bool(np.median(sides[1]) > np.median(sides[0]))
    fitted = fit_edge(levels, rows, CoarseEdge(start, slope, rising), room_px)
    line = StraightRows.through(fitted)
    if fitted.clipped or _scatter(fitted, line) > STRAIGHT_PX:
        return None
    return _gathered(levels, fitted, line, rising, room_px)


def _scatter(fitted: EdgeRows, line: StraightRows) -> float:
    off = fitted.x_px - line.at_px - line.slope * (fitted.rows - line.middle_row)
    # The scatter caused by the noise of single rows is subtracted.
    return float(np.sqrt(max(1.4826 * float(np.median(np.abs(off))) ** 2 - float(np.median(fitted.u_x_px)) ** 2, 0.0)))


def _gathered(levels: Floats, fitted: EdgeRows, line: StraightRows, rising: bool, room_px: float) -> _Profile | None:
    cosine = 1.0 / np.hypot(1.0, line.slope)
    reach = int(min(room_px, np.ceil((REACH_SIGMAS * fitted.sigma_px + 2.0) / cosine)))
    rows = fitted.rows[:: max(1, fitted.rows.size * (2 * reach + 1) // MOST_PIXELS)]
    middle = line.at_px + line.slope * (rows - line.middle_row)
    columns = np.rint(middle).astype(int)[:, None] + np.arange(-reach, reach + 1)
    inside = (columns[:, 0] >= 0) & (columns[:, -1] < levels.shape[1])
    if np.count_nonzero(inside) < FEWEST_ROWS // 2:
        return None
    away = (columns[inside] - middle[inside, None]) * cosine * (1.0 if rising else -1.0)
    level = levels[rows[inside, None], columns[inside]]
    far = np.abs(away) > 0.75 * reach * cosine
    ends = [float(np.median(level[far & side])) for side in (away < 0.0, away > 0.0)]
    clipped = ends[0] < 0.01 or ends[1] > 0.99
    if clipped or ends[1] - ends[0] < LEAST_CONTRAST:
        return None
    plateau = level[far] - np.where(away[far] < 0.0, ends[0], ends[1])
    # The standard deviation is used, because the median deviation of whole-numbered levels would be zero or one;
    # rounding gives the least noise.
    noise = max(float(np.std(plateau)), 1.0 / (255.0 * np.sqrt(12.0)))
    return _Profile(away.ravel(), level.ravel(), fitted.sigma_px, (ends[0], ends[1]), noise)


# Numbers of unknowns. Common to all edges: ln exponent, ln sigma of the blur, share and ln width of its wider part. For
# each edge: position, light of both plateaus as levels, and slope of the light.
_SHARED, _OWN = 4, 4


def _start(profiles: Sequence[_Profile], exponent: float) -> Floats:
    sigma = float(np.median([profile.sigma_px for profile in profiles]))
    shared = [np.log(exponent), np.log(max(sigma, 0.2)), 0.1, np.log(2.0)]
    return np.array(shared + [value for p in profiles for value in (0.0, *p.ends, 0.0)])


def _bounds(profiles: Sequence[_Profile]) -> tuple[Floats, Floats]:
    low = [np.log(EXPONENTS[0]), np.log(0.05), 0.0, np.log(1.2)] + [-3.0, 1e-3, 1e-3, -0.1] * len(profiles)
    high = [np.log(EXPONENTS[1]), np.log(12.0), 0.5, np.log(6.0)] + [3.0, 1.2, 1.2, 0.1] * len(profiles)
    return np.array(low), np.array(high)


def _noise_of(profiles: Sequence[_Profile]) -> Floats:
    return np.concatenate([np.full(profile.level.size, profile.noise) for profile in profiles])


def _left(unknowns: Floats, profiles: Sequence[_Profile]) -> Floats:
    """Residuals of all pixels divided by their noise; shape (pixels,)."""
    exponent, sigma = float(np.exp(unknowns[0])), float(np.exp(unknowns[1]))
    wide, ratio = float(unknowns[2]), float(np.exp(unknowns[3]))
    out = []
    for k, profile in enumerate(profiles):
        at_px, dark, light, slope = unknowns[_SHARED + _OWN * k : _SHARED + _OWN * (k + 1)]
        # The width of the pixel is included as the variance of a uniform distribution of width 1.
        narrow_px = np.hypot(sigma, 1.0 / np.sqrt(12.0))
        away = profile.away_px - at_px
        share = (1.0 - wide) * ndtr(away / narrow_px) + wide * ndtr(away / (ratio * narrow_px))
        seen = dark**exponent + (light**exponent - dark**exponent) * share + slope * away
        out.append((np.maximum(seen, 1e-9) ** (1.0 / exponent) - profile.level) / profile.noise)
    return np.concatenate(out)
