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
    by_pixels : bool
        Whether pixels were smoothed, rather than the light on them.
    """

    optics: Floats
    step: Floats
    slope: Floats
    by_pixels: bool

    @classmethod
    def of(cls, optics: Floats, by_pixels: bool = False) -> "BlurredStep":
        """Step for the properties of the optics, shape (OPTICS,)."""
        spectrum, _, _, _ = _spectra(optics, by_pixels)
        step, slope = _tables(np.array([spectrum * _INTEGRAL, spectrum]))
        return cls(optics, step + _RAMP, slope, by_pixels)

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
        _, width, disc, tails = _spectra(self.optics, self.by_pixels)
        base, longer, larger, smaller = tails
        changes = [width + disc + longer, disc, base * larger, base * smaller, longer]
        tables = _tables(np.array(changes) * _INTEGRAL)
        k, t = _places(x)
        return np.asarray(tables[:, k] * (1.0 - t) + tables[:, k + 1] * t)


def _spectra(optics: Floats, by_pixels: bool) -> tuple[Floats, Floats, Floats, tuple[Floats, Floats, Floats, Floats]]:
    """Spectrum of a point of light, its changes by a wider Gaussian and disc, and what makes those by the tails."""
    sigma, disc, length = np.exp(np.clip(optics[[0, 1, 4]], *LOGARITHMS))
    w = _ROTATIONS * sigma
    radius = np.maximum(w * disc, 1e-9)
    gaussian, by_width = _gaussian(sigma, by_pixels)
    gaussian, by_width = gaussian * _PIXEL, by_width * _PIXEL
    airy = 2.0 * j1(radius) / radius
    larger, smaller = 1.0 / (1.0 + 1j * w * length) - 1.0, 1.0 / (1.0 - 1j * w * length) - 1.0
    a, b = optics[2:4]
    tails = 1.0 + a * larger + b * smaller
    base = gaussian * airy
    spectrum = base * tails
    # The derivative of 2 J1(z) / z is -2 J2(z) / z, and J2(z) = 2 J1(z) / z - J0(z).
    by_disc = -2.0 * gaussian * (airy - j0(radius)) * tails
    by_length = base * (a * larger * (larger + 1.0) + b * smaller * (smaller + 1.0))
    return spectrum, by_width * airy * tails, by_disc, (base, by_length, larger, smaller)


def _gaussian(sigma: float, by_pixels: bool) -> tuple[Floats, Floats]:
    """Spectrum of a Gaussian, and its derivative with respect to ln sigma."""
    squares = (sigma * (_ROTATIONS + (_REPEATED if by_pixels else 0.0))) ** 2
    each = np.atleast_2d(np.exp(-0.5 * squares))
    total, change = each.sum(axis=0), -(squares * each).sum(axis=0)
    return total / total[0], (change - total * (change[0] / total[0])) / total[0]


def _tables(spectra: Floats) -> Floats:
    """Functions over the coordinates from their spectra, shape (functions, COUNT)."""
    return np.asarray(np.fft.fftshift(np.fft.irfft(spectra, COUNT), axes=-1) / SPACING_PX)


def _places(x: Floats) -> tuple[NDArray[np.intp], Floats]:
    """Number of the tabulated place before each coordinate, and the share of the way to the next."""
    place = np.clip(x * (1.0 / SPACING_PX) + COUNT // 2, 0.0, COUNT - 1.001)
    k = place.astype(np.intp)
    return k, place - k
