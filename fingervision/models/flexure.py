"""Geometry of one flexure: the shapes that it adds or removes, its height along its axis, its out-of-plane width."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from math import cos, exp, radians, sin, sqrt
from typing import Any, Literal

import numpy as np
from numpy.polynomial import legendre
from numpy.polynomial import polynomial as poly
from numpy.typing import NDArray

from fingervision.domain.gripper import PointMm
from fingervision.models.hinge_correction import Notch, plane_strain_share
from fingervision.models.plane_shapes import Ellipse, Polygon, Shape, bar
from fingervision.models.width_effect import ConstrainedZone

# Effect of its width on the bending stiffness of a flat strip: a plate with two clamped and two free sides.
#
# A bar in bending becomes narrower on the stretched side and wider on the compressed side, and so also curves across
# its length (anticlastic bending). The bodies at the ends of a strip prevent anticlastic bending over a length of
# about the strip's width. The plate's energy (Timoshenko and Woinowsky-Krieger, Theory of Plates and Shells, article
# 22) is minimised by Ritz's method for a unit rotation of one end.

Array = NDArray[np.float64]

_ALONG, _ACROSS = 9, 6
"""Terms of Ritz's method along and across the strip: 50 % more terms change the share by less than 0.01 for widths of a
tenth to twenty times the length."""
_NARROW = 0.1
"""Ratio of width to length below which the share is proportional to the width, because the bodies restrain a length
equal to the width."""
_DIGITS = 3
_GAUSS = legendre.leggauss(24)


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
    (y, y_weights), (x, x_weights) = _GAUSS, (0.5 * (_GAUSS[0] + 1.0), 0.5 * _GAUSS[1])
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
    (y, y_weights), (x, x_weights) = _GAUSS, (0.5 * (_GAUSS[0] + 1.0), 0.5 * _GAUSS[1])
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


FlexureKind = Literal["circular", "elliptic", "filleted", "leaf", "strip"]
_HEIGHT_THAT_BENDS = 0.13
"""Largest height that a fillet adds on either side, in thicknesses, for a section that still counts as bending: such a
section is 1.26 times as high as the neck and twice as stiff in bending."""
_THIN = 0.26
"""Rate at which the restraint of a strip by its width approaches that of a thin plate as the ratio b / t of width to
thickness grows: wedge elements of CalculiX give 0.24, 0.43, 0.70 and 0.9 of it at b / t = 1, 2, 4 and 10
(`tests/models/test_strip_width.py`)."""
_SHARP = 3.0
"""Power of a strip's share of plane strain that gives its largest von Mises stress, beside sharp roots: the middle of
the width is held and carries more than the mean, so that only wide strips are stressed less than a narrow bar. Within
3 % of wedge elements of CalculiX for shares of 0.04 to 0.8 (`tests/benchmarks/models_three_dimensions.py`)."""
_LEAST_SINE = 0.1
"""Least sine of the angle between two leaves that cross; others lie on each other."""
_POISSON = 0.34
"""Poisson's ratio for which the plane-strain share is computed: the share changes by only 0.006 between Poisson's
ratios nu = 0.2 and 0.34, and is multiplied by nu^2."""


@dataclass(frozen=True, slots=True)
class Flexure:
    """One flexure with its dimensions.

    Parameters
    ----------
    name : str
        Name of the flexure in messages.
    kind : str
        `circular` and `elliptic`: two discs or ellipses cut into the body; `filleted`: two slots with rounded corners
        cut into the body; `leaf`: a thin bar added between bodies; `strip`: a straight strip that is `found`.
    at_mm : (float, float)
        Centre of the flexure.
    axis_deg : float
        Angle of the flexure's axis from x.
    thickness_mm : float
        Least height of the flexure.
    half_length_mm, depth_mm : float
        Half extent along the axis, and depth of the cut, measured from the surface of the neck. For a circular flexure,
        both are its radius. A leaf has no depth.
    fillet_mm : float
        Radius of the corners of a filleted flexure.
    lean : float
        -1 for a notch whose right face, seen along the axis, is cut and whose left one is straight; 0 for equal faces.
    found : bool
        Whether the bodies and cuts of the drawing leave the flexure, which then adds and removes nothing (`strips`).
    layer : int
        Number of the layer in which the flexure lies.
    used : (float, float, float) or None
        Shares of the flexure's strain energy from three deformations: ends that rotate against each other, ends that
        sway, and elongation. None where the shares are unknown.
    """

    name: str
    kind: FlexureKind
    at_mm: PointMm
    axis_deg: float
    thickness_mm: float
    half_length_mm: float
    depth_mm: float = 0.0
    fillet_mm: float = 0.0
    lean: float = 0.0
    found: bool = False
    layer: int = 1
    used: tuple[float, float, float] | None = None

    def point_mm(self, along: Any, across: Any) -> tuple[Any, Any]:
        """Convert coordinates along and across the flexure's axis to a point, or to an array of points."""
        c, s = cos(radians(self.axis_deg)), sin(radians(self.axis_deg))
        return self.at_mm[0] + c * along - s * across, self.at_mm[1] + s * along + c * across

    def section_mm(self, along: Any, across: Any = 0.0) -> tuple[Any, Any]:
        """Convert a position along the axis and one from the middle of the section there to a point, as `point_mm`."""
        middle = 0.5 * self.lean * (self.height_mm(along) - self.thickness_mm)
        return self.point_mm(along, middle + across)

    def _box(self, along: float, low: float, high: float) -> Polygon:
        places = ((-along, low), (along, low), (along, high), (-along, high))
        return Polygon(tuple(self.point_mm(a, b) for a, b in places))

    def steps(self) -> list[tuple[bool, Shape]]:
        """Shapes that the flexure adds to the drawing's region or removes from it."""
        half = 0.5 * self.thickness_mm
        if self.found:
            return []
        if self.kind == "leaf":
            ends = (*self.point_mm(-self.half_length_mm, 0.0), *self.point_mm(self.half_length_mm, 0.0))
            return [(True, bar(*ends, self.thickness_mm))]
        steps: list[tuple[bool, Shape]] = []
        for side in (-1.0, 1.0):
            if self.kind != "filleted":
                centre = self.point_mm(0.0, side * (half + self.depth_mm))
                steps.append((False, Ellipse(centre, (self.half_length_mm, self.depth_mm), self.axis_deg)))
                continue
            r, length, deep = self.fillet_mm, self.half_length_mm, half + self.depth_mm
            steps.append((False, self._box(length - r, side * half, side * deep)))
            steps.append((False, self._box(length, side * (half + r), side * deep)))
            corners = [self.point_mm(end * (length - r), side * (half + r)) for end in (-1.0, 1.0)]
            steps += [(False, Ellipse(corner, (r, r))) for corner in corners]
        return steps

    @property
    def is_notch(self) -> bool:
        """Whether the flexure's surfaces are circular or elliptic arcs over its whole length."""
        return self.kind in ("circular", "elliptic")

    def height_mm(self, x_mm: Array) -> Array:
        """Height at positions along the axis, measured from the flexure's centre (mm)."""
        t, a = self.thickness_mm, self.half_length_mm
        if self.is_notch:
            return self.notch(1.0).height_mm(x_mm)
        if self.fillet_mm == 0.0:
            return np.full(np.shape(x_mm), t)
        within = np.clip((np.abs(x_mm) - (a - self.fillet_mm)) / self.fillet_mm, 0.0, 1.0)
        return np.asarray(t + 2.0 * self.fillet_mm * (1.0 - np.sqrt(1.0 - within**2)))

    def notch(self, plate_mm: float) -> Notch:
        """Notch with the dimensions of a circular or elliptic flexure, for a plate thickness."""
        return Notch(self.thickness_mm, self.half_length_mm, self.depth_mm, plate_mm)

    @property
    def bent_mm(self) -> float:
        """Length of a leaf or straight neck that bends, with the part of its fillets that is at most twice as stiff."""
        straight, r = self.half_length_mm - self.fillet_mm, self.fillet_mm
        if r == 0.0:
            return 2.0 * straight
        rise = min(_HEIGHT_THAT_BENDS * self.thickness_mm / r, 1.0)
        return 2.0 * (straight + r * sqrt(1.0 - (1.0 - rise) ** 2))

    def width_share(self, plate_mm: float) -> float:
        """Degree to which the plate's width constrains the bending: 0 for plane stress, 1 for plane strain.

        For a leaf or a straight neck, the degree of constraint is a mean of two cases, ends that rotate and ends that
        keep their direction. Rotating and parallel ends are weighted by their shares of the strain energy, or equally
        where these shares are unknown.
        """
        if self.is_notch:
            return plane_strain_share(self.notch(plate_mm))
        bent, swayed = self._shares(plate_mm)
        if self.used is None:
            return 0.5 * (bent + swayed)
        return (self.used[0] * bent + self.used[1] * swayed) / max(self.used[0] + self.used[1], 1e-300)

    def width_doubt(self, plate_mm: float) -> float:
        """Half of the range in which `width_share` may lie, because the conditions at a strip's ends are unknown."""
        if self.is_notch or self.used is not None:
            return 0.0
        bent, swayed = self._shares(plate_mm)
        return 0.5 * (swayed - bent)

    def width_range(self, plate_mm: float) -> float:
        """Largest difference between the weight that the models use and that for another load, such as tension."""
        others = (
            (0.0,) if self.is_notch else (*self._shares(plate_mm), stretched_share(plate_mm / self.bent_mm, _POISSON))
        )
        return float(np.abs(np.array(others) - self.zone(plate_mm).share).max())

    def _shares(self, plate_mm: float) -> tuple[float, float]:
        """Weights of `strip_share`, reduced where the bodies yield as the thick strip warps."""
        held = 1.0 - exp(-_THIN * plate_mm / self.thickness_mm)
        bent, swayed = strip_share(plate_mm / self.bent_mm, _POISSON)
        return held * bent, held * swayed

    def crosses(self, other: "Flexure") -> float | None:
        """Position along the axis at which the axis of another leaf crosses this leaf; None if it does not."""
        own, theirs = (np.array(leaf.point_mm(1.0, 0.0)) - leaf.at_mm for leaf in (self, other))
        sine = own[0] * theirs[1] - own[1] * theirs[0]
        if abs(sine) < _LEAST_SINE:
            return None
        apart = np.subtract(other.at_mm, self.at_mm)
        along = float(apart[0] * theirs[1] - apart[1] * theirs[0]) / sine
        beyond = float(apart[0] * own[1] - apart[1] * own[0]) / sine
        return along if abs(along) < self.half_length_mm and abs(beyond) < other.half_length_mm else None

    def zone(self, plate_mm: float) -> ConstrainedZone:
        """Zone in which the plate's width restrains the flexure, with the degree of restraint that the models use."""
        share = self.width_share(plate_mm)
        if self.used is not None:
            stretched = stretched_share(plate_mm / self.bent_mm, _POISSON)
            share += self.used[2] * (stretched - share)
        height = 0.5 * self.thickness_mm + self.depth_mm
        stressed = share if self.is_notch or self.fillet_mm else share**_SHARP
        return ConstrainedZone(self.at_mm, self.axis_deg, self.half_length_mm, height, share, stressed)


