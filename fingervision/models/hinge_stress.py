"""Nominal stress in the hinges of a frame: bending and tension of the section, from the loads at the frame's nodes.

At the surface of a notch the stress is a few per cent higher than in a straight bar, by Neuber's factors for a deep
notch (Kerbspannungslehre, 1937; Pilkey, Peterson's Stress Concentration Factors, charts 2.10 and 2.31). A wide plate
restrains the hinge, and the resulting stress across the plate lowers the von Mises stress.
"""

from math import atan, sqrt

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gripper import Gripper
from fingervision.models.elastic_mechanism import LargestStress
from fingervision.models.hinge_correction import HingeTheory, plane_strain_share
from fingervision.models.notch import Notch, notches_of
from fingervision.models.skeleton import Member, Skeleton

Array = NDArray[np.float64]

_SAMPLES = 9
"""Sections per segment at which the stress is computed: the maximum lies beside the neck if the moment varies along the
hinge."""
_HINGES = ("hinge 1", "hinge 2")
_PLANAR = np.ix_([0, 1, 5], [0, 1, 5])


def peak_hinge_stress(
    gripper: Gripper, skeleton: Skeleton, displacement: Array, theory: HingeTheory = HingeTheory.BEAM
) -> LargestStress:
    """Find the largest stress |N| / (b h) + 6 |M| / (b h^2) in the hinges, nominal or with notch factors.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    skeleton : Skeleton
        Tree of members, with the hinges divided into segments.
    displacement : ndarray of float, shape (3 * (members + 1),)
        Small displacements (mm) and rotations (rad) of the nodes at some input, starting with the clamp.
    theory : HingeTheory
        Beam theory gives the nominal stress of a straight bar; the corrected theory gives the von Mises stress on the
        notch.

    Returns
    -------
    LargestStress
        Stress at that input, on the side of the section where tension and bending stresses add.
    """
    moved = displacement.reshape(-1, 3)
    loads = np.zeros((len(skeleton.members), 3))
    for place, member in enumerate(skeleton.members):
        if member.name in _HINGES:
            axes, start, end = _axes(member)
            first, second = moved[member.parent + 1], moved[place + 1]
            # Displacement of the end if the member moved rigidly with its start.
            carried = first[:2] + first[2] * np.array([start[1] - end[1], end[0] - start[0]])
            strained = np.append(axes @ (second[:2] - carried), second[2] - first[2])
            tension_n, shear_n, moment_n_mm = np.linalg.solve(member.compliance[_PLANAR], strained)
            loads[place] = tension_n, moment_n_mm + shear_n * float(np.hypot(*(end - start))), moment_n_mm
    return peak_of_loads(gripper, skeleton, loads, theory)


def peak_of_loads(gripper: Gripper, skeleton: Skeleton, loads: Array, theory: HingeTheory) -> LargestStress:
    """Largest stress, from tension and end moments of every member (`loads`, shape (members, 3))."""
    lever = gripper.lever
    first, second = notches_of(gripper)
    hinges = {"hinge 1": (lever.hinge1_mm, first), "hinge 2": (lever.hinge2_mm, second)}
    peak = LargestStress(0.0, lever.hinge1_mm)
    way = np.linspace(0.0, 1.0, _SAMPLES)
    for member, (tension_n, at_start, at_end) in zip(skeleton.members, loads.tolist(), strict=True):
        if member.name not in hinges:
            continue
        centre, notch = hinges[member.name]
        axes, start, end = _axes(member)
        places = start + np.outer(way, end - start)
        height_mm = notch.height_mm((places - np.array(centre)) @ axes[0])
        moment_n_mm = at_start + (at_end - at_start) * way
        factors = notch_factors(notch) if theory is HingeTheory.CORRECTED else (1.0, 1.0)
        stress = factors[0] * abs(tension_n) / (notch.plate_mm * height_mm)
        stress += factors[1] * 6.0 * np.abs(moment_n_mm) / (notch.plate_mm * height_mm**2)
        if theory is HingeTheory.CORRECTED:
            # The stress is sigma along the surface and w nu sigma across the plate, with w the share of plane strain.
            across = plane_strain_share(notch) * gripper.material.poisson_ratio
            stress *= sqrt(1.0 - across + across**2)
        highest = int(np.argmax(stress))
        if stress[highest] > peak.mpa:
            side = np.sign(tension_n) * np.sign(moment_n_mm[highest]) or 1.0
            x, y = places[highest] - 0.5 * side * height_mm[highest] * axes[1]
            peak = LargestStress(float(stress[highest]), (float(x), float(y)))
    return peak


def notch_factors(notch: Notch) -> tuple[float, float]:
    """Neuber's stress concentration factors, in tension and bending, of a bar with deep notches on both sides."""
    ratio = 0.5 * notch.curvature_ratio  # half the neck's height over the radius of curvature
    root, angle = sqrt(ratio), atan(sqrt(ratio))
    tension = 2.0 * (ratio + 1.0) * root / ((ratio + 1.0) * angle + root)
    return tension, 4.0 * ratio * root / (3.0 * (root + (ratio - 1.0) * angle))


def _axes(member: Member) -> tuple[Array, Array, Array]:
    start, end = np.array(member.start_mm), np.array(member.end_mm)
    along = (end - start) / np.hypot(*(end - start))
    return np.array([along, [-along[1], along[0]]]), start, end
