"""The camera: tilt, lens, blooming, blur and noise between the ideal scene and the frame."""

from dataclasses import dataclass

from fingervision.domain.errors import FingervisionError

# Below this blur the panels of the line integral become many; a real lens on real pixels has at least three times it.
LEAST_BLUR_PX = 0.1


@dataclass(frozen=True, slots=True)
class Camera:
    """How the scene becomes a frame.

    Parameters
    ----------
    blur_px : float
        Standard deviation of the Gaussian point spread, before pixels integrate.
    noise_grey : float
        Standard deviation of the white noise, in grey levels of 0..255, whatever the bit depth.
    shot_grey : float
        Variance of the shot noise per grey level: a level g has the variance shot_grey * g.
    bloom_px : float
        How far light spreads over every edge into the dark.
    bits : int
        8 or 16; 16 bits scale the levels so that 255 is 65535.
    tint : (float, float, float) or None
        None gives grey frames; three factors give red, green and blue.

    Raises
    ------
    FingervisionError
        A blur, noise or depth that no camera has.
    """

    blur_px: float = 0.9
    noise_grey: float = 0.0
    shot_grey: float = 0.0
    bloom_px: float = 0.0
    bits: int = 8
    tint: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        if not self.blur_px >= LEAST_BLUR_PX:
            msg = f"blur_px must be at least {LEAST_BLUR_PX}, but is {self.blur_px:g}."
            raise FingervisionError(msg)
        if not (self.noise_grey >= 0.0 and self.shot_grey >= 0.0):
            msg = f"Noise must be 0 or more, but is {self.noise_grey:g} grey (white), {self.shot_grey:g} (shot)."
            raise FingervisionError(msg)
        if self.bits not in (8, 16):
            msg = f"A frame's depth must be 8 or 16 bits, but is {self.bits}."
            raise FingervisionError(msg)


IDEAL_CAMERA = Camera()
