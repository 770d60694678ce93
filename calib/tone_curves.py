"""Families of tone curves of cameras: light over stored level, with priors of their parameters."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from calib.camera_response import CURVES, CameraResponse, standard_response

Floats = NDArray[np.float64]

# Levels (shares of full scale) at which the light of a family is tabulated.
LEVELS = np.linspace(0.0, 1.0, 1025)


@dataclass(frozen=True, slots=True, eq=False)
class Family:
    """A family of tone curves: light over level, with a Gaussian prior of its parameters.

    Parameters
    ----------
    name : str
        Name of the family.
    light : callable
        Light at `LEVELS` for a parameter vector, increasing; its scale is irrelevant.
    mean, u : tuple of float
        Prior means and standard deviations of the parameters.
    """

    name: str
    light: Callable[[Floats], Floats]
    mean: tuple[float, ...] = ()
    u: tuple[float, ...] = ()

    def table(self, parameters: Floats) -> Floats:
        """Light at `LEVELS` as a share of that at full scale, strictly increasing."""
        light = self.light(parameters)
        light = np.maximum.accumulate(light / light[-1])
        return np.asarray(light + 1e-7 * LEVELS)

    def response(self, parameters: Floats) -> CameraResponse:
        """Camera response for a parameter vector."""
        return curve_response(self.name, self.table(parameters)) if self.mean else _fixed_response(self)


@lru_cache(maxsize=32)
def _fixed_response(family: Family) -> CameraResponse:
    """Response of a curve without parameters: one object, because identity tells whether a camera is as assumed."""
    known = family.name in CURVES
    return standard_response(family.name) if known else curve_response(family.name, family.table(np.zeros(0)))


def curve_response(name: str, light: Floats) -> CameraResponse:
    """Camera response of light tabulated at `LEVELS`."""
    light = (light - light[0]) / (light[-1] - light[0])
    light = np.maximum.accumulate(light) + 1e-9 * LEVELS
    return CameraResponse(name, LEVELS, light / light[-1])


def fixed_family(response: CameraResponse) -> Family:
    """Family of one known curve."""
    light = np.interp(LEVELS, response.level, response.light)
    return Family(response.name, lambda _: light)


@cache
def family(name: str) -> Family:
    """Return the family of tone curves with a name in `FAMILIES`, or of a standard response."""
    found = (each for each in FAMILIES if each.name == name)
    return next(found, None) or fixed_family(standard_response(name))


def _log(p: Floats) -> Floats:
    steepness = np.exp(p[0])
    return np.asarray(np.expm1(LEVELS * np.log1p(steepness)) / steepness)


def _power_series(p: Floats) -> Floats:
    """Ln light = exp(p0) ln level + p1 (level - 1) + p2 (level^2 - 1)."""
    exponent = np.exp(p[0]) * np.log(np.maximum(LEVELS, 1e-4)) + p[1] * (LEVELS - 1.0) + p[2] * (LEVELS**2 - 1.0)
    return np.asarray(np.exp(np.minimum(exponent, 50.0)) * (LEVELS > 0.0))


def _shoulder(p: Floats) -> Floats:
    """A film's shoulder: light^n = h s / (1 + s - h), with h a power of the level."""
    h, s = LEVELS ** np.exp(p[0]), np.exp(p[1])
    return np.asarray((h * s / np.maximum(1.0 + s - h, 1e-9)) ** np.exp(-p[2]))


# Exponents of consumer cameras lie around 2 (Grossberg & Nayar 2004, doi:10.1109/TPAMI.2004.88), log profiles span five
# to ten stops, and film curves have shoulders of every height.
FAMILIES = (
    Family("linear", lambda _: LEVELS),
    Family("srgb", lambda _: CURVES["srgb"](LEVELS)),
    Family("bt709", lambda _: CURVES["bt709"](LEVELS)),
    Family("power", lambda p: np.asarray(LEVELS ** np.exp(p[0])), (0.5,), (0.4,)),
    Family("log", _log, (3.5,), (1.2,)),
    Family("power series", _power_series, (0.5, 0.0, 0.0), (0.4, 1.5, 1.0)),
    Family("shoulder", _shoulder, (0.6, 0.7, 0.1), (0.3, 1.2, 0.25)),
)
