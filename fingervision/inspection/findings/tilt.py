"""Tilt: a camera rotated relative to the fingers, about its optical axis or out of the plane."""

from math import atan, cos, degrees, hypot, radians, sqrt
from typing import NamedTuple

import numpy as np

from calib.limits import Limits, rectangular
from calib.measured_scale import Calibration
from fingervision.inspection.finding import Finding, weighed, without
from fingervision.inspection.look import Look
from fingervision.inspection.sample import Sample
from fingervision.vision.profile_lines import INNER, ROWS

TURN = "Rotate the camera about its optical axis until the fingers are parallel to the picture's border."
SQUARE = "Set the camera perpendicular to the plane of the fingers: two equal fingers then appear equally wide."
FORMULA = (
    "sqrt(t^2 + k^2 + f^2); t = gap minus the gap measured perpendicular to the inner edges; k = R |cos(a) - cos(b)|, "
    "the shift of a measuring point on a round corner of radius R, with the slants a and b of the two edges at the "
    "measuring points; f = gap (1 - cos(theta)), sin(theta) = Z ln(r) / (2 d), with the ratio r of the fingers' "
    "widths, their distance d, and the camera's distance Z"
)
# A rotation whose cost is within this number of standard uncertainties of the gap is noise.
NOISE_SIGMAS = 2.0
# Below this rotation (degrees), a difference between the fingers' corners is not caused by the rotation.
LEAST_TURN_DEG = 1.0
# A width ratio that would need a larger tilt (degrees) means that the fingers differ; a ratio within this number of
# standard uncertainties of 1 is noise.
LARGEST_DEG, SIGMAS = 30.0, 4.0
# Smallest number of rows of a flank from which width and slope are computed.
FEWEST_ROWS = 6
# Number of neighbouring rows of a flank that share an error, on a background with a pattern.
ALIKE = 3.0


def find(sample: Sample) -> Finding | None:
    """Estimate the rotation in the plane from the inner edges, and the tilt from the fingers' widths."""
    if not sample.looks:
        return None
    turns = [turn_deg(look) for look in sample.looks]
    below_px = sample.settings.below_tip_px
    turn_px = sample.median(
        hypot(_slant_px(look, turn), corner_px(look, below_px) if abs(turn) > LEAST_TURN_DEG else 0.0)
        for look, turn in zip(sample.looks, turns, strict=True)
    )
    # Directions and slants have at least the uncertainty of the gap.
    turn_px = without(turn_px, NOISE_SIGMAS * sample.median(look.outcome.u_gap_px for look in sample.looks))
    turn = sample.median(turns)
    tilt = tilt_deg(sample)
    gap_px = sample.median(look.outcome.gap_px for look in sample.looks)
    tilt_px = 0.0 if tilt is None else gap_px * (1.0 - cos(radians(tilt)))
    figure = f"The fingers are rotated by {turn:+.1f} degrees in the picture"
    figure += "" if tilt is None else f"; if both fingers are equally wide, the camera is tilted by {tilt:.0f} degrees"
    remedy = TURN if turn_px >= tilt_px else SQUARE
    return weighed(sample, "tilt", hypot(turn_px, tilt_px), f"{figure}.", remedy, FORMULA)


