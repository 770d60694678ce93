"""One straight edge as measured by gauges: its axes, its fitted parameters, and the limits for accepting it."""

from dataclasses import dataclass
from math import atan, cos, pi, sin

import numpy as np

from fingervision.gauges.reading import Mark
from fingervision.gauges.status import GaugeStatus

# Smallest contrast of an edge, as a share of full scale (as in `fingervision.vision.pipeline`).
CONTRAST_FLOOR = 0.03
# Limits of the ratio of an edge's contrast to that in the previous frame; outside them, another edge is assumed.
LEAST_OF_KNOWN, MOST_OF_KNOWN = 0.4, 2.5
# Largest residual of the fit as a share of the contrast, above which texture is assumed; smallest contrast of any
# eighth of the edge, as a share of the contrast of the whole edge.
MOST_NOISE, LEAST_PIECE = 0.35, 0.5
# Blur (standard deviation) at which the status is `blurred`, as for a gap.
LARGEST_BLUR_PX = 5.0
# Largest bend of a straight edge, in pixels and as a share of its length (the limits of `calib.straight_line`).
LARGEST_BEND_PX, LARGEST_BEND = 0.35, 0.01
# Slopes of an edge, relative to its gauge, that are tried in the first frame; an error of half a step blurs the profile
# over 40 px of an edge by 2 px.
LEANS = tuple(float(lean) for lean in np.linspace(-0.6, 0.6, 13))
MOST_LEAN = 1.0
# Number of strips of the profile beyond the search distance, so that an edge at this distance is completely visible.
BEYOND_PX = 8
# No similar edge may lie within this multiple of reach_px; a motion may then exceed reach_px by half without a
# confusion with a neighbouring edge.
GUARD = 1.5
# After a frame without a number the thing may be farther away: so many times the reach at most, and not so far that
# something like it, seen in the first frame beside it, could be taken for it.
MOST_TIMES = 4
# Smallest contrast of a neighbouring edge, as a share of the measured edge's contrast, at which it is fitted too.
LEAST_BESIDE = 0.1
# Largest distance between the fitted edge and the candidate, in addition to the blur.
FARTHEST_FROM_CANDIDATE_PX = 3.0
# A plateau is clipped if this share of its pixels is at the end of the scale. The flank is clipped as well if more than
# 6 % of the step is lost with a confidence of two standard uncertainties. Otherwise up to a tenth of the step may be
# lost, which shifts the edge by 0 to 0.125 sigma_e towards the light side (rectangular distribution; sigma_e is the
# standard deviation of the blur).
MOST_CLIPPED, MOST_LOST, SURE, HIDDEN_SHIFT_SIGMAS = 0.5, 0.06, 2.0, 0.125 / 3.0**0.5
# Largest standard uncertainty of an accepted position (pixels).
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
