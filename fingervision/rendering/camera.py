"""The camera model: tilt, lens, edge bias, blur and noise between the ideal scene and the frame."""

from dataclasses import dataclass
from math import isfinite

from fingervision.domain.errors import DataError
from fingervision.rendering.lens import RadialLens, Tilt, View
from fingervision.rendering.outline import Outline

# A smaller blur would need very many panels of the line integral; real cameras have at least three times this blur.
LEAST_BLUR_PX = 0.1


@dataclass(frozen=True, slots=True)
class Camera:
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

    blur_px: float = 0.9
    noise_grey: float = 0.0
    shot_grey: float = 0.0
    bloom_px: float = 0.0
    tilt: Tilt | None = None
    lens: RadialLens | None = None
    bits: int = 8
    tint: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        if not (isfinite(self.blur_px) and self.blur_px >= LEAST_BLUR_PX):
            msg = f"blur_px must be at least {LEAST_BLUR_PX}, but is {self.blur_px:g}."
            raise DataError(msg)
        for name, value in (("noise_grey", self.noise_grey), ("shot_grey", self.shot_grey)):
            if not (isfinite(value) and value >= 0.0):
                msg = f"{name} must be 0 or more, but is {value:g}."
                raise DataError(msg)
        if not isfinite(self.bloom_px):
            msg = f"bloom_px must be a number of pixels, but is {self.bloom_px:g}."
            raise DataError(msg)
        if self.bits not in (8, 16):
            msg = f"bits must be 8 or 16, but is {self.bits}."
            raise DataError(msg)
        if self.tint is not None and (len(tuple(self.tint)) != 3 or min(self.tint) < 0.0):
            msg = f"tint must be three factors of 0 or more, for red, green and blue, but is {self.tint}."
            raise DataError(msg)

    def sees(self, outlines: tuple[Outline, ...], width_px: int, height_px: int) -> tuple[Outline, ...]:
        """Map outlines from the ideal picture to the camera's picture by tilt and lens, without edge bias and blur."""
        if self.tilt is None and self.lens is None:
            return outlines
        view = View(self.lens or RadialLens(), self.tilt or Tilt(), width_px, height_px)
        return tuple(view.outline(outline) for outline in outlines)


IDEAL_CAMERA = Camera()
"""Camera without tilt and lens distortion, whose picture is the ideal picture itself."""
