"""The part of a flexure that is modelled as a beam: where it begins and ends, and the compliance of its segments.

A notch is a beam between the points where it meets the bodies that it joins, corrected by the tables for hinges. For a
leaf and for a straight neck, the beam ends one and a half thicknesses before the roots: by Saint-Venant's principle the
beam theory is valid up to these ends, and the compliance of the roots is included in the elastic bodies.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

from fingervision.domain.errors import DataError
from fingervision.domain.gripper import Material
from fingervision.models.flexure import Flexure, stretched_share
from fingervision.models.hinge_correction import (
    SWAY_SHEAR,
    HingeTheory,
    Notch,
    beam_compliance,
    hinge_ratio,
    sway_shear,
    timoshenko_compliance,
)
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.plane_shapes import Polygon
from fingervision.models.plane_stress import PlaneStressPlate

Array = NDArray[np.float64]

_SEGMENTS, _SEGMENTS_OF_LEAF = 10, 20
"""Number of segments of a notch, which bends at its neck, and of a leaf or straight neck, which bends along its whole
length: the relative error from replacing an arc by n chords is about 1 / n^2."""
_SAMPLES = 401
_ROUNDS, _BETWEEN = 5, 65
"""Rounds of the search for the end of the free length, and points in each round. A round narrows the interval by a
factor of 64; after five rounds the interval is below 1e-11 of the half length."""
_BESIDE = 1e-4
"""Distance from a flexure's surface at which material and void are tested, as a share of the thickness."""
_BESIDE_FOUND = 0.03
"""The same for a flexure that the outline leaves, whose faces are within 0.02 thicknesses of its form (`strips`)."""
_BENDS = 2.0
"""Largest ratio of a section's height to the neck's height at which the section bends noticeably: a section twice as
high has an eighth of the compliance."""
_AS_THIN = 1.1
"""Thickness that every section that bends must have, as a multiple of the neck's thickness: the same moment then causes
no more stress there than in the neck."""
_IN_NECK, _IN_SECTION = 0.98, 9
"""Share of a section's height in which material is tested, and points across it."""
_SAINT_VENANT = 1.5
"""Distance of a cut from the root in thicknesses: a self-balanced load of a strip decays at least as exp(-2.1 x / (t /
2)) (Timoshenko and Goodier, article 26), to 0.2 % there."""
_LEAST_SHARE = 0.3
"""Least share of the free length that is modelled as a beam, used where a neck is too short for the distance
`_SAINT_VENANT` from its roots."""
_OVER = 1.02
"""Height of a cut as a multiple of the section's height, so that the cut ends in the void on either side."""
_WITHIN = 0.95
"""Position of the cut of a notch that opens into something wider, as a share of its half length: still inside the
notch."""
_BEYOND = 0.02
"""Distance of the cut beyond a notch's end, in thicknesses; the cut runs straight through the link."""
_NARROW = 0.25
"""Ratio of width to thickness for which the tables give plane stress; used if the width effect is left out."""
_GAUSS = leggauss(12)
_SHEAR = 6.0 / 5.0


