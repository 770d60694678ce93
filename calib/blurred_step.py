"""A step of light blurred by optics and pixels: its profile, and its change with each property of the optics.

The blur is a Gaussian convolved with a disc (defocus) and integrated over the pixel, of which a share is spread further
by an exponential to either side: the tails of optics, and coma if they are unlike. Its spectrum is a product, so that
the profile and its derivatives are inverse Fourier transforms.

A camera or a program that smooths its pictures takes weighted sums of neighbouring pixels: the Gaussian is then known
at whole pixels only, its spectrum is periodic, and the profile of a sharp edge is a chain of straight pieces.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import j0, j1

Floats = NDArray[np.float64]

# Spacing and number of the tabulated places (pixels); between them, cubic interpolation errs by less than 1e-5.
SPACING_PX, COUNT = 0.15, 512
EXTENT_PX = SPACING_PX * COUNT
# Number of properties of the optics: ln sigma, ln radius of the disc over sigma, shares of the light in the tails
# towards larger and towards smaller coordinates, ln length of the tails over sigma.
OPTICS = 5
# Limits of the logarithms: a step of a fit may try optics of any width.
LOGARITHMS = (-4.0, 3.0)

_ROTATIONS = 2.0 * np.pi * np.fft.rfftfreq(COUNT, SPACING_PX)
_INTEGRAL = np.concatenate([[0.0], 1.0 / (1j * _ROTATIONS[1:])])
_PIXEL = np.sinc(_ROTATIONS / (2.0 * np.pi))
# Repetitions of the spectrum of a Gaussian that is known at whole pixels only.
_REPEATED = 2.0 * np.pi * np.arange(-3.0, 4.0)[:, None]
_RAMP = 0.5 + (np.arange(COUNT) - COUNT // 2) / COUNT


@dataclass(frozen=True, slots=True, eq=False)
class BlurredStep:
    """Tables of a blurred step from 0 to 1 at the coordinate zero, and of its slope.

    Parameters
    ----------
    optics : ndarray of float, shape (OPTICS,)
        The properties of the optics.
    step, slope : ndarray of float, shape (COUNT,)
        The step, and its derivative with respect to the coordinate.
    point : _Point
        Spectrum of a point of light.
    """

    optics: Floats
    step: Floats
    slope: Floats
    point: "_Point"

    @classmethod
    def of(cls, optics: Floats, by_pixels: bool = False) -> "BlurredStep":
        """Step for the properties of the optics, shape (OPTICS,); with `by_pixels`, pixels were smoothed."""
        point = _Point.of(optics, by_pixels)
        spectrum = point.base * point.tails
        step, slope = _tables(np.array([spectrum * _INTEGRAL, spectrum]))
        return cls(optics, step + _RAMP, slope, point)

    def at(self, x: Floats) -> tuple[Floats, Floats]:
        """Step and its slope at coordinates of any shape."""
        k, t = _places(x)
        before, after = self.step[k], self.step[k + 1]
        first, last = SPACING_PX * self.slope[k], SPACING_PX * self.slope[k + 1]
        rise = after - before
        # Hermite's cubic through both values and slopes.
        c, d = 3.0 * rise - 2.0 * first - last, first + last - 2.0 * rise
        value = before + t * (first + t * (c + t * d))
        return value, (first + t * (2.0 * c + 3.0 * t * d)) * (1.0 / SPACING_PX)

    def by_optics(self, x: Floats) -> Floats:
        """Derivatives of the step with respect to the optics, shape (OPTICS, ...) for coordinates of shape (...)."""
        tables = _tables(np.array(self.point.changes(*self.optics[2:4])) * _INTEGRAL)
        k, t = _places(x)
        return np.asarray(tables[:, k] * (1.0 - t) + tables[:, k + 1] * t)


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    """Spectrum of a point of light, `base * tails`, and what its derivatives need.

    Parameters
    ----------
    squares, each, total : ndarray of float
        Squares of sigma times the rotations, the Gaussian of each of their repetitions, and its sum over them.
    gaussian, airy, base : ndarray of float
        Spectra of the Gaussian over the pixel and of the disc, and their product.
    radius : ndarray of float
        Radius of the disc times the rotations.
    larger, smaller, tails : ndarray of complex
        Change by light in the tail to either side, and of all light.
    """

    squares: Floats
    each: Floats
    total: Floats
    gaussian: Floats
    airy: Floats
    base: Floats
    radius: Floats
    larger: Floats
    smaller: Floats
    tails: Floats

    @classmethod
    def of(cls, optics: Floats, by_pixels: bool) -> "_Point":
        sigma, disc, length = np.exp(np.clip(optics[[0, 1, 4]], *LOGARITHMS))
        w = _ROTATIONS * sigma
        squares = np.atleast_2d((sigma * (_ROTATIONS + (_REPEATED if by_pixels else 0.0))) ** 2)
        each = np.exp(-0.5 * squares)
        total = each.sum(axis=0)
        gaussian = total / total[0] * _PIXEL
        radius = np.maximum(w * disc, 1e-9)
        airy = 2.0 * j1(radius) / radius
        larger, smaller = 1.0 / (1.0 + 1j * w * length) - 1.0, 1.0 / (1.0 - 1j * w * length) - 1.0
        tails = 1.0 + optics[2] * larger + optics[3] * smaller
        return cls(squares, each, total, gaussian, airy, gaussian * airy, radius, larger, smaller, tails)

    def changes(self, a: float, b: float) -> list[Floats]:
        """Derivatives with respect to the optics, of which `a` and `b` are the shares of light in the tails."""
        change = -(self.squares * self.each).sum(axis=0)
        wider = (change - self.total * (change[0] / self.total[0])) / self.total[0] * _PIXEL * self.airy * self.tails
        # The derivative of 2 J1(z) / z is -2 J2(z) / z, and J2(z) = 2 J1(z) / z - J0(z).
        disc = -2.0 * self.gaussian * (self.airy - j0(self.radius)) * self.tails
        larger, smaller = self.larger, self.smaller
        longer = self.base * (a * larger * (larger + 1.0) + b * smaller * (smaller + 1.0))
        return [wider + disc + longer, disc, self.base * larger, self.base * smaller, longer]


def _tables(spectra: Floats) -> Floats:
    """Functions over the coordinates from their spectra, shape (functions, COUNT)."""
    tables = np.fft.irfft(spectra, COUNT) / SPACING_PX
    return np.concatenate([tables[:, COUNT // 2 :], tables[:, : COUNT // 2]], axis=-1)


def _places(x: Floats) -> tuple[NDArray[np.intp], Floats]:
    """Number of the tabulated place before each coordinate, and the share of the way to the next."""
    place = np.clip(x * (1.0 / SPACING_PX) + COUNT // 2, 0.0, COUNT - 1.001)
    k = place.astype(np.intp)
    return k, place - k