def fused(flexures: Sequence[Flexure]) -> tuple[tuple[Flexure, ...], tuple[tuple[str, str, PointMm], ...]]:
    """Divide leaves of one layer that cross: they are one piece of material there, and each of their parts bends alone.

    Returns
    -------
    tuple of Flexure
        The flexures; of a leaf that crosses others its parts, each of which overlaps the next by a thickness.
    tuple of (str, str, (float, float))
        Names of the leaves of every crossing, and its place.
    """
    found: list[Flexure] = []
    crossings: list[tuple[str, str, PointMm]] = []
    for place, leaf in enumerate(flexures):
        stops = [-leaf.half_length_mm, leaf.half_length_mm]
        for number, other in enumerate(flexures):
            if (
                leaf.kind == other.kind == "leaf"
                and leaf.layer == other.layer
                and (at := leaf.crosses(other)) is not None
            ):
                stops.append(at)
                if number > place:
                    crossings.append((leaf.name, other.name, leaf.point_mm(at, 0.0)))
        if len(stops) == 2:
            found.append(leaf)
            continue
        for part, (a, b) in enumerate(pairwise(sorted(stops)), 1):
            low, high = (
                stop if abs(stop) == leaf.half_length_mm else stop + beyond * 0.5 * leaf.thickness_mm
                for stop, beyond in ((a, -1.0), (b, 1.0))
            )
            centre, half = leaf.point_mm(0.5 * (low + high), 0.0), 0.5 * (high - low)
            found.append(replace(leaf, name=f"{leaf.name} part {part}", at_mm=centre, half_length_mm=half))
    return tuple(found), tuple(crossings)
