"""Effect of its width on the bending stiffness of a flat strip: a plate with two clamped and two free sides.

A bar in bending becomes narrower on the stretched side and wider on the compressed side, and so also curves across its
length (anticlastic bending). The bodies at the ends of a strip prevent anticlastic bending over a length of about the
strip's width. The plate's energy (Timoshenko and Woinowsky-Krieger, Theory of Plates and Shells, article 22) is
minimised by Ritz's method for a unit rotation of one end.
"""

from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre
from numpy.polynomial import polynomial as poly
from numpy.typing import NDArray

Array = NDArray[np.float64]

_ALONG, _ACROSS = 9, 6
"""Terms of Ritz's method along and across the strip: 50 % more terms change the share by less than 0.01 for widths of a
tenth to twenty times the length."""
_NARROW = 0.1
"""Ratio of width to length below which the share is proportional to the width, because the bodies restrain a length
equal to the width."""
_DIGITS = 3


def strip_share(width_over_length: float, poisson: float) -> tuple[float, float]:
    """Weight w of plane strain in a strip's bending, 0 if narrow, 1 if wide; the modulus is E / (1 - w nu^2).

    Parameters
    ----------
    width_over_length : float
        Width over length of the strip: plate thickness over free length.
    poisson : float
        Poisson's ratio of the material.

    Returns
    -------
    (float, float)
        Weight for a strip whose ends rotate against each other, and for a strip whose ends stay parallel, as in a
        parallel-spring stage: there the moments are largest at the ends, where the width is restrained.
    """
    if poisson <= 0.0:
        return 0.0, 0.0
    ratio = max(width_over_length, _NARROW)
    bent, swayed = _shares(round(float(np.log(ratio)), _DIGITS), poisson)
    return bent * width_over_length / ratio, swayed * width_over_length / ratio


def stretched_share(width_over_length: float, poisson: float) -> float:
    """Weight of plane strain, from 0 to 1, in a stretched strip whose ends cannot become narrower.

    The bodies at the ends of the strip prevent it from becoming narrower there. The weight of plane strain is computed
    by Ritz's method, with zero stress in the direction of the strip's thickness; parameters as in `strip_share`.
    """
    if poisson <= 0.0:
        return 0.0
    ratio = max(width_over_length, _NARROW)
    return _stretched(round(float(np.log(ratio)), _DIGITS), poisson) * width_over_length / ratio


@lru_cache(maxsize=512)
def _stretched(log_width: float, poisson: float) -> float:
    width = float(np.exp(log_width))
    x, x_weights = (0.5 * (part + 1.0) if i == 0 else 0.5 * part for i, part in enumerate(legendre.leggauss(24)))
    y, y_weights = legendre.leggauss(24)
    along = [poly.polymul([0.0, 1.0, -1.0], _shifted(m)) for m in range(_ALONG)]
    f, fx = (np.array([poly.polyval(x, poly.polyder(p, k)) for p in along]) for k in range(2))

    def across(first: int) -> tuple[Array, Array]:
        shapes = [legendre.leg2poly(np.eye(2 * _ACROSS)[2 * n + first]) for n in range(_ACROSS)]
        g, gy = (np.array([poly.polyval(y, poly.polyder(q, k)) for q in shapes]) for k in range(2))
        return g, gy * 2.0 / width

    def product(a: Array, b: Array) -> Array:
        return np.asarray(np.einsum("mx,ny->mnxy", a, b).reshape(_ALONG * _ACROSS, -1))

    (even, even_y), (odd, odd_y) = across(0), across(1)
    none = np.zeros((_ALONG * _ACROSS, x.size * y.size))
    stretch = np.vstack([product(fx, even), none])
    narrowing = np.vstack([none, product(f, odd_y)])
    shear = np.vstack([product(f, even_y), product(fx, odd)])
    weights = np.outer(x_weights, 0.5 * width * y_weights).ravel()
    law = 0.5 * (1.0 - poisson)
    energy = (stretch * weights) @ stretch.T + (narrowing * weights) @ narrowing.T + law * (shear * weights) @ shear.T
    mixed = poisson * (stretch * weights) @ narrowing.T
    pull = (stretch + poisson * narrowing) @ weights
    # The displacements that are added to a uniform stretch minimise the energy.
    stiffness = (width - pull @ np.linalg.lstsq(energy + mixed + mixed.T, pull, rcond=None)[0]) / width
    stiffness /= 1.0 - poisson**2
    return float(np.clip((1.0 - 1.0 / stiffness) / poisson**2, 0.0, 1.0))


@lru_cache(maxsize=512)
def _shares(log_width: float, poisson: float) -> tuple[float, float]:
    """Compute the two weights of `strip_share` for a strip of unit length that is not narrow."""
    width = float(np.exp(log_width))
    x, x_weights = (0.5 * (part + 1.0) if i == 0 else 0.5 * part for i, part in enumerate(legendre.leggauss(24)))
    y, y_weights = legendre.leggauss(24)
    # Along the strip, the functions have no displacement and no slope at the ends; across it, they are even
    # polynomials.
    clamped = poly.polymul([0.0, 0.0, 1.0], poly.polypow([1.0, -1.0], 2))
    along = [poly.polymul(clamped, _shifted(m)) for m in range(_ALONG)]
    across = [legendre.leg2poly(np.eye(2 * _ACROSS)[2 * n]) for n in range(_ACROSS)]
    f = np.array([[poly.polyval(x, poly.polyder(p, k)) for p in along] for k in range(3)])
    g = np.array([[poly.polyval(y, poly.polyder(q, k)) * (2.0 / width) ** k for q in across] for k in range(3)])

    def second(i: int, j: int) -> Array:
        return np.asarray(np.einsum("mx,ny->mnxy", f[i], g[j]).reshape(_ALONG * _ACROSS, x.size, y.size))

    xx, yy, xy = second(2, 0), second(0, 2), second(1, 1)
    weights = np.outer(x_weights, 0.5 * width * y_weights)
    energy = (np.einsum("axy,bxy,xy->ab", xx, xx, weights) + np.einsum("axy,bxy,xy->ab", yy, yy, weights)
              + 2.0 * (1.0 - poisson) * np.einsum("axy,bxy,xy->ab", xy, xy, weights))  # fmt: skip
    mixed = poisson * np.einsum("axy,bxy,xy->ab", xx, yy, weights)
    energy += mixed + mixed.T
    found = []
    # Curvature of a bar: uniform, or with a change of sign in the middle.
    for curvature in (np.ones(x.size), 1.0 - 2.0 * x):
        pull = np.einsum("axy,xy->a", (xx + poisson * yy) * curvature[:, None], weights)
        bar = width * float(x_weights @ curvature**2)
        stiffness = (bar - pull @ np.linalg.solve(energy, pull)) / (bar * (1.0 - poisson**2))
        found.append(float(np.clip((1.0 - 1.0 / stiffness) / poisson**2, 0.0, 1.0)))
    return found[0], found[1]


def _shifted(degree: int) -> Array:
    """Legendre polynomial shifted to the interval from 0 to 1."""
    found: Array = np.zeros(1)
    power: Array = np.ones(1)
    for coefficient in legendre.leg2poly(np.eye(degree + 1)[degree]):
        found = np.asarray(poly.polyadd(found, coefficient * power))
        power = np.asarray(poly.polymul(power, [-1.0, 2.0]))
    return found
