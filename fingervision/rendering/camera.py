"""The camera model between the ideal scene and the frame: tilt, lens, edge bias, blur and noise."""

from dataclasses import dataclass
from math import cos, hypot, radians, sin
from typing import Annotated

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.domain.field import Field, Limited
from fingervision.rendering.outline import Line, Outline, Piece, Points, biarcs

# Effect of tilt and lens on an outline: the perspective of a tilted plane, then radial distortion.
#
# The outlines are mapped, not the pictures: a mapped outline again consists of lines and arcs, so that it is rendered
# exactly and its true gap can be computed.

# The distorted radius must increase with the radius up to this multiple of the frame's half diagonal; beyond it the
# distortion factor is constant.
DISTORTED_TO = 1.5
# Spacing of the points that are mapped exactly: along lines in pixels, along arcs in radians. Biarcs between these
# points deviate by at most 5e-6 px from the mapped curve, for 10 % distortion and 20 degrees of tilt
# (tests/rendering/test_lens.py).
SPACING_PX = 5.0
SPACING_RAD = 0.03


@dataclass(frozen=True, slots=True)
class RadialLens:
    """Radial distortion about the frame's centre, in Brown's form: radius r becomes r (1 + k1 q^2 + k2 q^4).

    Parameters
    ----------
    k1, k2 : float
        Coefficients for q = r / (half the frame's diagonal); k1 is the relative radial displacement at the corners
        (negative for barrel distortion).

    Raises
    ------
    FingervisionError
        If the mapping would not be invertible at the picture's border.
    """

    k1: float = 0.0
    k2: float = 0.0

    def __post_init__(self) -> None:
        q2 = np.linspace(0.0, DISTORTED_TO, 31) ** 2
        if not np.min(1 + 3 * self.k1 * q2 + 5 * self.k2 * q2**2) > 0.0:
            raise DataError(
                f"A lens distortion must be invertible within {DISTORTED_TO:g} half diagonals of the frame, but k1 = "
                f"{self.k1:g} with k2 = {self.k2:g} is not: choose coefficients nearer to 0."
            )


@dataclass(frozen=True, slots=True)
class Tilt(Limited):
    """A plane that is not perpendicular to the optical axis; the scale at the frame's centre is unchanged.

    Parameters
    ----------
    about_x_deg : float
        Rotation about the horizontal axis; positive moves the lower part away from the camera.
    about_y_deg : float
        Rotation about the vertical axis; positive moves the right part away from the camera.
    distance_px : float
        Distance of the camera from the plane, in pixels of the plane's scale (100 mm at 34 px/mm by default).

    Raises
    ------
    FingervisionError
        If the camera is not in front of the plane, or sees it edge on.
    """

    about_x_deg: Annotated[float, Field(unit="degrees", low=-45.0, high=45.0)] = 0.0
    about_y_deg: Annotated[float, Field(unit="degrees", low=-45.0, high=45.0)] = 0.0
    distance_px: Annotated[float, Field(above=0.0)] = 3400.0


@dataclass(frozen=True, slots=True)
class View:
    """Map from the ideal picture to the camera's picture, for frames of one size.

    Parameters
    ----------
    lens : RadialLens
        Lens distortion.
    tilt : Tilt
        Perspective.
    width_px, height_px : int
        Size of the frame.
    """

    lens: RadialLens
    tilt: Tilt
    width_px: int
    height_px: int

    def points(self, ideal: Points) -> Points:
        """Map points (..., 2) of the ideal picture to the camera's picture."""
        centre = np.array([(self.width_px - 1) / 2, (self.height_px - 1) / 2])
        x, y = np.moveaxis(ideal - centre, -1, 0)
        ax, ay = radians(self.tilt.about_x_deg), radians(self.tilt.about_y_deg)
        depth = 1.0 + (y * sin(ax) + x * cos(ax) * sin(ay)) / self.tilt.distance_px
        seen = np.stack([x * cos(ay), y * cos(ax) - x * sin(ax) * sin(ay)], axis=-1) / depth[..., None]
        half_diagonal = hypot(self.width_px, self.height_px) / 2
        q2 = np.minimum(np.sum(seen**2, axis=-1, keepdims=True) / half_diagonal**2, DISTORTED_TO**2)
        distorted: Points = centre + seen * (1 + self.lens.k1 * q2 + self.lens.k2 * q2**2)
        return distorted

    def outline(self, ideal: Outline) -> Outline:
        """Map an outline; corners remain corners."""
        pieces: list[Piece] = []
        for piece in ideal.pieces:
            spacing = piece.length_px / SPACING_PX if isinstance(piece, Line) else abs(piece.sweep_rad) / SPACING_RAD
            t = np.linspace(0.0, 1.0, max(2, int(np.ceil(spacing)) + 1))
            # Central difference along the piece; the curvatures of piece and lens cause errors of second order only.
            step = 1e-4 / piece.length_px
            tangents = self.points(piece.points(t + step)) - self.points(piece.points(t - step))
            pieces += biarcs(self.points(piece.points(t)), tangents)
        return Outline(tuple(pieces))


# A smaller blur would need very many panels of the line integral; real cameras have at least three times this blur.
LEAST_BLUR_PX = 0.1


@dataclass(frozen=True, slots=True)
class Camera(Limited):
    """Camera model; the parameters are listed in the order in which they act on the light from the scene.

    Parameters
    ----------
    blur_px : float
        Standard deviation of the Gaussian point spread function, before integration over the pixels.
    noise_grey : float
        Standard deviation of the white noise, in grey levels of 0..255, whatever the bit depth.
    shot_grey : float
        Variance of the shot noise per grey level: at level g the variance is shot_grey * g.
    bloom_px : float
        Distance by which light spreads over every edge into the dark; a light gap between dark fingers widens by twice
        this distance.
    tilt : Tilt or None
        Perspective of a plane that is not perpendicular to the optical axis.
    lens : RadialLens or None
        Radial distortion.
    bits : int
        8 or 16; with 16 bits a grey level g is 257 g, so that 255 is 65535.
    tint : (float, float, float) or None
        None gives grey frames; three factors give colour frames (red, green and blue). The noise is that of the luma,
        equal in all three channels.

    Raises
    ------
    FingervisionError
        If blur, noise, edge bias, bit depth or tint has an impossible value.
    """

    blur_px: Annotated[float, Field(low=LEAST_BLUR_PX)] = 0.9
    noise_grey: Annotated[float, Field(low=0.0)] = 0.0
    shot_grey: Annotated[float, Field(low=0.0)] = 0.0
    bloom_px: Annotated[float, Field(hint="give a number of pixels")] = 0.0
    tilt: Tilt | None = None
    lens: RadialLens | None = None
    bits: int = 8
    tint: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        Limited.__post_init__(self)
        if self.bits not in (8, 16):
            raise DataError(f"bits must be 8 or 16, but is {self.bits}.")
        if self.tint is not None and (len(tuple(self.tint)) != 3 or min(self.tint) < 0.0):
            raise DataError(f"tint must be three factors of 0 or more, for red, green and blue, but is {self.tint}.")

    def sees(self, outlines: tuple[Outline, ...], width_px: int, height_px: int) -> tuple[Outline, ...]:
        """Map outlines from the ideal picture to the camera's picture by tilt and lens, without edge bias and blur."""
        if self.tilt is None and self.lens is None:
            return outlines
        view = View(self.lens or RadialLens(), self.tilt or Tilt(), width_px, height_px)
        return tuple(view.outline(outline) for outline in outlines)


IDEAL_CAMERA = Camera()
"""Camera without tilt and lens distortion, whose picture is the ideal picture itself."""
