"""Camera response from the shape of straight edges in pictures, because blur spreads a step of light symmetrically.

A slanted edge samples its profile at many positions within a pixel (ISO 12233). The families of tone curves are those
of `edge_response`. Sharpening or smoothing after the transfer curve, or a bevel along the edge, also changes the
profile: the residuals of the fit then exceed the noise.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from calib.camera_response import CameraResponse, MeasuredResponse
from calib.edge_profile import EdgeProfile, binned_profile
from calib.edge_response import ResponsePosterior, fit_families
from calib.edge_spread import CoarseEdge, EdgeRows, fit_edge
from calib.errors import CalibrationError
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
MOST_EDGES, MOST_PIXELS = 12, 20_000
"""Most edges, and pixels of each, that are used: enough for 1 % of the exponent."""
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
MODEL_ERROR = 0.001
"""Standard deviation of a profile about the best model, as a share of its contrast, for pictures without loss."""
LARGEST_MISFIT = 2.0
"""Largest ratio of the residuals to their uncertainty; a larger ratio means that the profile is not that of a symmetric
blur and a usual tone curve.
"""
MOST_OVERSHOOT = 0.01
"""Largest overshoot of a profile, as a share of its step: sharpening that adds 2 % of the step changes the exponent by
0.1 at a blur of 1.2 px (`tests/calib/test_response_from_pictures.py`)."""


EXPONENTS = (0.2, 5.0)
"""Bounds of the exponent; film and sensors lie between 0.4 and 3 (Grossberg & Nayar, 2004)."""


def response_from_edges(pictures: Sequence[Grey], top_level: int, name: str) -> MeasuredResponse:
    """Estimate a camera response from the shape of edges.

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
        If there is no straight edge of sufficient contrast, the edges do not determine the response, or no family of
        tone curves explains the profiles.
    """
    profiles = [profile for grey in pictures for profile in edge_profiles(grey, top_level)]
    if not profiles:
        raise CalibrationError(
            f"The pictures must show straight edges of at least {FEWEST_ROWS} pixels with a step of "
            f"{LEAST_CONTRAST:.0%} of full scale and no clipped side, but show none: take a picture of a bar in good "
            "light."
        )
    overshoot = float(np.median([profile.overshoot for profile in profiles]))
    if overshoot > MOST_OVERSHOOT:
        raise CalibrationError(
            f"The edges must pass from one plateau to the other without overshoot, but overshoot by {overshoot:.1%} "
            "of their step, because the camera sharpens: switch sharpening off, or take an exposure series."
        )
    fits = fit_families(profiles, MODEL_ERROR)
    misfit = float(np.sqrt(np.mean(fits[0].misfit)))
    if misfit > LARGEST_MISFIT:
        raise CalibrationError(
            f"The edges' profiles must be those of a symmetric blur and a usual tone curve, but the residuals are "
            f"{misfit:.1f} times the noise, because the camera sharpens, or the edges are bevelled or shaded: take an "
            "exposure series."
        )
    if misfit > 1.0:
        fits = fit_families(profiles, MODEL_ERROR, misfit)
    found = ResponsePosterior.of(fits)
    covered = min(profile.ends[0] for profile in profiles), max(profile.ends[1] for profile in profiles)
    exponent = _exponent(found.curve, covered)
    # No camera follows a standard curve exactly: the exponent is as uncertain as that of a free power law.
    free = next(fit for fit in fits if fit.family.name == "power")
    variance = sum(weight * (_exponent(other, covered) - exponent) ** 2 for other, weight in found.others)
    u_exponent = float(np.sqrt(max(variance, exponent**2 * free.covariance[0, 0])))
    if not u_exponent <= LARGEST_U:
        raise CalibrationError(
            f"The edges must determine the exponent to within {LARGEST_U:g}, but give {exponent:.2f} with a standard "
            f"uncertainty of {u_exponent:.2f}: take more edges with more contrast, or an exposure series."
        )
    curve = CameraResponse(name, found.curve.level, found.curve.light, top_level)
    return MeasuredResponse(curve, exponent, fits[0].rms_level, covered, u_exponent)


def _exponent(response: CameraResponse, covered: tuple[float, float]) -> float:
    """Exponent of the power law that bends like a response between the plateaus, where light and level are known.

    The bend is the level at which the light is half-way between the plateaus, since it displaces an edge.
    """
    dark, light = np.interp(covered, response.level, response.light)
    half = float(np.interp(0.5 * (dark + light), response.light, response.level))

    def excess(exponent: float) -> float:
        ends = covered[0] ** exponent, covered[1] ** exponent
        return float((0.5 * (ends[0] + ends[1])) ** (1.0 / exponent) - half)

    return float(brentq(excess, *EXPONENTS)) if excess(EXPONENTS[0]) * excess(EXPONENTS[1]) < 0.0 else np.nan


def edge_profiles(grey: Grey, top_level: int) -> list[EdgeProfile]:
    """Profiles of the straight, unclipped edges in a picture, at most `MOST_EDGES`."""
    found = [edge for edge in find_straight_edges(grey, FINDING_SIDES_PX[0]) if edge.length_px >= FEWEST_ROWS]
    profiles: list[EdgeProfile] = []
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


def _profile(grey: Grey, edge: StraightEdge, room_px: float, top_level: int) -> EdgeProfile | None:
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
    return _gathered(levels, fitted, line, rising, room_px, 1.0 / top_level)


def _scatter(fitted: EdgeRows, line: StraightRows) -> float:
    off = fitted.x_px - line.at_px - line.slope * (fitted.rows - line.middle_row)
    # The scatter caused by the noise of single rows is subtracted.
    return float(np.sqrt(max(1.4826 * float(np.median(np.abs(off))) ** 2 - float(np.median(fitted.u_x_px)) ** 2, 0.0)))


def _gathered(
    levels: Floats, fitted: EdgeRows, line: StraightRows, rising: bool, room_px: float, rounding: float
) -> EdgeProfile | None:
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
    side = 1.0 if rising else -1.0
    return binned_profile(away.ravel(), level.ravel(), np.zeros(away.size, dtype=np.intp), rounding, side)
