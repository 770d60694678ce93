"""The camera that took a recording, as far as it is known: what lies between the light and the stored levels.

Each property has its standard uncertainty and its origin: stated by the user or by a tag of the file, calibrated with
pictures of its own, learnt from the recording, or assumed.
"""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from calib.camera_response import CameraResponse, standard_response

Floats = NDArray[np.float64]


class Origin(StrEnum):
    """Where a property of the camera is known from."""

    STATED = "stated"
    CALIBRATED = "calibrated"
    LEARNT = "learnt"
    ASSUMED = "assumed"


@dataclass(frozen=True, slots=True)
class CameraQuantity:
    """One number of the camera.

    Parameters
    ----------
    value : float
        The number; its unit is that of the property.
    u : float or None
        Standard uncertainty; None if it is not known.
    origin : Origin
        Where the number is known from.
    """

    value: float
    u: float | None = None
    origin: Origin = Origin.ASSUMED


@dataclass(frozen=True, slots=True, eq=False)
class OtherResponse:
    """Another possible response, which contributes its squared displacement of an edge to the variance.

    Parameters
    ----------
    response : CameraResponse
        The other response.
    weight : float
        Factor of the squared displacement: the probability of a response that excludes the others; 1/3 if the true
        response may be anything between the two (a rectangular distribution, JCGM 100:2008, 4.3.7).
    """

    response: CameraResponse
    weight: float


@dataclass(frozen=True, slots=True, eq=False)
class ResponseEstimate:
    """The response by which stored levels are converted to light, and the responses that are possible beside it.

    The variance of an edge's position due to the response is the sum of weight times squared displacement over the
    other responses.

    Parameters
    ----------
    curve : CameraResponse
        The response that is used.
    others : tuple of OtherResponse
        Other possible responses; empty if the response is known.
    origin : Origin
        Where the response is known from.
    words : str
        Sentence on what could not be learnt, with what to do; empty if there is nothing to say.
    """

    curve: CameraResponse
    others: tuple[OtherResponse, ...] = ()
    origin: Origin = Origin.ASSUMED
    words: str = ""

    @property
    def is_known(self) -> bool:
        """Whether the response is stated or calibrated, so that no other one is possible."""
        return not self.others


@dataclass(frozen=True, slots=True)
class PointSpread:
    """Spread of a point of light: a Gaussian convolved with a disc, and exponential tails to either side.

    Parameters
    ----------
    sigma_px : CameraQuantity
        Standard deviation of the Gaussian, without the width of the pixel (pixels).
    disc_radius_px : float
        Radius of the disc (defocus).
    tail_shares : (float, float)
        Shares of the light in the tails towards larger and towards smaller coordinates in the picture, which are unlike
        for coma; they may be slightly negative.
    tail_px : float
        Mean length of the tails.
    """

    sigma_px: CameraQuantity
    disc_radius_px: float = 0.0
    tail_shares: tuple[float, float] = (0.0, 0.0)
    tail_px: float = 0.0


@dataclass(frozen=True, slots=True)
class NoiseLaw:
    """Variance of the light of one pixel over its mean light, both as shares of full scale (photon transfer).

    Parameters
    ----------
    dark_variance : CameraQuantity
        Variance without light.
    variance_per_light : CameraQuantity
        Increase of the variance per light.
    correlation : float
        Correlation of neighbouring pixels; 0 for a raw picture.
    """

    dark_variance: CameraQuantity
    variance_per_light: CameraQuantity
    correlation: float = 0.0


@dataclass(frozen=True, slots=True)
class DefectPixels:
    """A dead or hot pixel, or a row or column of them, which stands still while the fingers move.

    Parameters
    ----------
    x_px, y_px : int or None
        Column and row; None if the defect extends along all of them.
    excess : float
        Excess of the level over that of the neighbours, as a share of full scale.
    """

    x_px: int | None
    y_px: int | None
    excess: float


def assumed_response(name: str) -> ResponseEstimate:
    """Standard response that is assumed; the true response is taken to lie between it and the other usual one."""
    other = standard_response("srgb" if name == "linear" else "linear")
    return ResponseEstimate(standard_response(name), (OtherResponse(other, 1.0 / 3.0),), Origin.ASSUMED)


# Error of the model of an edge as a share of its contrast, if the recording does not show it: that of the better
# lenses (a prior from rendered and real recordings without compression).
DISCREPANCY = CameraQuantity(0.003)


