"""The camera response: relation between a stored grey level and the light that it represents.

An edge is at the position where the light equals the mean of its two plateaus. In levels after a transfer curve
(gamma), the mean of the levels is reached at another position, and the edge appears displaced, the more so the larger
the blur.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calib.errors import CalibrationError
from calib.short_repr import ShortRepr

Floats = NDArray[np.float64]
Grey = NDArray[np.uint8] | NDArray[np.uint16]

# Largest deviation (share of full scale) of a clipped white from its nominal level after a lossy codec: one level of 8
# bits.
WHITE_SLACK = 1.0 / 255.0
# Ratio of the number of pixels brighter than white to the number at white, above which a video uses the levels beyond
# white. An unclipped white plateau with noise of 3 levels has the ratio 0.8; ringing of a codec around a clipped white
# gives less than 0.1.
MOST_BRIGHTER = 0.25
# Smallest number of points of a measured curve.
FEWEST_POINTS = 8


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CameraResponse(ShortRepr):
    """A camera response: curve from stored levels to light.

    Parameters
    ----------
    name : str
        Name of the response in files and sentences.
    level : ndarray of float, shape (n,)
        Stored level as a share of full scale, from 0 to 1, increasing.
    light : ndarray of float, shape (n,)
        Light as a share of the light that gives full scale, from 0 to 1, increasing.
    top_level : int or None
        Full scale of the pictures on which the response was measured; None if it is valid for any bit depth.
    white : float
        Level of white as a share of full scale; below 1 for a video with studio range.

    Raises
    ------
    CalibrationError
        If the curve has too few points, does not increase, or does not extend from 0 to 1.
    """

    name: str
    level: Floats
    light: Floats
    top_level: int | None = None
    white: float = 1.0

    def __post_init__(self) -> None:
        """Refuse an impossible response."""
        level, light = self.level, self.light
        if level.shape != light.shape or level.ndim != 1 or level.size < FEWEST_POINTS:
            raise CalibrationError(
                f"A camera response must have at least {FEWEST_POINTS} pairs of level and light, but {self.name} has "
                f"{level.size}: measure it with `fingervision calibrate response`."
            )
        if not (np.isfinite(level).all() and np.isfinite(light).all()):
            raise CalibrationError(
                f"All levels and light values of the camera response {self.name} must be finite numbers."
            )
        for what, values in (("level", level), ("light", light)):
            falls = np.flatnonzero(np.diff(values) <= 0.0)
            if falls.size:
                raise CalibrationError(
                    f"The {what} of the camera response {self.name} must rise from row to row, but does not after row "
                    f"{falls[0] + 1}: measure the response again."
                )
        if abs(level[0]) > 1e-9 or abs(level[-1] - 1.0) > 1e-9:
            raise CalibrationError(
                f"The levels of the camera response {self.name} must extend from 0 to full scale, but extend from "
                f"{level[0]:.3g} to {level[-1]:.3g} of full scale."
            )

    def __reduce__(self) -> tuple[Any, ...]:
        """In another process, a standard response is again the one that `standard_response` returns."""
        if self.name in CURVES and self is standard_response(self.name):
            return standard_response, (self.name,)
        return CameraResponse, (self.name, self.level, self.light, self.top_level, self.white)

    def table(self, top_level: int, size: int, highest: int | None = None) -> Floats:
        """Light for every stored level, on the scale of the levels: 0 gives 0, full scale gives full scale.

        Parameters
        ----------
        top_level : int
            Full scale of the pictures.
        size : int
            Length of the table; levels beyond full scale are assigned the light of full scale.
        highest : int or None
            Level at which the pictures are clipped, and beyond which all levels have the same light; None for full
            scale.

        Raises
        ------
        CalibrationError
            If the response was measured on pictures of another bit depth.
        """
        if self.top_level is not None and self.top_level != top_level:
            raise CalibrationError(
                f"The camera response {self.name} was measured on levels up to {self.top_level}, but these pictures "
                f"have levels up to {top_level}: measure it on pictures of this bit depth, or state the bit depth by "
                "--bits."
            )
        share = np.minimum(np.arange(size), top_level if highest is None else highest) / top_level
        return np.asarray(top_level * np.interp(share, self.level, self.light))

    def cut_off_at(self, grey: Grey, top_level: int) -> int:
        """Level at which a picture is clipped: full scale, or white if hardly any pixel of a video is brighter.

        Many cameras use the levels above the white of studio range as well; their pictures are clipped at full scale.

        Parameters
        ----------
        grey : ndarray, shape (height, width)
            Stored levels.
        top_level : int
            Full scale of the pictures.
        """
        if self.white == 1.0:
            return top_level
        white, slack = round(self.white * top_level), max(1, round(WHITE_SLACK * top_level))
        brighter = np.count_nonzero(grey > white + slack)
        at_white = np.count_nonzero(grey >= white - slack) - brighter
        return top_level if brighter > MOST_BRIGHTER * at_white else white - slack

    def linearised(self, grey: Grey, top_level: int) -> NDArray[np.uint16]:
        """Convert a picture to 16-bit values proportional to light; clipped levels become full scale."""
        table = self.table(top_level, int(np.iinfo(grey.dtype).max) + 1, self.cut_off_at(grey, top_level))
        return np.asarray(np.rint(table * (65535.0 / table[top_level])).astype(np.uint16)[grey])


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MeasuredResponse(ShortRepr):
    """A measured response with the residuals of its fit.

    Parameters
    ----------
    response : CameraResponse
        The response curve.
    exponent : float
        Exponent of the nearest power law; 1 for a linear camera, about 2.2 for consumer cameras.
    rms_relative : float
        Root mean square of the residuals, as a share of the light.
    covered : (float, float)
        Smallest and largest level in the pictures, as shares of full scale; outside this range the curve is
        extrapolated.
    u_exponent : float or None
        Standard uncertainty of the exponent, if the pictures determine it.
    """

    response: CameraResponse
    exponent: float
    rms_relative: float
    covered: tuple[float, float]
    u_exponent: float | None = None


def _srgb(level: Floats) -> Floats:
    """Transfer curve of sRGB (IEC 61966-2-1), from signal to light."""
    return np.where(level <= 0.04045, level / 12.92, ((level + 0.055) / 1.055) ** 2.4)


def _bt709(level: Floats) -> Floats:
    """Transfer curve of ITU-R BT.709-6, item 1.2, from signal to light.

    The constants have as many digits as are needed to make the two parts of the curve continuous.
    """
    alpha, beta = 1.09929682680944, 0.018053968510807
    return np.where(level < 4.5 * beta, level / 4.5, ((level + alpha - 1.0) / alpha) ** (1.0 / 0.45))


def _hlg(level: Floats) -> Floats:
    """Transfer curve of ITU-R BT.2100-2, table 5: from the hybrid log-gamma signal to the light of the scene."""
    a = 0.17883277
    b, c = 1.0 - 4.0 * a, 0.5 - a * np.log(4.0 * a)
    return np.where(level <= 0.5, level**2 / 3.0, (np.exp((np.maximum(level, 0.5) - c) / a) + b) / 12.0)


def _pq(level: Floats) -> Floats:
    """Transfer curve of ITU-R BT.2100-2, table 4: from the PQ signal to the scene's light, by the reference OOTF."""
    m1, m2, c1, c2, c3 = 2610 / 16384, 2523 / 4096 * 128, 3424 / 4096, 2413 / 4096 * 32, 2392 / 4096 * 32
    root = level ** (1.0 / m2)
    display_cd_m2 = 10_000.0 * (np.maximum(root - c1, 0.0) / (c2 - c3 * root)) ** (1.0 / m1)
    # The OOTF consists of the curve of BT.709, continued to 59.5208 times its white, and the display's exponent of 2.4.
    return _bt709((display_cd_m2 / 100.0) ** (1.0 / 2.4))