def turn_deg(look: Look) -> float:
    """Mean direction of the two inner flanks relative to the picture's axis (degrees).

    If the fingers spread symmetrically, their directions cancel in the mean.
    """
    slopes = []
    for side in range(2):
        real = np.flatnonzero(look.edges.lines.weight[side, :INNER] > 0)
        rows = real[real.size // 3 :]
        if rows.size < FEWEST_ROWS:
            return 0.0
        slopes.append(float(np.polyfit(look.edges.lines.fixed[side, rows], look.edges.position[side, rows], 1)[0]))
    return degrees(atan(0.5 * (slopes[0] + slopes[1])))


def _slant_px(look: Look, turn: float) -> float:
    """Distance of the two measuring points minus the gap perpendicular to the rotated edges (pixels)."""
    m = look.outcome
    dx, dy = m.right.x_px - m.left.x_px, m.right.y_px - m.left.y_px
    across, along = (dx, dy) if m.direction.is_vertical else (dy, dx)
    if look.fingers.orientation.is_flipped:
        along = -along
    slope = np.tan(radians(turn))
    return float(abs(m.gap_px - abs(across - slope * along) / hypot(1.0, slope)))


def corner_px(look: Look, below_px: float) -> float:
    """Displacement of one measuring point along a round corner because the camera is rotated (pixels).

    In a rotated picture, the highest point of one finger is its outer corner, so that its inner edge is measured higher
    up on the fillet. The highest point of the other finger is its inner corner. On a fillet of radius R, the point with
    slope m is at the depth R (1 - m / sqrt(1 + m^2)) below the top and at the distance R (1 - 1 / sqrt(1 + m^2)) inside
    the flank. The depth below the top equals the measuring height for the finger with the inner corner on top, which
    gives R; the distance inside the flank gives the displacement.
    """
    slopes = sorted(abs(m) for m in (look.outcome.left.slope, look.outcome.right.slope))
    radius_px = below_px / (1.0 - slopes[0] / hypot(1.0, slopes[0]))
    return radius_px * abs(1.0 / hypot(1.0, slopes[0]) - 1.0 / hypot(1.0, slopes[1]))


def tilt_deg(sample: Sample) -> float | None:
    """Angle at which the camera looks from the side, from the ratio of the fingers' widths (degrees).

    The function returns None if the widths are not known.
    """
    ratios, spreads, apart = [], [], []
    for look in sample.looks:
        left, right = (_breadth(look, side) for side in range(2))
        if left is None or right is None:
            return None
        ratios.append(float(np.log(left.px / right.px)))
        spreads.append(hypot(left.u_px / left.px, right.u_px / right.px))
        apart.append(abs(right.at_px - left.at_px))
    middle, u_middle = float(np.median(ratios)), float(np.median(spreads))
    if abs(middle) < SIGMAS * u_middle or sample.scale is None:
        return None
    limits = sample.scale.limits if isinstance(sample.scale, Calibration) else Limits()
    distance_px = limits.camera_distance_mm * sample.scale.px_per_mm
    # Across the fingers, lengths in the picture of a tilted plane are proportional to 1 / z^2 (z: distance from the
    # camera), because nearer parts are magnified more and seen less obliquely.
    # As for the other findings, the part that noise explains is taken off.
    sine = 0.5 * without(abs(middle), SIGMAS * u_middle) * distance_px / float(np.median(apart))
    return degrees(np.arcsin(sine)) if sine < np.sin(radians(LARGEST_DEG)) else None


class _Breadth(NamedTuple):
    """Width of a finger (pixels), its standard uncertainty, and the position of its centre across the fingers."""

    px: float
    u_px: float
    at_px: float


def _breadth(look: Look, side: int) -> _Breadth | None:
    """Width of a finger, if both of its flanks are visible.

    Errors shared by neighbouring rows of a flank (a pattern on the background, the fit's phase error) are the same in
    every frame. Only few of a frame's rows are therefore treated as independent when the uncertainty is derived from
    their scatter.
    """
    edges = look.edges
    lines, variance = [], 0.0
    for part in (slice(0, INNER), slice(INNER, ROWS)):
        real = np.flatnonzero(edges.lines.weight[side, part] > 0) + part.start
        rows = real[real.size // 2 :]
        if rows.size < FEWEST_ROWS:
            return None
        fixed, found = edges.lines.fixed[side, rows].astype(float), edges.position[side, rows]
        slope, at = np.polyfit(fixed, found, 1)
        scatter = float(np.sum((found - at - slope * fixed) ** 2)) / (rows.size - 2)
        variance += scatter * ALIKE / rows.size + rectangular(Limits().estimator_px) ** 2
        lines.append((float(slope), float(at), float(fixed.mean())))
    (inner_slope, inner_at, inner_row), (outer_slope, outer_at, outer_row) = lines
    row = 0.5 * (inner_row + outer_row)
    inner, outer = inner_at + inner_slope * row, outer_at + outer_slope * row
    slope = 0.5 * (inner_slope + outer_slope)
    return _Breadth(abs(inner - outer) / hypot(1.0, slope), sqrt(variance), 0.5 * (inner + outer))