@dataclass(frozen=True, slots=True, eq=False)
class AddedLight:
    """Light that something beside the edges adds to a finger's own blurred step.

    Parameters
    ----------
    away_px : ndarray of float, shape (n,)
        Distance from the finger's own edge outwards, along its normal.
    share : ndarray of float, shape (2, 3, n)
        Added light as a share of the contrast between finger and ground: left and right finger; inner flank, outer
        flank, tip.
    blur_px : float
        Standard deviation of the blur, without the width of the pixel.
    """

    away_px: Floats
    share: Floats
    blur_px: float


@dataclass(frozen=True, slots=True)
class BesideEdges:
    """What stands beside the edges of both fingers in a whole recording, and how far it displaces the fitted steps.

    Parameters
    ----------
    name : str
        The most probable cause: wall, glare or shadow, or two of them joined by "and"; empty if nothing is taken off,
        but something beside the edges with another tone curve explains them as well.
    probability : float
        Its probability.
    inner_px, outer_px : (float, float)
        Displacement of the left and the right finger's own edge, outwards from the fitted step along its normal.
    outline_px : (float, float)
        The same for the inner edges of the whole outline, side walls included.
    tip_px : (float, float)
        The same for the tips.
    u_gap_px, u_outline_px : float
        Standard uncertainty of the sum of both inner displacements, to the finger's own edge and to the outline.
    added : AddedLight or None
        Light that the cause adds to the finger's own step; None if it is not the same along the whole outline (a wall).
    """

    name: str
    probability: float
    inner_px: tuple[float, float]
    outer_px: tuple[float, float]
    outline_px: tuple[float, float]
    tip_px: tuple[float, float]
    u_gap_px: float
    u_outline_px: float
    added: AddedLight | None = field(default=None, repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class Roughness:
    """Roughness of an edge: covariance of its deviations from the mean line.

    Parameters
    ----------
    covariance : ndarray of float, shape (n,)
        Covariance of the normal deviations of two points of the edge, by their distance in whole pixels (pixels
        squared).
    is_told : bool
        Whether the flanks show the roughness significantly; False if they are too short to decide.
    are_flanks_long : bool
        Whether the flanks are straight so far down that a longer part of them tells the gap more surely.
    """

    covariance: Floats
    is_told: bool = True
    are_flanks_long: bool = False

    @property
    def deviation_px(self) -> float:
        """Standard deviation of the edge about its mean line."""
        return float(np.sqrt(self.covariance[0]))

    @property
    def shared_px(self) -> float:
        """Length of edge (px) that counts as one independent point: the integral of the correlation."""
        return float((2.0 * self.covariance.sum() - self.covariance[0]) / self.covariance[0])


@dataclass(frozen=True, slots=True, eq=False)
class CameraModel:
    """Everything that is known about a camera; the default is a camera about which nothing is known.

    Parameters
    ----------
    response : ResponseEstimate
        Conversion of stored levels to light.
    point_spread : PointSpread or None
        Spread of a point of light; None if no straight flank has shown it.
    noise : NoiseLaw or None
        Noise over light; None if it is not known.
    sharpening : CameraQuantity
        Overshoot of an edge beyond its plateaus, as a share of its contrast.
    lag : CameraQuantity
        Displacement of an edge by a temporal filter, in frames: pixels of lag per pixel of motion from frame to frame.
    defects : tuple of DefectPixels
        Pixels that do not follow the light.
    defects_origin : Origin
        Whether the defects were looked for.
    discrepancy : CameraQuantity
        Standard deviation of an edge's profile about the best model, as a share of the contrast.
    beside : BesideEdges or None
        What stands beside the edges in the whole recording; None if nothing does or it is not known.
    usual : tuple of (float, float) or None
        What the edges show in the frames from which this was learnt (`EdgePoints.unexplained`, `EdgePoints.widened`),
        each with its standard deviation: a frame with others shows something else beside its edges. None if it was not
        learnt from a recording.
    roughness : Roughness or None
        Roughness of the specimen's edges, if most frames show it; None if every frame has to tell.
    """

    response: ResponseEstimate = field(default_factory=lambda: assumed_response("linear"))
    point_spread: PointSpread | None = None
    noise: NoiseLaw | None = None
    sharpening: CameraQuantity = CameraQuantity(0.0)
    lag: CameraQuantity = CameraQuantity(0.0)
    defects: tuple[DefectPixels, ...] = field(default=())
    defects_origin: Origin = Origin.ASSUMED
    discrepancy: CameraQuantity = DISCREPANCY
    beside: BesideEdges | None = None
    usual: tuple[tuple[float, float], ...] | None = None
    roughness: Roughness | None = None


ASSUMED_CAMERA = CameraModel()


def stated_camera(response: CameraResponse) -> CameraModel:
    """Camera of a known response, about which nothing else is known."""
    return CameraModel(ResponseEstimate(response, (), Origin.STATED))