STUDIO = {"srgb": (8, 16, 235), "bt709": (8, 16, 235), "hlg": (10, 64, 940), "pq": (10, 64, 940)}
"""Bits, and the levels of black and white, of a studio-range ("limited") video with each curve (ITU-R BT.709-6, item
4.6; BT.2100-2, table 9)."""


def _studio(name: str) -> Callable[[Floats], Floats]:
    """Transfer curve of a video with studio range, whose black and white lie within the range of stored levels.

    Filters and noise cause levels below black and above white: below black the curve continues antisymmetrically, above
    white by its own formula.
    """
    curve = CURVES[name]
    bits, black, white = STUDIO[name]

    def light(level: Floats) -> Floats:
        signal = (level * (2**bits - 1) - black) / (white - black)
        return np.asarray(np.sign(signal) * curve(np.abs(signal)))

    return light


CURVES: dict[str, Callable[[Floats], Floats]] = {
    "linear": lambda level: level,
    "srgb": _srgb,
    "bt709": _bt709,
    "hlg": _hlg,
    "pq": _pq,
}
CURVES |= {f"{name}_studio": _studio(name) for name in STUDIO}


@cache
def standard_response(name: str) -> CameraResponse:
    """Return a standard response by its name: linear, srgb, bt709, or (high dynamic range) hlg or pq.

    With `_studio` appended to the name, the levels are those of a video with studio range. Light is stated relative to
    the lowest and the highest level, because the position of an edge depends on neither.

    Examples
    --------
    >>> import calib
    >>> response = calib.standard_response("srgb")
    >>> print(f"half of the levels is {float(response.light[2048]):.2f} of the light")
    half of the levels is 0.21 of the light
    """
    if name not in CURVES:
        raise CalibrationError(f"A standard camera response must be one of {', '.join(CURVES)}, but is {name}.")
    level = np.linspace(0.0, 1.0, 4097)
    light = np.asarray(CURVES[name](level), dtype=np.float64)
    bits, _, white = STUDIO[name.removesuffix("_studio")] if name.endswith("_studio") else (8, 0, 255)
    return CameraResponse(name, level, (light - light[0]) / (light[-1] - light[0]), white=white / (2**bits - 1))