@dataclass(frozen=True, slots=True)
class FlexureSpan:
    """A flexure with the positions of its two ends, where it is cut from the bodies.

    Parameters
    ----------
    flexure : Flexure
        The flexure as drawn.
    free_mm : (float, float)
        Positions along the axis, from the flexure's centre, between which there is no material but the flexure.
    cut_mm : (float, float)
        Positions of the two cuts along the axis.
    heights_mm : (float, float)
        Heights of the sections at the cuts.
    """

    flexure: Flexure
    free_mm: tuple[float, float]
    cut_mm: tuple[float, float]
    heights_mm: tuple[float, float]

    @property
    def slab(self) -> Polygon:
        """Region of the flexure between its cuts; removing it separates the bodies on either side."""
        (a, b), (low, high) = self.cut_mm, self.heights_mm
        corners = ((a, -0.5), (b, -0.5), (b, 0.5), (a, 0.5))
        heights = (low, high, high, low)
        return Polygon(tuple(self.flexure.section_mm(x, s * h * _OVER) for (x, s), h in zip(corners, heights,
                                                                                         strict=True)))  # fmt: skip

    def notch(self, plate_mm: float) -> Notch:
        """Notch with the same bending behaviour as this flexure, with its height at the ends of the free length."""
        web_mm = max(float(self.flexure.height_mm(np.array([end]))[0]) for end in self.free_mm)
        notch = self.flexure.notch(plate_mm)
        return replace(notch, web_mm=web_mm) if self.flexure.is_notch else notch

    def stations_mm(self, plate_mm: float) -> Array:
        """Ends of the segments, closer together where a notch bends; shape (segments + 1,)."""
        if not self.flexure.is_notch:
            return np.linspace(*self.cut_mm, _SEGMENTS_OF_LEAF + 1)
        # A notch may meet its two bodies at different distances from its centre.
        halves = []
        for free_mm, cut_mm in zip(self.free_mm, self.cut_mm, strict=True):
            web_mm = float(self.flexure.height_mm(np.array([free_mm]))[0])
            outer = replace(self.flexure.notch(plate_mm), web_mm=web_mm).stations_mm(_SEGMENTS)[_SEGMENTS // 2 :]
            halves.append(outer * (abs(cut_mm) / outer[-1]))
        return np.concatenate([-halves[0][:0:-1], halves[1]])

    def compliances(self, plate_mm: float, material: Material, theory: HingeTheory, *, width_effect: bool) -> Array:
        """Compliance of each segment at its end (along the axis, across it, rotation); shape (segments, 3, 3)."""
        spans = list(pairwise(self.stations_mm(plate_mm).tolist()))
        corrected = theory is HingeTheory.CORRECTED
        if self.flexure.is_notch:
            notch = self.notch(plate_mm)
            wide = notch if width_effect else replace(notch, plate_mm=_NARROW * notch.thickness_mm)
            root = np.sqrt(hinge_ratio(wide, material, theory))
            parts = np.array([beam_compliance(notch, material, span) for span in spans])
            found = root[:, None] * parts * root
            if corrected:
                # The shear of a notch's sections differs from that of a straight beam, and the correction for bending
                # does not apply to shear.
                beam = _SHEAR * material.youngs_modulus_mpa / material.shear_modulus_mpa
                shear = sway_shear(notch) - SWAY_SHEAR + root[1] ** 2 * (SWAY_SHEAR - beam)
                found[:, 1, 1] += shear * parts[:, 0, 0]
            return np.asarray(found)
        shares = (0.0, 0.0)
        if corrected and width_effect:
            ratio = plate_mm / self.flexure.bent_mm
            shares = self.flexure.width_share(plate_mm), stretched_share(ratio, material.poisson_ratio)
        bent, stretched = (1.0 - share * material.poisson_ratio**2 for share in shares)
        return np.array([_segment(self.flexure, span, plate_mm, material, bent, stretched) for span in spans])


def _segment(
    flexure: Flexure, span: tuple[float, float], plate_mm: float, material: Material, bent: float, stretched: float
) -> Array:
    """Compliance of a Timoshenko beam of varying height between two positions along the flexure's axis.

    `bent` and `stretched` are the ratios of the flexure's compliances to those of a strip that is not restrained by its
    width.
    """
    nodes, weights = _GAUSS
    half = 0.5 * (span[1] - span[0])
    x, dx = 0.5 * (span[0] + span[1]) + half * nodes, half * weights
    h, arm = flexure.height_mm(x), span[1] - x
    E, G, b = material.youngs_modulus_mpa / bent, material.shear_modulus_mpa, plate_mm
    bending = [float(np.sum(dx * arm**k * 12.0 / (E * b * h**3))) for k in range(3)]
    shear = float(_SHEAR * np.sum(dx / (G * b * h)))
    along = stretched * float(np.sum(dx / (material.youngs_modulus_mpa * b * h)))
    return timoshenko_compliance(along, shear, bending)


def span_of(flexure: Flexure, region: PlanarRegion) -> FlexureSpan:
    """Find the length over which a flexure is free of the bodies that it joins, and where to cut it from them.

    Raises
    ------
    DataError
        If another cut makes a notch thinner than its neck.
    """
    _check_neck(flexure, region)
    stations = np.linspace(0.0, flexure.half_length_mm * (1.0 - 1e-9), _SAMPLES)
    free, cuts, heights = [], [], []
    for side in (-1.0, 1.0):
        alone = _alone(flexure, region, side * stations)
        last = len(stations) - 1 if alone.all() else int(np.argmin(alone)) - 1
        low, high = stations[max(last, 0)], stations[min(last + 1, len(stations) - 1)]
        for _ in range(_ROUNDS):
            between = np.linspace(low, high, _BETWEEN)
            alone = _alone(flexure, region, side * between[1:])
            last = between.size - 1 if alone.all() else int(np.argmin(alone))
            low, high = between[last], between[min(last + 1, between.size - 1)]
        cut, height = _cut(flexure, region, side, float(low))
        free.append(side * float(low))
        cuts.append(side * cut)
        heights.append(height)
    return FlexureSpan(flexure, (free[0], free[1]), (cuts[0], cuts[1]), (heights[0], heights[1]))


def _check_neck(flexure: Flexure, region: PlanarRegion) -> None:
    """Refuse a flexure that another cut makes thinner than its neck; the largest stress would not be that of the neck.

    Raises
    ------
    DataError
        If material is missing in a strip of the neck's thickness along the axis, where the flexure bends.
    """
    if flexure.kind == "leaf" or flexure.found:
        return
    stations = flexure.half_length_mm * np.linspace(-1.0, 1.0, 2 * _SAMPLES - 1)
    heights = flexure.height_mm(stations)
    stations, heights = (
        stations[heights < _BENDS * flexure.thickness_mm],
        heights[heights < _BENDS * flexure.thickness_mm],
    )
    half = 0.5 * np.minimum(_IN_NECK * heights, _AS_THIN * flexure.thickness_mm)
    points = [flexure.section_mm(stations, y * half) for y in np.linspace(-1.0, 1.0, _IN_SECTION)]
    missing = np.any([~region.holds(np.stack(each)) for each in points], axis=0)
    if missing.any():
        nearest = float(min(stations[missing], key=abs))
        x, y = flexure.section_mm(nearest)
        raise DataError(
            f"flexure {flexure.name} must be thinnest at its centre, but another cut makes it thinner "
            f"{abs(nearest):.3g} mm from its centre, at ({x:.4g}, {y:.4g}) mm; move the cuts apart."
        )


def _alone(flexure: Flexure, region: PlanarRegion, stations: Array) -> NDArray[np.bool_]:
    """Whether, at each position along the axis, the material across the axis is that of the flexure only."""
    half = 0.5 * flexure.height_mm(stations)
    apart = (_BESIDE_FOUND if flexure.found and flexure.is_notch else _BESIDE) * flexure.thickness_mm
    within, beyond = half - apart, half + apart
    points = np.stack(flexure.section_mm(np.tile(stations, 4), np.concatenate([-within, within, -beyond, beyond])))
    held = region.holds(points).reshape(4, -1)
    return np.asarray(held[0] & held[1] & ~held[2] & ~held[3])


def _cut(flexure: Flexure, region: PlanarRegion, side: float, end_mm: float) -> tuple[float, float]:
    """Position and height of the cut on one side of the flexure."""
    t = flexure.thickness_mm
    if not flexure.is_notch:
        straight = min(end_mm, flexure.half_length_mm - flexure.fillet_mm)
        station = max(straight - _SAINT_VENANT * t, _LEAST_SHARE * end_mm)
        return station, float(flexure.height_mm(np.array([station]))[0])
    web_mm = float(flexure.height_mm(np.array([end_mm]))[0])
    station = end_mm + _BEYOND * t
    across = 0.5 * web_mm * np.array([-2.0 * _OVER + 1.0, -0.98, 0.0, 0.98, 2.0 * _OVER - 1.0])
    points = np.stack(flexure.section_mm(np.full(across.size, side * station), across))
    if region.holds(points).tolist() == [False, True, True, True, False]:
        return station, web_mm
    station = _WITHIN * end_mm
    return station, float(flexure.height_mm(np.array([station]))[0])


# Load on a leaf or straight neck: bending with ends that rotate against each other or that sway, and stretching.
#
# The plate's width restrains rotation of the ends, sway and stretching differently (`flexure`). The strain energies of
# a bar follow from the rotations of its ends, the rotation of its chord and its elongation (Timoshenko, Strength of
# Materials): each is E I / (2 L) times a square, see `used_in_plate`. The models need only the fractions of the three
# strain energies, and restraint of the bar hardly changes these fractions.

_ACROSS = 0.4
"""Distance from the axis, as a share of the thickness, of the two points that define a section's rotation."""
_LEAST = 1e-3
"""Share of the whole strain energy below which a strip keeps its assumed fractions; these then change the force by less
than 1e-4."""


def used_in_plate(flexure: Flexure, plate: PlaneStressPlate, moved: Array, whole_n_mm: float) -> Flexure:
    """Set the fractions of a strip's strain energy (three deformations) from the displacements of a meshed plate.

    A strip with a negligible part of the whole energy is left unchanged, because its fractions would be determined by
    rounding errors.
    """
    length, t = flexure.bent_mm, flexure.thickness_mm
    along, across = (np.subtract(flexure.point_mm(*way), flexure.at_mm) for way in ((1.0, 0.0), (0.0, 1.0)))
    shifts, turns = [], []
    for x in (-0.5 * length, 0.5 * length):
        low, high = (plate.rows_at(flexure.point_mm(x, side * _ACROSS * t)) @ moved for side in (-1.0, 1.0))
        shifts.append(0.5 * (low + high))
        turns.append(float(along @ (low - high)) / (2.0 * _ACROSS * t))
    apart = shifts[1] - shifts[0]
    chord = float(across @ apart) / length
    parts = np.array(
        [
            (turns[1] - turns[0]) ** 2,
            3.0 * (turns[0] + turns[1] - 2.0 * chord) ** 2,
            12.0 * (float(along @ apart) / t) ** 2,
        ]
    )
    return _with(
        flexure, parts * plate.material.youngs_modulus_mpa * plate.plate_mm * t**3 / (24.0 * length), whole_n_mm
    )


def used_in_frame(span: FlexureSpan, end_loads: Array, plate: PlaneStressPlate, whole_n_mm: float) -> Flexure:
    """Set the fractions of a strip's strain energy from the loads at the ends of its segments; see `used_in_plate`."""
    tension, first, last = float(end_loads[:, 0].mean()), -float(end_loads[0, 1]), float(end_loads[-1, 2])
    t = span.flexure.thickness_mm
    parts = np.array([(0.5 * (first + last)) ** 2, (0.5 * (first - last)) ** 2 / 3.0, (tension * t) ** 2 / 12.0])
    stiffness = plate.material.youngs_modulus_mpa * plate.plate_mm * t**3 / (6.0 * span.flexure.bent_mm)
    return _with(span.flexure, parts / stiffness, whole_n_mm)


def _with(flexure: Flexure, energies_n_mm: Array, whole_n_mm: float) -> Flexure:
    total = float(energies_n_mm.sum())
    if total <= _LEAST * whole_n_mm:
        return flexure
    bent, swayed, stretched = (energies_n_mm / total).tolist()
    return replace(flexure, used=(bent, swayed, stretched))
