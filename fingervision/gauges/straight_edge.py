"""One straight edge as measured by gauges: its axes, its fitted parameters, and the limits for accepting it."""

from dataclasses import dataclass
from math import atan, cos, pi, sin

import numpy as np

from fingervision.gauges.reading import Mark
from fingervision.gauges.status import GaugeStatus

# An edge has at least this share of full scale (as `fingervision.vision.pipeline` has it for the whole picture).
CONTRAST_FLOOR = 0.03
# From frame to frame its contrast stays within these factors: what has less is something else.
LEAST_OF_KNOWN, MOST_OF_KNOWN = 0.4, 2.5
# What the fit leaves is at most this share of the contrast: more is texture. Every eighth of the edge has at least this
# share of the whole's contrast.
MOST_NOISE, LEAST_PIECE = 0.35, 0.5
# `blurred` begins at a sigma of 5 px (measuring a gap has the same limit).
LARGEST_BLUR_PX = 5.0
# A bend beyond this (pixels, and share of the length) is a curve: the limits of `calib.straight_line`.
LARGEST_BEND_PX, LARGEST_BEND = 0.35, 0.01
# How an edge may lean against its gauge's direction in the first frame, and the steps in which that is tried; a profile
# across 40 px of an edge is blurred by 2 px where the lean is wrong by half a step.
LEANS = tuple(float(lean) for lean in np.linspace(-0.6, 0.6, 13))
MOST_LEAN = 1.0
# Strips of the profile beyond the reach: an edge there must be seen whole.
BEYOND_PX = 8
# Nothing alike may be within so many times the reach of where it was: a motion may exceed what was stated by half, and
# the neighbour is still not taken for it.
GUARD = 1.5
# After a frame without a number the thing may be farther away: so many times the reach at most, and not so far that
# something like it, seen in the first frame beside it, could be taken for it.
MOST_TIMES = 4
# An edge beside it that has this share of its contrast is part of the model.
LEAST_BESIDE = 0.1
# The fit stays near the candidate.
FARTHEST_FROM_CANDIDATE_PX = 3.0
# A plateau of which this share is at the end of the scale is cut off. Where a sixteenth of the step is surely lost (a
# tenth may be) the flank itself is clipped; up to a tenth the edge lies up to 0.125 sigma_e nearer to the light: a
# rectangular distribution that begins at zero.
MOST_CLIPPED, MOST_LOST, SURE, HIDDEN_SHIFT_SIGMAS = 0.5, 0.06, 2.0, 0.125 / 3.0**0.5
# The fitted position is no number where it is less sure than this (pixels).
LEAST_SURE_PX = 1.0


@dataclass(frozen=True, slots=True)
class EdgeFound:
    """A straight edge in one frame.

    Parameters
    ----------
    position_px : float
        Position along the gauge's direction, from the gauge's middle.
    slope : float
        Change of the position per distance along the edge.
    u_position_px, u_slope, covariance_px : float
        Standard uncertainties of position and slope, and their covariance.
    contrast, inside : float
        Level beyond the edge minus level before it; level before it.
    blur_px : float
        Gaussian sigma of the optics.
    u_response_px : float
        Standard uncertainty of the position due to an unknown camera response.
    """

    position_px: float
    slope: float
    u_position_px: float
    u_slope: float
    covariance_px: float
    contrast: float
    inside: float
    blur_px: float
    u_response_px: float

    @property
    def dark_side(self) -> int:
        """Side of the dark area: +1 beyond the edge (along the direction), -1 before the edge."""
        return -1 if self.contrast > 0.0 else 1


@dataclass(frozen=True, slots=True)
class NotFound:
    """Reason why no edge was found."""

    status: GaugeStatus
    words: str = ""


@dataclass(frozen=True, slots=True)
class Axes:
    """The gauge's own axes in the picture: t along its direction, s perpendicular to t.

    Parameters
    ----------
    x_px, y_px : float
        Origin, where t and s are zero.
    direction_rad : float
        Direction of the axis t.
    """

    x_px: float
    y_px: float
    direction_rad: float

    def point(self, t_px: float, s_px: float = 0.0) -> tuple[float, float]:
        """Picture coordinates of a point that is given in the gauge's axes t and s."""
        cosine, sine = cos(self.direction_rad), sin(self.direction_rad)
        return self.x_px + cosine * t_px - sine * s_px, self.y_px + sine * t_px + cosine * s_px

    def box(self, t_px: float, half_t_px: float, half_s_px: float) -> Mark:
        """Corners of a rectangle around a position on the axis t, for drawing."""
        signs = ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))
        return Mark(tuple(self.point(t_px + a * half_t_px, b * half_s_px) for a, b in signs))


def normal_of(axes: Axes, slope: float) -> float:
    """Direction (rad) perpendicular to an edge whose slope in the gauge's axes is `slope`."""
    return (axes.direction_rad - atan(slope) + pi) % (2.0 * pi) - pi
